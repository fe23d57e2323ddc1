import contextlib
import itertools
import math
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from radioslam import similarity, similarity_tiles
from radioslam.similarity import Pairs, pair_similarity, similar_pairs, stream_similar_pairs, unit_rows
from radioslam.similarity_tiles import Gate


@st.composite
def matrices(draw):
    """Small matrices with many zeros, empty rows and ties; dBm-like negative values too."""
    rows, columns = draw(st.integers(0, 12)), draw(st.integers(1, 6))
    sign = draw(st.sampled_from([1.0, -1.0]))
    cells = st.lists(st.sampled_from([0, 0, 0, 1, 2, 3.5]), min_size=columns, max_size=columns)
    return sign * np.array(draw(st.lists(cells, min_size=rows, max_size=rows)), dtype=float).reshape(rows, columns)


def cosine(a, b):
    """Equation (2) over dictionaries from transmitter to strength."""
    product = sum(a[name] * b[name] for name in a if name in b)
    return product / math.sqrt(sum(v * v for v in a.values())) / math.sqrt(sum(v * v for v in b.values()))


def double_loop(matrix, threshold):
    """Pairs at the threshold but for rounding are similar enough."""
    scans = [{k: v for k, v in enumerate(row) if v} for row in matrix.tolist()]
    pairs = {}
    for i, j in itertools.combinations(range(len(scans)), 2):
        if scans[i].keys() & scans[j].keys() and cosine(scans[i], scans[j]) >= threshold - 1e-13:
            pairs[i, j] = cosine(scans[i], scans[j])
    return pairs


def joined(matrix, *arguments, **keywords):
    pairs = similar_pairs(sparse.csr_array(matrix), *arguments, **keywords)
    return dict(zip(zip(pairs.i.tolist(), pairs.j.tolist(), strict=True), pairs.similarity.tolist(), strict=True))


def in_tiles_of(scans):
    """So few scans make a tile, and so few numbers a part of it, that small matrices have many of both."""
    stack = contextlib.ExitStack()
    stack.enter_context(mock.patch.object(similarity_tiles, "TILE", scans))
    stack.enter_context(mock.patch.object(similarity_tiles, "GROUP", 2))
    stack.enter_context(mock.patch.object(similarity_tiles, "FEW", 0))
    stack.enter_context(mock.patch.object(similarity, "BUFFER", 1))
    stack.enter_context(mock.patch.object(similarity, "FEWEST", 3))
    return stack


@settings(deadline=None)
@given(matrices(), st.sampled_from([0.0, 1e-9, 0.33, 0.6, 0.79, 0.8, 0.93, 1.0]), st.integers(1, 13))
def test_the_join_equals_the_plain_double_loop(matrix, threshold, tile):
    with in_tiles_of(tile):
        found = joined(matrix, threshold)
    expected = double_loop(matrix, threshold)
    assert found.keys() == expected.keys()
    assert found == pytest.approx(expected, abs=1e-12)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.3, 0.7, 0.9]), st.integers(1, 40), st.sampled_from([1.0, 1e-9]))
