"""Harris 3D by what defines it: nothing on planes and edges, corners, and the same places after motion and noise."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.harris import KAPPA, find_key_points, responses
from radioslam.point_cloud.registration import make_features
from radioslam.point_cloud.surface import make_surface
from tests.point_cloud.scenes import camera_at, random_motion, view

CONFIG = load_config(environment={}).registration


def folded(faces):
    """A corner (3), an edge (2) or a plane (1) of square faces with exact normals, 2 cm apart."""
    a, b = np.meshgrid(np.arange(1, 51) * 0.02, np.arange(1, 51) * 0.02)
    points, normals = [], []
    for axis in range(faces):
        face = np.zeros((a.size, 3))
        face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = a.ravel(), b.ravel()
        points.append(face)
        normals.append(np.tile(np.eye(3)[axis], (a.size, 1)))
    return np.concatenate(points), np.concatenate(normals)


def keys_of(points, normals, least=1e-4):
    return find_key_points(points, normals, 0.15, 0.3, least, 100)


def test_planes_and_edges_have_no_key_points():
    assert len(keys_of(*folded(1))) == 0
    assert len(keys_of(*folded(2))) == 0


def test_a_corner_has_one_where_the_faces_meet():
    points, normals = folded(3)
    (key,) = keys_of(points, normals)
    assert np.linalg.norm(points[key]) < 0.1


def test_the_response_has_the_bounds_of_its_formula():
    normals = np.eye(3)
    i, j = np.nonzero(~np.eye(3, dtype=bool))
    np.testing.assert_allclose(responses(normals, i, j), 1 / 27 - KAPPA)
    none = np.zeros(0, np.int64)
    np.testing.assert_allclose(responses(normals, none, none), -KAPPA)


def test_the_response_does_not_turn_with_the_cloud():
    points, normals = folded(3)
    i, j = KDTree(points).query_pairs(0.1, output_type="ndarray").T.astype(np.int64)
    turned = normals @ random_motion(3)[:3, :3].T
    np.testing.assert_allclose(responses(turned, i, j), responses(normals, i, j), atol=1e-12)


def test_key_points_come_strongest_first_keep_their_distance_and_are_few():
    surface = make_surface(view(camera_at(2.0, 2.5, 0.3)), 0.05, 20)
    keys = find_key_points(surface.points, surface.normals, 0.15, 0.2, 1e-6, 25)
    assert 5 < len(keys) <= 25
    gaps = np.linalg.norm(surface.points[keys][:, None] - surface.points[keys][None], axis=2)
    assert gaps[np.triu_indices(len(keys), 1)].min() > 0.2


def repeated(first, second, T, within_m=0.1):
    """Part of the first cloud's key points, seen by both, that the second has too."""
    moved = rigid.transform(T, first.key_points)
    seen = KDTree(second.surface.points).query(moved)[0] < within_m / 2
    return (KDTree(second.key_points).query(moved[seen])[0] < within_m).mean()


def test_key_points_repeat_under_motion_and_noise():
    a, b = camera_at(2.0, 2.5, 0.2), camera_at(2.3, 2.4, 0.45)
    first, second = (make_features(view(T, seed), CONFIG) for T, seed in ((a, 1), (b, 2)))
    wrong = random_motion(1) @ rigid.inverse(b) @ a
    assert repeated(first, second, rigid.inverse(b) @ a) > 0.6
    assert len(first.key_points) > 30
    assert not repeated(first, second, wrong, 0.1) > 0.6


def test_an_empty_cloud_has_no_key_points():
    features = make_features(np.zeros((0, 3)), CONFIG)
    assert features.key_points.shape == (0, 3)
    assert features.descriptors.shape == (0, 352)


@pytest.mark.real_data
def test_key_points_of_real_frames_repeat(data_folder):
    from radioslam.point_cloud import find_recordings
    from radioslam.point_cloud.clouds import read_cloud

    (recording,) = find_recordings([data_folder / "depth-frames"])
    features = [make_features(read_cloud(path), CONFIG) for path in recording.clouds[:6]]
    T = recording.T_odom_body
    shares = [repeated(features[k], features[k + 1], rigid.inverse(T[k + 1]) @ T[k]) for k in range(5)]
    assert np.mean(shares) > 0.5
