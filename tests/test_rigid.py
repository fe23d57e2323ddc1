import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from radioslam import planar, rigid

seeds = st.integers(0, 10_000)


def some_motions(seed, count=5):
    rng = np.random.default_rng(seed)
    return rigid.motion(Rotation.random(count, rng=rng).as_matrix(), rng.normal(0, 10, (count, 3)))


@settings(deadline=None)
@given(seeds)
def test_a_motion_and_its_inverse_cancel(seed):
    T = some_motions(seed)
    np.testing.assert_allclose(T @ rigid.inverse(T), np.tile(np.eye(4), (5, 1, 1)), atol=1e-10)


@settings(deadline=None)
@given(seeds)
def test_fit_finds_the_motion_of_three_points_or_more(seed):
    rng, T = np.random.default_rng(seed), some_motions(seed)
    points = rng.normal(0, 2, (5, 6, 3))
    found = rigid.fit(points, np.array([rigid.transform(one, p) for one, p in zip(T, points, strict=True)]))
    np.testing.assert_allclose(found, T, atol=1e-8)


def test_fit_never_mirrors():
    points = np.random.default_rng(0).normal(size=(8, 3))
    found = rigid.fit(points, points * [1, 1, -1])
    assert np.linalg.det(found[:3, :3]) == pytest.approx(1.0)


@settings(deadline=None)
@given(seeds, st.floats(1e-7, np.pi - 1e-3))
def test_apart_measures_metres_and_radians(seed, turn):
    T = some_motions(seed)
    turned = T @ rigid.motion(Rotation.from_rotvec([0, turn, 0]).as_matrix(), np.array([0.0, 3.0, 4.0]))
    metres, radians = rigid.apart(T, turned)
    np.testing.assert_allclose(metres, 5.0, atol=1e-9)
    np.testing.assert_allclose(radians, turn, atol=1e-9)


@settings(deadline=None)
@given(seeds)
def test_quaternions_and_planar_poses_go_there_and_back(seed):
    T = some_motions(seed)
    np.testing.assert_allclose(rigid.from_quaternions(T[:, :3, 3], rigid.quaternions(T)), T, atol=1e-9)
    poses = np.random.default_rng(seed).uniform(-3, 3, (4, 3))
    np.testing.assert_allclose(rigid.to_planar(rigid.from_planar(poses)), poses, atol=1e-12)
    a, b = rigid.from_planar(poses[:2])
    np.testing.assert_allclose(rigid.to_planar(a @ b), planar.compose(poses[0], poses[1]), atol=1e-12)


def test_interpolation_meets_the_samples_and_goes_the_short_way():
    T = some_motions(1, 3)
    times = np.array([0.0, 1.0, 3.0])
    np.testing.assert_allclose(rigid.interpolate(times, T, times), T, atol=1e-9)
    (half,) = rigid.interpolate(times, T, np.array([2.0]))
    np.testing.assert_allclose(half[:3, 3], (T[1, :3, 3] + T[2, :3, 3]) / 2)
    whole = rigid.apart(T[1], T[2])[1]
    assert rigid.apart(T[1], half)[1] == pytest.approx(whole / 2)


@settings(deadline=None)
@given(seeds)
def test_vectors_of_motions_are_undone(seed):
    T = some_motions(seed)
    np.testing.assert_allclose(rigid.from_vector(rigid.to_vector(T)), T, atol=1e-9)


def test_a_rotation_is_made_proper():
    T = some_motions(1)[0]
    worn = T.copy()
    worn[:3, :3] += 1e-6 * np.arange(9.0).reshape(3, 3)
    R = rigid.proper(worn)[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(R, T[:3, :3], atol=1e-5)


def test_a_bent_path_passes_where_it_shall_and_keeps_its_shape_beyond():
    time_s, at_s = np.arange(10.0), np.array([2.0, 4.5, 7.0])
    path, moved = some_motions(2, 10), some_motions(3, 3)
    bent = rigid.bent(time_s, path, at_s, moved)
    np.testing.assert_allclose(bent[[2, 7]], moved[[0, 2]], atol=1e-9)
    np.testing.assert_allclose(rigid.inverse(bent[7]) @ bent[9], rigid.inverse(path[7]) @ path[9], atol=1e-9)
    np.testing.assert_allclose(rigid.inverse(bent[0]) @ bent[2], rigid.inverse(path[0]) @ path[2], atol=1e-9)
    same = rigid.bent(time_s, path, at_s, rigid.interpolate(time_s, path, at_s))
    np.testing.assert_allclose(same, path, atol=1e-9)