def test_scans_of_a_floor_are_joined_as_by_the_plain_double_loop(seed, threshold, tile, scale):
    """Neighbours along a line hear nearly the same; here tiles are narrow and most of them do not meet."""
    rng = np.random.default_rng(seed)
    place, transmitter = rng.uniform(0, 100, (60, 1)), rng.uniform(0, 100, (1, 40))
    strength = 40 - np.abs(place - transmitter) * 3 + rng.normal(0, 3, (60, 40))
    matrix = scale * np.where(strength > 0, strength.round(), 0.0)
    with in_tiles_of(tile):
        found = joined(matrix, threshold)
    assert found == pytest.approx(double_loop(matrix, threshold), abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(matrices(), st.integers(0, 10**6), st.sampled_from([0.0, 0.6, 0.8]), st.integers(1, 13))
def test_the_gate_lets_pairs_of_one_frame_pass_that_are_near(matrix, seed, threshold, tile):
    rng = np.random.default_rng(seed)
    positions, frame = rng.integers(0, 4, (len(matrix), 2)).astype(float), rng.integers(0, 2, len(matrix))
    with in_tiles_of(tile):
        gated = joined(matrix, threshold, Gate(positions, frame, 2.0))
    near = {
        (i, j): s
        for (i, j), s in joined(matrix, threshold).items()
        if frame[i] == frame[j] and math.dist(positions[i], positions[j]) <= 2.0
    }
    assert gated == near


def test_the_stream_holds_the_pairs_of_the_join():
    rng = np.random.default_rng(1)
    strengths = sparse.csr_array(rng.uniform(0, 1, (600, 30)) * (rng.random((600, 30)) < 0.3))
    parts = list(stream_similar_pairs(strengths, 0.6))
    whole = similar_pairs(strengths, 0.6)
    assert len(parts) > 1
    assert len(whole) == sum(map(len, parts)) > 0
    np.testing.assert_array_equal(Pairs.collect(parts).similarity, whole.similarity)


def test_equal_scans_have_one_similarity_wherever_they_stand():
    rng = np.random.default_rng(2)
    scan, others = rng.uniform(1, 50, 40), rng.uniform(1, 50, (500, 40))
    matrix = others.copy()
    matrix[::7] = scan
    pairs = similar_pairs(sparse.csr_array(matrix))
    for other in (1, 250, 499):
        ends = np.where(pairs.i == other, pairs.j, np.where(pairs.j == other, pairs.i, 1))
        assert len(set(pairs.similarity[ends % 7 == 0].tolist())) == 1


def test_a_pair_has_one_similarity_however_many_are_looked_at_with_it():
    strengths = sparse.csr_array(np.random.default_rng(3).uniform(1, 50, (300, 43)))
    pairs = similar_pairs(strengths)
    for k in range(0, len(pairs), 997):
        alone = pair_similarity(strengths, pairs.i[k : k + 1], pairs.j[k : k + 1])
        assert alone[0] == pairs.similarity[k]
    np.testing.assert_array_equal(pair_similarity(strengths, pairs.i, pairs.j), pairs.similarity)


@given(matrices())
def test_the_similarity_of_given_pairs_agrees_with_the_join(matrix):
    strengths = sparse.csr_array(matrix)
    pairs = similar_pairs(strengths)
    np.testing.assert_allclose(pair_similarity(strengths, pairs.i, pairs.j), pairs.similarity, atol=1e-12)


@settings(deadline=None)
@given(matrices(), st.randoms(use_true_random=False))
def test_the_order_of_the_scans_does_not_matter(matrix, random):
    order = list(range(len(matrix)))
    random.shuffle(order)
    shuffled = joined(matrix[order])
    back = {tuple(sorted((order[i], order[j]))): s for (i, j), s in shuffled.items()}
    assert back == pytest.approx(joined(matrix), abs=1e-12)


@given(matrices())
def test_no_pair_comes_twice_and_the_first_is_the_earlier(matrix):
    with in_tiles_of(3):
        pairs = similar_pairs(sparse.csr_array(matrix))
    assert np.all(pairs.i < pairs.j)
    assert len(set(zip(pairs.i.tolist(), pairs.j.tolist(), strict=True))) == len(pairs)


def test_a_pair_at_the_threshold_is_similar_enough():
    # 4/5 is the paper's threshold and, in this case, exact in floating point.
    assert joined([[4.0, 3.0], [1.0, 0.0]], 0.8) == {(0, 1): 0.8}
    assert joined([[4.0, 3.0], [1.0, 0.0]], 0.8 + 1e-12) == {}


def test_a_scan_is_wholly_similar_to_its_equal_and_never_more():
    rng = np.random.default_rng(0)
    matrix = np.repeat(rng.uniform(0.1, 60, size=(200, 7)), 2, axis=0)
    pairs = similar_pairs(sparse.csr_array(matrix), 0.999999)
    twins = pairs.select((pairs.j - pairs.i == 1) & (pairs.i % 2 == 0))
    assert len(twins) == 200
    assert np.all(pairs.similarity <= 1.0)
    np.testing.assert_allclose(twins.similarity, 1.0, atol=1e-12)


def test_similarity_does_not_depend_on_the_strength_of_a_whole_scan():
    assert joined([[1.0, 2.0], [10.0, 20.0]])[0, 1] == pytest.approx(1.0)


def test_a_transmitter_that_one_scan_misses_lowers_the_similarity():
    assert joined([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])[0, 1] == pytest.approx(1.0)
    assert joined([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])[0, 1] == pytest.approx(2 / math.sqrt(6))


def test_scans_without_common_transmitters_are_no_pair_even_at_threshold_zero():
    assert joined([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], 0.0) == {}


def test_an_empty_scan_is_similar_to_nothing():
    strengths = sparse.csr_array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    np.testing.assert_array_equal(pair_similarity(strengths, np.array([0, 0]), np.array([1, 2])), [0.0, 0.0])


def test_two_scans_that_heard_nothing_are_not_similar_also_where_nobody_heard_anything():
    silent = sparse.csr_array((3, 2))
    np.testing.assert_array_equal(pair_similarity(silent, np.array([0]), np.array([1])), [0.0])
    assert joined([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]], 0.0) == {}


def test_no_pairs_asked_for_are_no_pairs():
    assert len(pair_similarity(sparse.csr_array(np.eye(3)), np.zeros(0, np.int64), np.zeros(0, np.int64))) == 0


@given(matrices())
def test_rows_are_scaled_to_length_one_and_empty_ones_stay_empty(matrix):
    unit = unit_rows(sparse.csr_array(matrix)).toarray()
    np.testing.assert_allclose(np.linalg.norm(unit, axis=1), np.any(matrix != 0, axis=1), atol=1e-12)


def test_pairs_can_be_selected_by_mask_or_index():
    pairs = similar_pairs(sparse.csr_array(np.ones((3, 1))))
    assert pairs.select(pairs.j == 2).i.tolist() == [0, 1]
    assert pairs.select(np.array([2])).i.tolist() == [1]
