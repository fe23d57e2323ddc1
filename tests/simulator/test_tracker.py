import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.planar import path_length, wrap
from radioslam.simulator import TrackerDrift, with_tracker_drift
from radioslam.simulator.tracker import drifted_poses, pose_times, travel_headings
from radioslam.walk import RadioScans, Reference, Walk

STRAIGHT = np.stack([np.linspace(0, 100, 201), np.zeros(201)], axis=1)


def walk_along(time_s, positions_xy, name="walk"):
    return Walk(name, RadioScans.from_readings([0.0], ["a"], [-50.0]), reference=Reference(time_s, positions_xy))


def test_poses_stand_at_the_fixes_and_every_second_between():
    times = pose_times(np.array([0.0, 2.5, 3.0, 5.0]))
    np.testing.assert_allclose(times, [0, 1, 2, 2.5, 3, 4, 5])
    np.testing.assert_allclose(pose_times(np.array([7.0])), [7.0])


def test_without_drift_the_odometry_is_the_truth():
    bend = np.array([[3.0, 4.0], [3.0, 14.0], [13.0, 14.0]])
    poses = drifted_poses(bend, TrackerDrift(0.0, 0.0, 0.0), np.random.default_rng(0))
    np.testing.assert_allclose(poses[:, :2], bend - bend[0], atol=1e-12)
    np.testing.assert_allclose(poses[:, 2], [np.pi / 2, np.pi / 2, 0.0], atol=1e-12)


def test_drift_has_the_stated_statistics():
    drift = TrackerDrift()
    runs = [drifted_poses(STRAIGHT, drift, np.random.default_rng(k)) for k in range(1500)]
    length = np.array([path_length(run[:, :2])[-1] for run in runs]) / 100.0
    heading_deg = np.rad2deg(wrap([run[-1, 2] for run in runs]))
    assert length.mean() == pytest.approx(1.0, abs=0.003)
    assert length.std() == pytest.approx(0.02, rel=0.1)
    # After 100 m: bias 0.10 deg/m gives 10 deg, random walk 1.2 deg/sqrt(m) gives 12 deg.
    assert heading_deg.std() == pytest.approx(np.hypot(10.0, 12.0), rel=0.08)
    assert heading_deg.mean() == pytest.approx(0.0, abs=1.5)


def test_initial_heading_is_true():
    poses = drifted_poses(STRAIGHT[:, ::-1], TrackerDrift(), np.random.default_rng(3))
    assert poses[0] == pytest.approx([0.0, 0.0, np.pi / 2])


def test_order_and_company_do_not_matter():
    walks = [walk_along(np.arange(201.0), STRAIGHT, name) for name in ("a", "b", "c")]
    forward = {w.name: with_tracker_drift(w, 5).odometry.values for w in walks}
    backward = {w.name: with_tracker_drift(w, 5).odometry.values for w in reversed(walks[1:])}
    for name, values in backward.items():
        np.testing.assert_array_equal(values, forward[name])
    assert not np.allclose(forward["a"], forward["b"])
    assert not np.allclose(forward["a"], with_tracker_drift(walks[0], 6).odometry.values)


def test_a_generator_can_be_given():
    walk = walk_along(np.arange(201.0), STRAIGHT)
    a, b = (with_tracker_drift(walk, np.random.default_rng(1)).odometry.values for _ in range(2))
    np.testing.assert_array_equal(a, b)


def test_standing_still_keeps_the_heading_and_the_place():
    path = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 1.0], [1.0, 1.0]])
    np.testing.assert_allclose(travel_headings(np.diff(path, axis=0)), [np.pi / 2, np.pi / 2, np.pi / 2, 0.0])
    poses = drifted_poses(path, TrackerDrift(), np.random.default_rng(0))
    np.testing.assert_allclose(poses[0], poses[1])
    np.testing.assert_allclose(poses[2], poses[3])
    assert np.isfinite(drifted_poses(np.zeros((3, 2)), TrackerDrift(), np.random.default_rng(0))).all()


@pytest.mark.parametrize("count", [0, 1])
def test_a_path_is_needed(count):
    walk = walk_along(np.arange(float(count)), np.zeros((count, 2)))
    with pytest.raises(LogError, match="reference positions along the walk"):
        with_tracker_drift(walk, 1)
