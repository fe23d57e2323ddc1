import numpy as np
import pytest

from radioslam.config import OdometryConfig, PlacementConfig
from radioslam.odometry import estimate_odometry
from radioslam.smoothing import smooth_fingerprints

from .builders import scans_of, tracked_walk


def straight(scans, seconds=31, speed=1.0, name="walk"):
    time_s = np.arange(float(seconds))
    poses = np.column_stack([speed * time_s, np.zeros((seconds, 2))])
    return estimate_odometry([tracked_walk(poses, time_s, name=name, scans=scans)], OdometryConfig())[0]


def smooth(*tracks, **config):
    return smooth_fingerprints(tracks, PlacementConfig(**config))


def strength(fingerprints, time_s, name="a"):
    row = np.flatnonzero(fingerprints.time_s == time_s)[0]
    return fingerprints.rss_dbm.toarray()[row, fingerprints.transmitters.index(name)]


def test_fingerprints_stand_on_a_clock_of_their_own_as_far_as_scans_reach():
    fingerprints = smooth(straight(scans_of((10, "a", -50), (13, "a", -50))))
    np.testing.assert_allclose(fingerprints.time_s, [4, 7, 10, 13, 16, 19])
    np.testing.assert_allclose(fingerprints.poses[:, 0], fingerprints.time_s)


def test_readings_near_in_time_are_averaged_with_gaussian_weights():
    fingerprints = smooth(straight(scans_of((9, "a", -50), (10, "a", -60), (12, "b", -70))))
    weights = np.exp(-0.5 * (np.array([0.0, 1.0]) / 1.5) ** 2)
    assert strength(fingerprints, 9.0) == pytest.approx(weights @ [-50, -60] / weights.sum())


def test_an_access_point_fades_between_its_readings():
    fingerprints = smooth(straight(scans_of((9, "a", -50), (27, "b", -50))))
    assert strength(fingerprints, 9.0) == pytest.approx(-50)
    assert strength(fingerprints, 12.0) == pytest.approx(-50 - 3 * 1.5)
    assert strength(fingerprints, 15.0) == pytest.approx(-50 - 3 * 4.5)
    assert strength(fingerprints, 18.0) == 0


def test_readings_count_at_the_moment_they_were_heard():
    late = smooth(straight(scans_of((15, "a", -50, 9.0), (16, "b", -50, 15.5))))
    assert strength(late, 9.0) == pytest.approx(-50)


def test_readings_that_a_scan_repeats_count_once():
    twice = smooth(straight(scans_of((9, "a", -50, 9.0), (12, "a", -50, 9.0), (12, "b", -60, 12.0))))
    assert strength(twice, 12.0) == pytest.approx(-50 - 3 * 1.5)


def test_what_fades_below_the_threshold_is_not_heard():
    fingerprints = smooth(straight(scans_of((9, "a", -86), (27, "b", -50))))
    assert strength(fingerprints, 9.0) == pytest.approx(-86)
    assert strength(fingerprints, 12.0) == 0


def test_standing_still_gives_one_fingerprint_per_stretch_walked():
    still = smooth(straight(scans_of(*((t, "a", -50 - t % 2) for t in range(31))), speed=0.2))
    np.testing.assert_array_equal(np.floor(still.distance_m / 3), np.arange(len(still)))


def test_walks_stand_one_after_the_other_and_share_columns():
    tracks = [straight(scans_of((9, "b", -50), (12, "a", -50))), straight(scans_of((9, "c", -50), (12, "a", -50)))]
    fingerprints = smooth(*tracks)
    assert fingerprints.transmitters == ("a", "b", "c")
    assert np.all(np.diff(fingerprints.walk) >= 0)
    assert set(fingerprints.walk.tolist()) == {0, 1}
    assert fingerprints.rss_dbm.shape == (len(fingerprints), 3)


def test_scans_outside_of_the_motion_still_give_the_walk_a_fingerprint():
    fingerprints = smooth(straight(scans_of((100, "a", -50), (101, "a", -51))))
    assert len(fingerprints) == 1


def test_a_stand_counts_as_slow_walking():
    heard = [(second, "a", -50) for second in range(0, 31, 3)]
    standing = smooth(straight(scans_of(*heard), speed=0.0))
    np.testing.assert_allclose(np.diff(standing.time_s), 6.0)  # 3 m at 0.5 m/s
    assert len(smooth(straight(scans_of(*heard), speed=0.0), standing_mps=0.0)) == 1


def test_another_phase_sees_the_walk_at_other_moments():
    track = straight(scans_of((10, "a", -50), (13, "a", -50)))
    later = smooth_fingerprints([track], PlacementConfig(), phase_s=1.0)
    np.testing.assert_allclose(later.time_s, smooth(track).time_s[:-1] + 1.0)
