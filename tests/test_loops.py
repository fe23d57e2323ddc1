import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from radioslam.config import LoopConfig, ScreeningConfig
from radioslam.loops import (
    ALONE,
    KEPT,
    LESS_SIMILAR,
    NEAR_IN_TIME,
    NOT_MUTUAL,
    contradicted,
    find_candidates,
    screen_candidates,
)
from radioslam.similarity import Pairs

from .builders import fingerprints_at, merged_at

RULES = ("window", "mutual", "single")


def pairs_of(*rows):
    i, j, similarity = np.array(rows, dtype=float).reshape(-1, 3).T
    return Pairs(i.astype(int), j.astype(int), similarity)


def as_tuples(pairs):
    return list(zip(pairs.i.tolist(), pairs.j.tolist(), strict=True))


def screened(pairs, fingerprints, config):
    """Screening under an estimate that is the odometry's."""
    return screen_candidates(pairs, fingerprints, fingerprints.poses[:, :2], config)


# Candidates


def candidates(poses, walk=(0, 1), frame=(0, 0), gate_m=10.0, **config):
    fingerprints = fingerprints_at(np.zeros(len(poses)), walk)
    equal = sparse.csr_array(np.ones((len(poses), 1)))
    return as_tuples(find_candidates(equal, merged_at(poses, walk, frame), fingerprints, gate_m, LoopConfig(**config)))


@pytest.mark.parametrize(("distance_m", "near"), [(9.9, True), (10.0, True), (10.1, False)])
def test_candidates_are_at_most_the_gate_apart(distance_m, near):
    along = distance_m * np.array([0.6, 0.8])
    assert bool(candidates([[0, 0, 0], [*along, 0]], gate_m=10.0)) == near


def test_distances_are_those_of_the_estimate_not_of_the_odometry():
    # The fingerprints' own odometry poses stand all at one place.
    assert candidates([[0, 0, 0], [50, 0, 0]]) == []


@pytest.mark.parametrize(("one", "other", "near"), [(0, 44, True), (0, 46, False), (179, -179, True), (-90, 90, False)])
def test_candidates_face_nearly_the_same_way(one, other, near):
    poses = [[0, 0, np.radians(one)], [0, 0, np.radians(other)]]
    assert bool(candidates(poses, max_orientation_rad=np.radians(45))) == near


@pytest.mark.parametrize("turn", [np.pi, -np.pi, 2.0, 7.0])
def test_the_default_lets_every_direction_pass(turn):
    assert candidates([[0, 0, 0], [0, 0, turn]]) == [(0, 1)]


def test_walks_of_different_frames_have_no_relative_distance():
    poses = np.zeros((3, 3))
    assert candidates(poses, walk=(0, 1, 2), frame=(0, 5, 0)) == [(0, 2)]


def test_loops_are_sought_within_a_walk_too():
    assert candidates(np.zeros((2, 3)), walk=(0, 0), frame=(0,)) == [(0, 1)]


def test_candidates_are_at_least_so_similar_and_keep_their_similarity():
    strengths = sparse.csr_array([[1.0, 0, 0], [1, 0, 0], [0.8, 0.6, 0], [0.7, 0, 0.714]])
    found = find_candidates(
        strengths,
        merged_at([[0, 0, 0], [99, 0, 0], [1, 0, 0], [2, 0, 0]], (0, 1, 1, 1), (0, 0)),
        fingerprints_at(np.zeros(4), (0, 1, 1, 1)),
        10.0,
        LoopConfig(similarity_threshold=0.8),
    )
    assert as_tuples(found) == [(0, 2)]
    assert found.similarity.tolist() == [0.8]


# Screening: what all rules share


@st.composite
def crowds(draw):
    """Fingerprints of up to 4 walks and candidates among them, with ties in similarity and distance."""
    counts = draw(st.lists(st.integers(1, 8), min_size=1, max_size=4))
    walk = np.repeat(np.arange(len(counts)), counts)
    steps = draw(st.lists(st.integers(0, 3), min_size=len(walk), max_size=len(walk)))
    distance = np.concatenate([np.cumsum(part) for part in np.split(np.array(steps), np.cumsum(counts)[:-1])])
    every = list(itertools.combinations(range(len(walk)), 2))
    chosen = draw(st.lists(st.sampled_from(every), unique=True, max_size=30)) if every else []
    similarity = draw(st.lists(st.integers(1, 5), min_size=len(chosen), max_size=len(chosen)))
    pairs = pairs_of(*((i, j, s / 5) for (i, j), s in zip(chosen, similarity, strict=True)))
    return fingerprints_at(distance.astype(float), walk), pairs


@settings(deadline=None)
@given(crowds(), st.sampled_from(RULES), st.integers(1, 5), st.sampled_from([0.0, 2.0, 5.0]))
def test_every_candidate_has_a_verdict_and_no_loop_joins_neighbours_in_time(crowd, rule, gap, window_m):
    fingerprints, pairs = crowd
    loops = screened(pairs, fingerprints, ScreeningConfig(rule=rule, min_index_gap=gap, window_m=window_m))
    assert loops.pairs is pairs
    assert len(loops.reason) == len(pairs)
    assert set(loops.reason.tolist()) <= {KEPT, NEAR_IN_TIME, LESS_SIMILAR, NOT_MUTUAL}
    near = (fingerprints.walk[pairs.i] == fingerprints.walk[pairs.j]) & (pairs.j - pairs.i < gap)
    np.testing.assert_array_equal(loops.reason == NEAR_IN_TIME, near)
    assert len(loops.kept) == np.count_nonzero(loops.reason == KEPT)


