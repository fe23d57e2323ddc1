import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam import rigid
from radioslam.point_cloud.matching import find_motions, match
from tests.point_cloud.scenes import random_motion


def unit(rows):
    rows = np.asarray(rows, dtype=np.float32)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def test_matches_are_mutual_and_clearly_nearest():
    target = unit([[1, 0, 0], [0, 1, 0], [0, 1, 0.02]])
    i, j = match(target, unit([[1, 0.1, 0], [0, 1, 0.01]]), 0.9)
    assert i.tolist() == [0]  # the second source lies between two targets
    assert j.tolist() == [0]


def test_the_ratio_is_one_of_distances():
    target, source = unit([[1, 0], [0, 1]]), unit([[1, 0.5]])
    first, second = np.linalg.norm(target - source, axis=1)
    assert len(match(target, source, first / second + 1e-3)[0]) == 1
    assert len(match(target, source, first / second - 1e-3)[0]) == 0


def test_too_few_descriptors_match_nothing():
    none = np.zeros((0, 352), np.float32)
    assert len(match(none, unit(np.eye(3)), 0.9)[0]) == 0
    assert len(match(unit(np.eye(3)), none, 0.9)[0]) == 0


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000))
def test_the_motion_is_found_among_four_fifths_of_wrong_matches(seed):
    rng = np.random.default_rng(seed)
    source, T = rng.uniform(-3, 3, (100, 3)), random_motion(seed)
    target = rigid.transform(T, source) + rng.normal(0, 0.01, (100, 3))
    target[20:] = rng.uniform(-3, 3, (80, 3))
    (found, support), *_ = find_motions(target, source, 0.1, 4000, 2, rng)
    metres, radians = rigid.apart(found, T)
    assert metres < 0.1
    assert radians < 0.05
    assert 18 <= support <= 30


def test_a_second_motion_explains_other_matches():
    rng = np.random.default_rng(0)
    source = rng.uniform(-3, 3, (60, 3))
    first, second = random_motion(1), random_motion(2)
    target = np.concatenate([rigid.transform(first, source[:35]), rigid.transform(second, source[35:])])
    found = [T for T, _ in find_motions(target, source, 0.1, 4000, 2, rng)]
    np.testing.assert_allclose(found, [first, second], atol=1e-6)


@pytest.mark.parametrize("count", [0, 2])
def test_fewer_than_three_matches_give_no_motion(count):
    points = np.zeros((count, 3))
    assert find_motions(points, points, 0.1, 100, 1, np.random.default_rng(0)) == []


def test_points_on_one_spot_give_no_motion():
    points = np.zeros((10, 3))
    assert find_motions(points, points, 0.1, 100, 1, np.random.default_rng(0)) == []
