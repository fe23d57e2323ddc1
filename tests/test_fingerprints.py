from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from radioslam.config import FingerprintConfig, OdometryConfig
from radioslam.fingerprints import collect_fingerprints, fresh_readings, represent, with_beacons
from radioslam.odometry import estimate_odometry

from .builders import scans_of, tracked_walk

EVERYTHING = FingerprintConfig(rss_threshold_dbm=-127.0)
EAST = np.column_stack([2.0 * np.arange(6), np.zeros((6, 2))])


def collect(*scans, config=EVERYTHING):
    walks = [tracked_walk(EAST, name=f"walk {k}", scans=s) for k, s in enumerate(scans)]
    tracks = estimate_odometry(walks, OdometryConfig())
    return collect_fingerprints(tracks, config)


def fresh(*readings, max_age_s=5.0):
    """Freshness of readings, which must be given in the order of scans and transmitters."""
    return fresh_readings(scans_of(*readings), max_age_s).tolist()


# Poses


def test_each_scan_has_the_pose_and_distance_at_its_own_time():
    fingerprints = collect(scans_of((0.5, "a", -50), (3.25, "a", -51)))
    np.testing.assert_allclose(fingerprints.poses, [[1.0, 0, 0], [6.5, 0, 0]])
    np.testing.assert_allclose(fingerprints.distance_m, [1.0, 6.5])
    np.testing.assert_allclose(fingerprints.time_s, [0.5, 3.25])


def test_fingerprints_stand_in_the_order_of_the_walks_and_of_time():
    fingerprints = collect(
        scans_of((3, "a", -50), (1, "a", -51)), scans_of((0, "a", -52), (2, "a", -53), (4, "a", -54))
    )
    np.testing.assert_array_equal(fingerprints.walk, [0, 0, 1, 1, 1])
    np.testing.assert_array_equal(fingerprints.scan, [0, 1, 0, 1, 2])
    np.testing.assert_array_equal(fingerprints.time_s, [1, 3, 0, 2, 4])
    np.testing.assert_array_equal(fingerprints.rss_dbm.toarray().ravel(), [-51, -50, -52, -53, -54])


def test_transmitters_of_all_walks_share_their_columns():
    fingerprints = collect(scans_of((0, "c", -50), (0, "a", -51)), scans_of((0, "b", -52), (0, "c", -53)))
    assert fingerprints.transmitters == ("a", "b", "c")
    np.testing.assert_array_equal(fingerprints.rss_dbm.toarray(), [[-51, 0, -50], [0, -52, -53]])


def test_readings_below_the_threshold_are_dropped_and_those_at_it_stay():
    config = FingerprintConfig(rss_threshold_dbm=-70)
    fingerprints = collect(scans_of((0, "a", -70), (0, "b", -70.1), (1, "b", -90)), config=config)
    np.testing.assert_array_equal(fingerprints.rss_dbm.toarray(), [[-70, 0], [0, 0]])


def test_a_scan_left_without_readings_keeps_its_row():
    fingerprints = collect(scans_of((0, "a", -90), (1, "a", -50)), config=FingerprintConfig(rss_threshold_dbm=-70))
    assert len(fingerprints) == 2
    np.testing.assert_array_equal(np.diff(fingerprints.rss_dbm.indptr), [0, 1])


def test_stale_readings_do_not_reach_the_matrix():
    fingerprints = collect(scans_of((10, "a", -50, 1.0), (10, "b", -60, 9.5)))
    np.testing.assert_array_equal(fingerprints.rss_dbm.toarray(), [[0, -60]])


# Freshness where the phone says when it heard a transmitter


def test_a_reading_heard_too_long_before_its_scan_is_stale():
    assert fresh((10, "a", -50, 4.9), (10, "b", -50, 5.0), (10, "c", -50, 9.0)) == [False, True, True]


def test_the_same_hearing_of_a_transmitter_counts_once():
    assert fresh((1, "a", -50, 0.5), (2, "a", -50, 0.5), (3, "a", -50, 0.5), (4, "a", -50, 3.5)) == [
        True,
        False,
        False,
        True,
    ]


def test_two_transmitters_heard_at_one_time_are_both_fresh():
    assert fresh((1, "a", -50, 0.5), (1, "b", -50, 0.5)) == [True, True]


def test_a_new_hearing_is_fresh_though_its_strength_is_the_same():
    assert fresh((1, "a", -50, 0.5), (2, "a", -50, 1.5)) == [True, True]


# Freshness where it does not


def test_a_scan_equal_to_the_one_before_holds_nothing_new():
    twice = [(t, name, rss) for t in (1, 2, 3) for name, rss in (("a", -50), ("b", -60))]
    assert fresh(*twice) == [True, True, False, False, False, False]


def test_one_other_strength_makes_a_whole_scan_new():
    assert fresh((1, "a", -50), (1, "b", -60), (2, "a", -50), (2, "b", -61)) == [True] * 4


