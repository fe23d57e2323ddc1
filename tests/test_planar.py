import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radioslam import planar

numbers = st.floats(-1e3, 1e3)
poses = st.tuples(numbers, numbers, st.floats(-20, 20)).map(np.array)
IDENTITY = np.zeros(3)


def assert_same_pose(a, b):
    np.testing.assert_allclose(a[..., :2], b[..., :2], atol=1e-9)
    np.testing.assert_allclose(planar.wrap(a[..., 2] - b[..., 2]), 0.0, atol=1e-9)


@given(poses, poses, poses)
def test_composition_is_associative(a, b, c):
    assert_same_pose(planar.compose(planar.compose(a, b), c), planar.compose(a, planar.compose(b, c)))


@given(poses)
def test_the_identity_changes_nothing(a):
    assert_same_pose(planar.compose(a, IDENTITY), a)
    assert_same_pose(planar.compose(IDENTITY, a), a)


@given(poses)
def test_a_pose_and_its_inverse_cancel_on_both_sides(a):
    assert_same_pose(planar.compose(a, planar.inverse(a)), IDENTITY)
    assert_same_pose(planar.compose(planar.inverse(a), a), IDENTITY)


@given(poses, poses)
def test_between_undoes_compose(a, b):
    assert_same_pose(planar.between(a, planar.compose(a, b)), b)
    assert_same_pose(planar.between(a, b), planar.compose(planar.inverse(a), b))


def test_compose_walks_in_the_frame_of_the_first_pose():
    facing_north = np.array([10.0, 0.0, np.pi / 2])
    one_ahead_then_left = np.array([1.0, 0.0, np.pi / 2])
    assert_same_pose(planar.compose(facing_north, one_ahead_then_left), np.array([10.0, 1.0, np.pi]))


def test_many_poses_are_composed_at_once():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 4, 5, 3))
    together = planar.compose(a, b)
    assert together.shape == (4, 5, 3)
    assert_same_pose(together[2, 3], planar.compose(a[2, 3], b[2, 3]))
    assert_same_pose(planar.compose(a[0, 0], b)[1, 1], planar.compose(a[0, 0], b[1, 1]))


@given(st.floats(-1e4, 1e4))
def test_wrapping_keeps_the_direction_and_lands_in_the_half_open_turn(angle):
    wrapped = planar.wrap(angle)
    assert -np.pi <= wrapped < np.pi
    np.testing.assert_allclose([np.cos(wrapped), np.sin(wrapped)], [np.cos(angle), np.sin(angle)], atol=1e-9)


@pytest.mark.parametrize("angle", [np.pi, -np.pi, 3 * np.pi, np.nextafter(np.pi, 0.0), np.nextafter(-np.pi, -4.0)])
def test_wrapping_holds_its_range_at_the_seam(angle):
    assert -np.pi <= planar.wrap(angle) < np.pi


@given(st.floats(-6, 6), numbers, numbers)
def test_rotation_keeps_lengths_and_turns_by_the_angle(theta, x, y):
    turned = planar.rotate(theta, [x, y])
    assert np.hypot(*turned) == pytest.approx(np.hypot(x, y), abs=1e-9)
    np.testing.assert_allclose(
        turned, [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]] @ np.array([x, y]), atol=1e-9
    )


def test_interpolation_meets_the_poses_and_goes_straight_between():
    path = np.array([[0.0, 0.0, 0.0], [2.0, 4.0, 1.0]])
    between = planar.interpolate(np.array([10.0, 20.0]), path, np.array([10.0, 15.0, 20.0]))
    np.testing.assert_allclose(between, [[0, 0, 0], [1, 2, 0.5], [2, 4, 1]])


@pytest.mark.parametrize(("start", "end", "middle"), [(170, -170, 180), (-170, 170, 180), (-90, 80, -5), (10, 350, 0)])
def test_interpolation_turns_along_the_shorter_arc(start, end, middle):
    path = np.array([[0.0, 0.0, np.radians(start)], [0.0, 0.0, np.radians(end)]])
    halfway = planar.interpolate(np.array([0.0, 1.0]), path, np.array([0.5]))[0, 2]
    assert planar.wrap(halfway - np.radians(middle)) == pytest.approx(0.0, abs=1e-12)


def test_outside_of_the_times_the_first_or_last_pose_holds():
    path = np.array([[1.0, 2.0, 0.3], [4.0, 5.0, 0.6]])
    np.testing.assert_allclose(planar.interpolate(np.array([0.0, 1.0]), path, np.array([-5.0, 9.0])), path)


def test_path_length_adds_up_from_zero():
    corner = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 10.0], [3.0, 10.0]])
    np.testing.assert_allclose(planar.path_length(corner), [0, 5, 11, 11])
    np.testing.assert_allclose(planar.path_length(corner[:1]), [0])


@given(poses, st.integers(0, 2**32 - 1))
def test_alignment_recovers_any_motion(motion, seed):
    source = np.random.default_rng(seed).normal(size=(6, 2))
    assert_same_pose(planar.align_rigid(source, planar.transform(motion, source)), motion)


def test_alignment_never_scales():
    source = np.random.default_rng(1).normal(size=(20, 2))
    aligned = planar.transform(planar.align_rigid(source, 3.0 * source + [5.0, 7.0]), source)
    np.testing.assert_allclose(aligned, source - source.mean(axis=0) + (3 * source + [5.0, 7.0]).mean(axis=0))


def test_no_motion_nearby_aligns_better():
    rng = np.random.default_rng(2)
    source, target = rng.normal(size=(2, 15, 2))
    best = planar.align_rigid(source, target)

    def misfit(pose):
        return np.sum((planar.transform(pose, source) - target) ** 2)

    assert all(misfit(best) < misfit(best + nudge) for nudge in 1e-3 * np.vstack([np.eye(3), -np.eye(3)]))


def test_a_single_point_is_moved_but_not_turned():
    np.testing.assert_allclose(planar.align_rigid(np.array([[1.0, 2.0]]), np.array([[5.0, 5.0]])), [4.0, 3.0, 0.0])


@given(poses, poses)
def test_transforming_a_point_is_composing_its_position(a, b):
    np.testing.assert_allclose(planar.transform(a, b[None, :2])[0], planar.compose(a, b)[:2], atol=1e-9)