@settings(deadline=None)
@given(crowds(), st.sampled_from(RULES))
def test_of_the_candidates_far_enough_in_time_the_most_similar_is_kept(crowd, rule):
    fingerprints, pairs = crowd
    loops = screened(pairs, fingerprints, ScreeningConfig(rule=rule, min_index_gap=2))
    left = loops.reason != NEAR_IN_TIME
    assert loops.kept.similarity.max(initial=0.0) == pairs.similarity[left].max(initial=0.0)


def test_no_candidates_give_no_loops():
    for rule in RULES:
        assert len(screened(pairs_of(), fingerprints_at([0.0]), ScreeningConfig(rule=rule)).kept) == 0


def test_scans_of_two_walks_are_no_neighbours_in_time():
    fingerprints = fingerprints_at([0.0, 1.0], walk=[0, 1])
    loops = screened(pairs_of((0, 1, 0.9)), fingerprints, ScreeningConfig(min_index_gap=20))
    assert loops.reason.tolist() == [KEPT]


@pytest.mark.parametrize(("gap", "reason"), [(3, KEPT), (4, NEAR_IN_TIME)])
def test_scans_of_one_walk_must_be_so_many_apart(gap, reason):
    fingerprints = fingerprints_at(np.arange(4.0))
    loops = screened(pairs_of((0, 3, 0.9)), fingerprints, ScreeningConfig(min_index_gap=gap))
    assert loops.reason.tolist() == [reason]


# Screening: window


def kept_by_window(fingerprints, pairs, window_m):
    """The paper's rule as a plain loop over the later scan; of equals the one earlier along the track stays."""
    kept = set(range(len(pairs)))
    for a, b in itertools.permutations(range(len(pairs)), 2):
        i, k = pairs.i[a], pairs.i[b]
        near = abs(fingerprints.distance_m[i] - fingerprints.distance_m[k]) <= window_m
        if pairs.j[a] == pairs.j[b] and fingerprints.walk[i] == fingerprints.walk[k] and near:
            rank = [(-pairs.similarity[p], fingerprints.distance_m[pairs.i[p]], p) for p in (a, b)]
            kept.discard(a if rank[0] > rank[1] else b)
    return sorted(kept)


@settings(deadline=None)
@given(crowds(), st.sampled_from([0.0, 1.0, 2.0, 5.0]))
def test_the_window_rule_equals_the_plain_loops(crowd, window_m):
    fingerprints, pairs = crowd
    config = ScreeningConfig(rule="window", min_index_gap=1, window_m=window_m)
    reason = screened(pairs, fingerprints, config).reason
    assert np.flatnonzero(reason == KEPT).tolist() == kept_by_window(fingerprints, pairs, window_m)


def test_of_two_partners_near_each_other_the_more_similar_stays():
    fingerprints = fingerprints_at([0, 4, 20, 0], walk=[0, 0, 0, 1])
    pairs = pairs_of((0, 3, 0.8), (1, 3, 0.9), (2, 3, 0.85))
    loops = screened(pairs, fingerprints, ScreeningConfig(rule="window", window_m=5.0))
    assert loops.reason.tolist() == [LESS_SIMILAR, KEPT, KEPT]


# Screening: mutual


def kept_by_mutual(fingerprints, pairs):
    """Best match of each scan in each walk, the first of equals, looked up both ways."""
    walk, best = fingerprints.walk.tolist(), {}
    for p, (i, j) in enumerate(as_tuples(pairs)):
        for one, other in ((i, j), (j, i)):
            key = one, walk[other]
            if key not in best or pairs.similarity[p] > pairs.similarity[best[key]]:
                best[key] = p
    return [p for p, (i, j) in enumerate(as_tuples(pairs)) if best[i, walk[j]] == p == best[j, walk[i]]]


@settings(deadline=None)
@given(crowds())
def test_the_mutual_rule_equals_the_look_up_of_best_matches(crowd):
    fingerprints, pairs = crowd
    reason = screened(pairs, fingerprints, ScreeningConfig(rule="mutual", min_index_gap=1)).reason
    assert np.flatnonzero(reason == KEPT).tolist() == kept_by_mutual(fingerprints, pairs)


def test_a_match_that_prefers_another_is_not_mutual():
    fingerprints = fingerprints_at([0, 50, 0], walk=[0, 0, 1])
    loops = screened(pairs_of((0, 2, 0.8), (1, 2, 0.9)), fingerprints, ScreeningConfig(rule="mutual"))
    assert loops.reason.tolist() == [NOT_MUTUAL, KEPT]