def test_the_same_strengths_of_other_transmitters_are_new():
    assert fresh((1, "a", -50), (1, "b", -60), (2, "a", -50), (2, "c", -60)) == [True] * 4


@pytest.mark.parametrize("more", ["first", "second"])
def test_a_scan_with_a_reading_more_or_less_is_new(more):
    one = [(1.0, "a", -50.0), (1.0, "b", -60.0), (2.0, "a", -50.0), (2.0, "b", -60.0)]
    one.append((1.0, "c", -70.0) if more == "first" else (2.0, "c", -70.0))
    assert fresh(*one) == [True] * 5


def test_a_scan_that_comes_back_after_another_is_new():
    assert fresh((1, "a", -50), (2, "a", -51), (3, "a", -50)) == [True] * 3


def test_both_rules_hold_side_by_side():
    """Of a repeated scan the reading without a time is a repeat; the one with a time says itself that it is new."""
    assert fresh((1, "a", -50, 0.9), (1, "b", -60), (2, "a", -50, 1.9), (2, "b", -60)) == [True, True, True, False]


def test_no_readings_are_no_problem():
    assert fresh() == []


# Representations


RSS = sparse.csr_array(np.array([[-50.0, 0.0], [-110.0, -100.0]]))


def test_dbm_is_the_raw_value():
    np.testing.assert_array_equal(represent(RSS, FingerprintConfig(representation="dbm")).toarray(), RSS.toarray())


def test_positive_counts_from_the_floor_and_stays_above_zero():
    strengths = represent(RSS, FingerprintConfig(representation="positive", floor_dbm=-100))
    np.testing.assert_allclose(strengths.toarray(), [[50, 0], [0.1, 0.1]])


def test_exponential_grows_by_e_per_scale():
    config = FingerprintConfig(representation="exponential", floor_dbm=-100, exponential_scale_db=25)
    np.testing.assert_allclose(represent(RSS, config).toarray(), [[np.e**2, 0], [np.exp(-0.4), 1]])


@pytest.mark.parametrize("representation", ["dbm", "positive", "exponential"])
def test_representing_leaves_the_readings_as_they_were(representation):
    before = RSS.toarray()
    represent(RSS, FingerprintConfig(representation=representation)).data[:] = 7.0
    np.testing.assert_array_equal(RSS.toarray(), before)


# Beacons


def with_ble(wifi, ble, **config):
    walk = replace(tracked_walk(EAST, scans=wifi), ble=ble)
    return with_beacons(walk, FingerprintConfig(beacons=True, **config))


def strength(scans, name):
    column = scans.transmitters.index(name)
    here = scans.reading_transmitter == column
    return dict(zip(scans.reading_scan[here].tolist(), scans.rss_dbm[here].tolist(), strict=True))


def test_beacons_belong_to_the_nearest_scan_by_their_mean():
    wifi = scans_of((0, "a", -50), (4, "a", -51))
    ble = scans_of((0.5, "b", -60), (1.5, "b", -70), (3.5, "b", -80), (3.5, "c", -90))
    scans = with_ble(wifi, ble)
    assert strength(scans, "ble:b") == {0: -65.0, 1: -80.0}
    assert strength(scans, "ble:c") == {1: -90.0}
    assert strength(scans, "a") == {0: -50.0, 1: -51.0}


def test_beacons_far_from_every_scan_are_left_out():
    scans = with_ble(scans_of((0, "a", -50)), scans_of((5.0, "b", -60)), beacon_window_s=3.0)
    assert "ble:b" not in scans.transmitters


def test_scans_that_heard_no_access_point_keep_their_place_among_beacons():
    wifi = scans_of((0, "a", -50), (4, "a", -51))
    silent = replace(wifi, scan_time_s=np.array([0.0, 2.0, 4.0]), reading_scan=np.array([0, 2]))
    scans = with_ble(silent, scans_of((2.1, "b", -60)))
    np.testing.assert_array_equal(scans.scan_time_s, [0, 2, 4])
    assert strength(scans, "ble:b") == {1: -60.0}


def test_beacons_are_columns_of_the_crowd_if_asked_for():
    walk = replace(tracked_walk(EAST, scans=scans_of((1, "a", -50))), ble=scans_of((1, "b", -60)))
    tracks = estimate_odometry([walk], OdometryConfig())
    assert collect_fingerprints(tracks, EVERYTHING).transmitters == ("a",)
    both = EVERYTHING.model_copy(update={"beacons": True})
    assert collect_fingerprints(tracks, both).transmitters == ("a", "ble:b")


def test_who_sees_one_scan_alone_does_not_know_what_is_repeated():
    walk = tracked_walk(EAST, scans=scans_of((0, "ap", -50), (1, "ap", -50), (2, "ap", -60)))
    tracks = estimate_odometry([walk], OdometryConfig())
    fresh, told = (collect_fingerprints(tracks, EVERYTHING, repeats) for repeats in (False, True))
    assert np.diff(fresh.rss_dbm.indptr).tolist() == [1, 0, 1]
    assert told.rss_dbm.toarray().ravel().tolist() == [-50, -50, -60]
