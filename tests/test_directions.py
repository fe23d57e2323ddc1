from dataclasses import replace

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import DirectionsConfig, OdometryConfig
from radioslam.directions import find_legs, shared_axis, straight_legs
from radioslam.merging import MergedTracks
from radioslam.odometry import estimate_odometry
from radioslam.pose_graph import Edges, Priors

from .builders import tracked_walk

CONFIG = DirectionsConfig(use=True, min_legs=4)


def path(*legs_m, turn=np.pi / 2, start=0.0):
    """Poses a metre apart along straight legs with a turn after each."""
    heading = np.concatenate([np.full(int(length), start + k * turn) for k, length in enumerate(legs_m)])
    steps = np.column_stack([np.cos(heading), np.sin(heading)])
    return np.column_stack([np.vstack([[0, 0], np.cumsum(steps, axis=0)]), np.append(heading, heading[-1])])


def merged_of(*paths):
    tracks = estimate_odometry([tracked_walk(p, name=f"w{k}") for k, p in enumerate(paths)], OdometryConfig())
    walk = np.repeat(np.arange(len(paths)), [len(p) for p in paths])
    return MergedTracks(
        tracks=tuple(tracks),
        walk=walk,
        time_s=np.concatenate([track.time_s for track in tracks]),
        poses=np.concatenate(paths),
        fingerprint=np.arange(len(walk)),
        frame=np.zeros(len(paths), np.int64),
        links=Edges.none(),
        priors=Priors.none(),
    )


def test_legs_end_at_turns_and_at_the_end_of_a_walk():
    begin, end, length = find_legs(merged_of(path(10, 8), path(12)), CONFIG)
    np.testing.assert_array_equal(begin, [0, 10, 19])
    np.testing.assert_array_equal(end, [10, 18, 31])
    np.testing.assert_allclose(length, [10, 8, 12])


def test_short_stretches_and_curves_are_no_legs():
    curve = path(*[1] * 40, turn=0.1)
    assert len(find_legs(merged_of(path(4, 3, 5)), CONFIG)[0]) == 0
    assert len(find_legs(merged_of(curve), CONFIG)[0]) == 0


def test_somebody_who_stands_has_no_legs():
    assert len(find_legs(merged_of(np.zeros((9, 3))), CONFIG)[0]) == 0


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, 89.0, 130.0])
def test_the_axis_is_found_whichever_way_the_legs_run(degrees):
    directions = np.radians(degrees) + np.arange(8) * np.pi / 2
    axis, share = shared_axis(directions, np.full(8, 10.0))
    assert share == 1.0
    assert abs(planar.wrap(4 * (axis - np.radians(degrees)))) / 4 <= np.radians(0.5)


def test_legs_in_all_directions_share_no_axis():
    directions = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    assert shared_axis(directions, np.ones(360))[1] == pytest.approx(20 / 90, abs=0.02)
    star = merged_of(*(path(20, start=a) for a in directions[::10]))
    assert straight_legs(star, CONFIG) is None


def test_legs_of_a_rectangular_building_share_its_axis():
    walks = [path(20, 10, 20, 10, start=0.3 + error) for error in (-0.1, 0.0, 0.1)]
    legs = straight_legs(merged_of(*walks), CONFIG)
    assert legs is not None
    assert len(legs) == 12
    assert legs.axis_rad == pytest.approx(0.3, abs=0.02)
    assert np.all(legs.sigma_rad > CONFIG.sigma_rad)


def test_few_legs_show_nothing_and_the_user_may_forbid_it():
    rectangle = merged_of(path(20, 10, 20, 10))
    assert straight_legs(rectangle, CONFIG) is not None
    assert straight_legs(rectangle, CONFIG.model_copy(update={"min_legs": 5})) is None
    assert straight_legs(rectangle, CONFIG.model_copy(update={"use": False})) is None


def test_velocities_turn_with_the_estimate():
    merged = merged_of(path(20))
    turned = merged.poses @ planar_turn(0.5)
    turned[:, 2] = merged.poses[:, 2] + 0.5
    expected = np.tile([np.cos(0.5), np.sin(0.5)], (15, 1))
    np.testing.assert_allclose(replace(merged, poses=turned).velocities()[3:18], expected, atol=1e-9)


def planar_turn(angle):
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    return turn