def test_a_scan_may_match_one_scan_in_each_of_several_walks():
    fingerprints = fingerprints_at([0, 0, 0], walk=[0, 1, 2])
    loops = screened(pairs_of((0, 1, 0.8), (0, 2, 0.9)), fingerprints, ScreeningConfig(rule="mutual"))
    assert loops.reason.tolist() == [KEPT, KEPT]


# Screening: single


def kept_by_single(fingerprints, pairs, window_m):
    """In order of similarity: both scans free, and both stretches not yet tied to the other walk."""
    walk, used, kept = fingerprints.walk.tolist(), set(), []
    stretch = np.floor(fingerprints.distance_m / window_m).tolist()
    for p in sorted(range(len(pairs)), key=lambda p: (-pairs.similarity[p], p)):
        i, j = as_tuples(pairs)[p]
        claims = {i, j, (walk[i], stretch[i], walk[j]), (walk[j], stretch[j], walk[i])}
        if not claims & used:
            used |= claims
            kept.append(p)
    return sorted(kept)


@settings(deadline=None)
@given(crowds(), st.sampled_from([1.0, 2.0, 5.0]))
def test_the_single_rule_equals_the_loop_over_the_sorted_candidates(crowd, window_m):
    fingerprints, pairs = crowd
    config = ScreeningConfig(rule="single", min_index_gap=1, window_m=window_m)
    reason = screened(pairs, fingerprints, config).reason
    assert np.flatnonzero(reason == KEPT).tolist() == kept_by_single(fingerprints, pairs, window_m)


@settings(deadline=None)
@given(crowds())
def test_the_single_rule_uses_each_scan_once(crowd):
    fingerprints, pairs = crowd
    kept = screened(pairs, fingerprints, ScreeningConfig(rule="single", min_index_gap=1)).kept
    assert len(set(kept.i.tolist()) | set(kept.j.tolist())) == 2 * len(kept)


# Screening: neighbours in time


def side_by_side(*offsets_m):
    """Two walks of a scan every 5 m, loops between scans of one number, and the offset of each under the estimate."""
    n = len(offsets_m)
    fingerprints = fingerprints_at(np.tile(5.0 * np.arange(n), 2), walk=np.repeat([0, 1], n))
    positions = np.column_stack([fingerprints.distance_m, np.concatenate([np.zeros(n), offsets_m])])
    pairs = pairs_of(*((k, n + k, 0.9) for k in range(n)))
    return contradicted(pairs, fingerprints, positions, ScreeningConfig(consistency_m=6.0, neighbour_m=15.0))


def test_a_loop_that_both_neighbours_contradict_is_found():
    assert side_by_side(1, 2, 12, 3, 2).tolist() == [False, False, True, False, False]


def test_neighbours_that_disagree_themselves_contradict_nobody():
    assert not side_by_side(0, 10, 20, 30).any()
    assert not side_by_side(1, 2, 3, 2).any()


def test_loops_far_along_or_between_other_walks_are_no_neighbours():
    fingerprints = fingerprints_at(np.tile([0.0, 20.0, 40.0], 2), walk=np.repeat([0, 1], 3))
    positions = np.column_stack([fingerprints.distance_m, [0, 0, 0, 1, 12, 1]])
    pairs = pairs_of((0, 3, 0.9), (1, 4, 0.9), (2, 5, 0.9))
    config = ScreeningConfig(consistency_m=6.0, neighbour_m=15.0)
    assert not contradicted(pairs, fingerprints, positions, config).any()
    assert contradicted(pairs, fingerprints, positions, ScreeningConfig(consistency_m=6.0, neighbour_m=25.0)).any()


def test_nothing_is_contradicted_unless_asked_for():
    fingerprints = fingerprints_at(np.zeros(4), walk=np.repeat([0, 1], 2))
    config = ScreeningConfig()
    assert config.consistency_m == 0.0
    assert not contradicted(pairs_of((0, 2, 0.9), (1, 3, 0.9)), fingerprints, np.zeros((4, 2)), config).any()


# Screening: walks with few loops


def test_walks_with_few_loops_lose_them_and_so_may_their_partners():
    # Walks 0 and 1 share three loops; walk 2 has two with walk 0 and one with walk 3.
    fingerprints = fingerprints_at(np.arange(20.0) * 10, walk=np.repeat([0, 1, 2, 3], 5))
    pairs = pairs_of((0, 5, 0.9), (1, 6, 0.9), (2, 7, 0.9), (3, 10, 0.9), (4, 11, 0.9), (12, 15, 0.9))
    config = ScreeningConfig(rule="single", min_index_gap=1, min_loops_per_walk=3)
    reason = screened(pairs, fingerprints, config).reason
    assert reason.tolist() == [KEPT, KEPT, KEPT, ALONE, ALONE, ALONE]


def test_loops_of_a_walk_with_itself_count_once():
    fingerprints = fingerprints_at(np.arange(6.0) * 10)
    pairs = pairs_of((0, 3, 0.9), (1, 4, 0.9))
    for least, verdict in ((2, KEPT), (3, ALONE)):
        config = ScreeningConfig(rule="single", min_index_gap=1, min_loops_per_walk=least)
        assert set(screened(pairs, fingerprints, config).reason.tolist()) == {verdict}
