"""SHOT by what defines it: unit length, invariance, a reproducible frame, and that it tells places apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.matching import match
from radioslam.point_cloud.registration import make_features
from radioslam.point_cloud.shot import LENGTH, describe, reference_frames
from radioslam.point_cloud.surface import make_surface
from tests.point_cloud.scenes import camera_at, random_motion, view

CONFIG = load_config(environment={}).registration
SURFACE = make_surface(view(camera_at(2.0, 2.5, 0.3)), 0.05, 20)
KEYS = np.arange(0, len(SURFACE), 97)


def test_descriptors_have_352_values_and_length_one():
    descriptors, known = describe(SURFACE.points, SURFACE.normals, KEYS, 0.6)
    assert descriptors.shape == (len(KEYS), LENGTH) == (len(KEYS), 352)
    assert known.mean() > 0.9
    np.testing.assert_allclose(np.linalg.norm(descriptors[known], axis=1), 1.0)
    assert (descriptors >= 0).all()


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000))
def test_descriptors_do_not_change_when_the_cloud_moves(seed):
    T = random_motion(seed)
    here, known = describe(SURFACE.points, SURFACE.normals, KEYS, 0.6)
    moved = rigid.transform(T, SURFACE.points), SURFACE.normals @ T[:3, :3].T
    there, _ = describe(*moved, KEYS, 0.6)
    # An axis on which as many points lie before as behind may flip by rounding: all but one in a hundred must agree.
    distance = np.linalg.norm(here - there, axis=1)[known]
    assert (distance < 1e-6).mean() >= 0.99


def test_the_order_of_points_does_not_matter():
    order = np.random.default_rng(0).permutation(len(SURFACE))
    back = np.argsort(order)
    here, _ = describe(SURFACE.points, SURFACE.normals, KEYS, 0.6)
    there, _ = describe(SURFACE.points[order], SURFACE.normals[order], back[KEYS], 0.6)
    np.testing.assert_allclose(here, there, atol=1e-9)


def test_frames_are_right_handed_and_point_to_where_most_points_are():
    rng = np.random.default_rng(2)
    offset = rng.uniform([-0.1, -0.05, -0.01], [0.5, 0.05, 0.02], (400, 3))
    distance = np.linalg.norm(offset, axis=1)
    (frame,) = reference_frames(offset, distance, np.zeros(400, np.int64), 1, 0.6)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[0, 0] > 0.99  # most points lie at positive x, the widest direction
    assert frame[2, 2] > 0.9  # and above, in the thinnest


def test_a_tie_between_the_sides_is_decided_by_points_at_the_median_distance():
    x = np.array([0.10, 0.29, 0.30, 0.31, -0.05, -0.5, -0.55, -0.58])
    offset = np.column_stack([x, 0.001 * np.arange(8), 1e-4 * np.arange(8)])
    (frame,) = reference_frames(offset, np.abs(x), np.zeros(8, np.int64), 1, 0.6)
    assert frame[0, 0] > 0  # four on each side; those near the median (0.305) lie at positive x


def test_lonely_key_points_are_told():
    points = np.concatenate([SURFACE.points, [[50.0, 0.0, 0.0]]])
    normals = np.concatenate([SURFACE.normals, [[0.0, 0.0, 1.0]]])
    descriptors, known = describe(points, normals, np.array([len(SURFACE)]), 0.6)
    assert not known[0]
    assert not descriptors.any()


def precision(first, second, T_second_first, ratio=0.95, within_m=0.1):
    i, j = match(first.descriptors, second.descriptors, ratio)
    moved = rigid.transform(T_second_first, first.key_points[i])
    right = np.linalg.norm(moved - second.key_points[j], axis=1) <= within_m
    return right.mean(), int(right.sum())


def test_matches_of_two_views_beat_chance_by_far():
    a, b = camera_at(2.0, 2.5, 0.2), camera_at(2.3, 2.4, 0.45)
    first, second = (make_features(view(T, seed), CONFIG) for T, seed in ((a, 1), (b, 2)))
    share, count = precision(first, second, rigid.inverse(b) @ a)
    assert share > 0.3  # by chance one in a hundred
    assert count > 10


@pytest.mark.real_data
def test_matches_of_real_frames_beat_chance_by_far(data_folder):
    """With about 150 key points, of which a ball of 10 cm holds two, a match is right by chance once in a hundred."""
    from radioslam.point_cloud import find_recordings
    from radioslam.point_cloud.clouds import read_cloud

    (recording,) = find_recordings([data_folder / "depth-frames"])
    features = [make_features(read_cloud(path), CONFIG) for path in recording.clouds[:8]]
    T = recording.T_odom_body
    found = [precision(features[k], features[k + 1], rigid.inverse(T[k + 1]) @ T[k]) for k in range(7)]
    assert np.mean([share for share, _ in found]) > 0.3
    assert min(count for _, count in found) >= 5
