from __future__ import annotations

import numpy as np
import pytest

from radioslam import planar
from radioslam.accuracy import ErrorStatistics, alignment_pose, position_errors, segment_errors, size_ratio


def test_statistics_of_a_hand_computed_case():
    statistics = ErrorStatistics.of(np.array([3.0, 1.0, np.nan, 2.0, 4.0]))
    assert statistics.count == 4
    assert statistics.mean == 2.5
    assert statistics.median == 2.5
    assert statistics.std == pytest.approx(np.sqrt(1.25))
    assert statistics.rmse == pytest.approx(np.sqrt(7.5))
    assert statistics.max == 4.0
    assert statistics.p75 == pytest.approx(3.25)


def test_no_error_at_all_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        ErrorStatistics.of(np.array([np.nan]))


def test_errors_are_distances():
    errors = position_errors(np.array([[3.0, 4.0], [1.0, 1.0]]), np.array([[0.0, 0.0], [np.nan, 1.0]]))
    assert errors[0] == 5.0
    assert np.isnan(errors[1])


@pytest.fixture
def path():
    return np.random.default_rng(0).normal(size=(30, 2)) * [20.0, 5.0]


def test_rigid_alignment_undoes_a_motion_but_no_scale(path):
    pose = np.array([3.0, -2.0, 1.1])
    moved = planar.transform(pose, path)
    found = alignment_pose(path, moved, "rigid", np.zeros(30, bool))
    np.testing.assert_allclose(planar.transform(found, path), moved, atol=1e-9)
    found = alignment_pose(path, 2 * moved, "rigid", np.zeros(30, bool))
    assert size_ratio(planar.transform(found, path), 2 * moved) == pytest.approx(0.5)


def test_start_alignment_shifts_and_never_turns(path):
    starts = np.arange(30) == 0
    found = alignment_pose(path, planar.transform([5.0, 6.0, 0.7], path), "start", starts)
    assert found[2] == 0.0
    np.testing.assert_allclose(planar.transform(found, path)[0], planar.transform([5.0, 6.0, 0.7], path)[0])


def test_start_alignment_takes_the_first_known_position_where_no_start_is_known(path):
    reference = path + 4.0
    reference[:3] = np.nan
    found = alignment_pose(path, reference, "start", np.arange(30) == 0)
    np.testing.assert_allclose(found, [4.0, 4.0, 0.0])


def test_no_alignment_is_the_identity(path):
    np.testing.assert_array_equal(alignment_pose(path, path + 1, "none", np.zeros(30, bool)), np.zeros(3))


def test_size_ratio_of_a_contracted_map(path):
    assert size_ratio(0.8 * path + 3.0, path) == pytest.approx(0.8)


def test_size_ratio_needs_a_spread():
    assert np.isnan(size_ratio(np.zeros((1, 2)), np.zeros((1, 2))))
    assert np.isnan(size_ratio(np.ones((4, 2)), np.zeros((4, 2))))


def test_segments_of_a_stretched_straight_walk():
    reference = np.column_stack([np.arange(0.0, 51.0), np.zeros(51)])
    errors = segment_errors(1.1 * reference, reference, 10.0)
    assert len(errors) == 41
    np.testing.assert_allclose(errors, 0.1)


def test_segments_see_no_constant_shift_and_need_length():
    reference = np.column_stack([np.arange(0.0, 51.0), np.zeros(51)])
    np.testing.assert_allclose(segment_errors(reference + 7.0, reference, 30.0), 0.0)
    assert len(segment_errors(reference, reference, 100.0)) == 0
    assert len(segment_errors(reference[:0], reference[:0], 10.0)) == 0
