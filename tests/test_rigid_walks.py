import numpy as np
import pytest

from radioslam import planar
from radioslam.rigid_walks import MeanBlock, Placement, RigidWalks, SamePlaceBlock, TurnBlock

from .builders import numeric_jacobian

WALK = np.array([0, 0, 0, 1, 1, 2, 2])


@pytest.fixture
def rigid():
    return RigidWalks.of(WALK, *np.random.default_rng(1).normal(0, 10, (2, 7, 2)), 3)


@pytest.fixture
def x(rigid):
    return np.random.default_rng(2).normal(0, 1, rigid.size)


def as_dense(block, jacobian, size):
    """Jacobians (m, d, k) of a block as one matrix (m, d, n); an unknown may stand in a factor twice."""
    dense = np.zeros((*jacobian.shape[:2], size))
    for row, variables in enumerate(block.variables):
        for column, variable in enumerate(variables):
            dense[row, :, variable] += jacobian[row, :, column]
    return dense


def blocks(rigid):
    i, j = np.array([0, 1, 2, 4]), np.array([3, 5, 6, 5])
    return [
        SamePlaceBlock(rigid, i, j, np.array([1.0, 2.0, 3.0, 4.0])),
        TurnBlock(rigid.unknowns(2), rigid.common_turn, 0.2),
        MeanBlock(rigid.unknowns(3), 0.003),
    ]


@pytest.mark.parametrize("k", range(3))
def test_jacobians_agree_with_differences(rigid, x, k):
    block = blocks(rigid)[k]
    residuals, jacobian = block.linearize(x)
    np.testing.assert_allclose(residuals, block.residuals(x))
    numeric = numeric_jacobian(block.residuals, x)
    np.testing.assert_allclose(as_dense(block, jacobian, len(x)), numeric, atol=1e-6 * np.abs(numeric).max())


def test_points_are_seen_from_the_mean_of_their_walk(rigid):
    for k in range(3):
        np.testing.assert_allclose(rigid.points[k == WALK].mean(axis=0), 0, atol=1e-12)


def test_walks_at_their_centres_without_turn_or_scale_are_where_they_were(rigid):
    x = np.zeros(rigid.size)
    rigid.places(x)[:, :2] = rigid.centre
    np.testing.assert_allclose(rigid.positions(x), rigid.points + rigid.centre[WALK])


def test_a_walk_turns_and_grows_about_its_centre(rigid):
    x = np.zeros(rigid.size)
    x[rigid.unknowns(2)], x[rigid.unknowns(3)] = np.pi / 2, np.log(2.0)
    np.testing.assert_allclose(rigid.positions(x), 2 * planar.rotate(np.pi / 2, rigid.points), atol=1e-12)


def test_the_gauge_is_one_factor_of_the_mean(rigid):
    x = np.zeros(rigid.size)
    x[rigid.unknowns(3)] = [0.01, 0.02, 0.03]
    assert MeanBlock(rigid.unknowns(3), 0.01).residuals(x) == pytest.approx(2.0)
    x[rigid.unknowns(3)] = [-0.5, 0.2, 0.3]
    assert MeanBlock(rigid.unknowns(3), 0.01).residuals(x) == pytest.approx(0.0)


def test_turns_count_from_what_turns_all_compasses(rigid):
    x = np.zeros(rigid.size)
    x[rigid.unknowns(2)], x[rigid.common_turn] = 0.4, 0.4
    np.testing.assert_allclose(TurnBlock(rigid.unknowns(2), rigid.common_turn, 0.1).residuals(x), 0)


def test_a_radio_that_lags_tells_where_the_walker_was_before(rigid):
    x = np.zeros(rigid.size)
    x[rigid.lag] = 2.0
    np.testing.assert_allclose(rigid.positions(x), rigid.points - 2.0 * rigid.velocity)


def test_a_placement_lays_poses_as_the_crowd_lays_points(rigid, x):
    x[rigid.lag] = 0.0  # poses are where the walker was, whenever the radio heard
    place = rigid.places(x)
    placement = Placement(rigid.centre, place, np.zeros(3, np.int64), np.ones(3), ("",) * 3, np.zeros(3, bool))
    poses = placement.poses(WALK, np.column_stack([rigid.points + rigid.centre[WALK], np.full(7, 0.3)]))
    np.testing.assert_allclose(poses[:, :2], rigid.positions(x))
    np.testing.assert_allclose(poses[:, 2], 0.3 + place[WALK, 2])
