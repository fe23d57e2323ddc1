"""Loop candidates (section III-F) and their screening (section III-G); every rejection has a reason."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam import planar
from radioslam.claims import first_in_claims, take_greedily
from radioslam.config import LoopConfig, ScreeningConfig
from radioslam.fingerprints import Fingerprints
from radioslam.merging import MergedTracks
from radioslam.similarity import Gate, Pairs, stream_similar_pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

REASONS = (
    "kept",
    "neighbours in time",
    "a more similar match nearby",
    "not the best match of both scans",
    "too few loops with this walk",
    "neighbours in time contradict it",
)
KEPT, NEAR_IN_TIME, LESS_SIMILAR, NOT_MUTUAL, ALONE, CONTRADICTED = range(len(REASONS))


@dataclass(frozen=True)
class Loops:
    """Candidates with their verdicts.

    Attributes:
        pairs: the candidates as pairs of fingerprints i < j with their similarity.
        reason: (n_pairs,) number in ``REASONS``, ``KEPT`` or why not.
    """

    pairs: Pairs
    reason: NDArray[np.uint8]

    @property
    def kept(self) -> Pairs:
        """The loops proper."""
        return self.pairs.select(self.reason == KEPT)


def find_candidates(
    strengths: sparse.csr_array,
    merged: MergedTracks,
    fingerprints: Fingerprints,
    gate_m: float,
    config: LoopConfig,
    join: Callable[[sparse.csr_array, float, Gate], Iterator[Pairs]] = stream_similar_pairs,
) -> Pairs:
    """Pairs of scans that may have been made at one place.

    Of all pairs whose ``strengths`` (n, m) are similar enough (s ≥ ϑ_s): those of walks that share a frame, at most
    ``gate_m`` apart and near enough in orientation under the current estimate, ``merged.poses``.
    """
    poses = merged.poses[merged.node_of_fingerprint]
    gate = Gate(poses[:, :2], merged.frame[fingerprints.walk], gate_m)

    def facing_alike(pairs: Pairs) -> Pairs:
        turn = planar.wrap(poses[pairs.j, 2] - poses[pairs.i, 2])
        return pairs.select(np.abs(turn) <= config.max_orientation_rad)

    return Pairs.collect(map(facing_alike, join(strengths, config.similarity_threshold, gate)))


def screen_candidates(
    candidates: Pairs, fingerprints: Fingerprints, positions_xy: Array, config: ScreeningConfig
) -> Loops:
    """Decide which candidates become loops.

    Always: scans of one walk fewer than M apart in number are no loop. Then by ``config.rule``:

    ``window`` (the paper's): of candidates <i, j>, <i, k> of a later scan i, with k within ϑ_w metres of j along that
    track, the more similar stays. ``mutual``: a pair stays if each scan is the other's best match in the other's walk.
    ``single``: in order of similarity, each scan takes part in one loop, and two walks are tied once per ϑ_w metres.
    Of what is left, loops go that their neighbours contradict (``contradicted``), and at last those of walks with fewer
    than ``min_loops_per_walk``: a few of them may all be wrong.

    Args:
        candidates: pairs of fingerprints.
        fingerprints: the scans.
        positions_xy: (n, 2) of the fingerprints under the current estimate.
        config: rule and limits.
    """
    i, j = candidates.i, candidates.j
    same = fingerprints.walk[i] == fingerprints.walk[j]
    reason = np.full(len(candidates), KEPT, dtype=np.uint8)
    near = same & (fingerprints.scan[j] - fingerprints.scan[i] < config.min_index_gap)
    reason[near] = NEAR_IN_TIME
    left = np.flatnonzero(~near)
    keep, why = _apply_rule(candidates.select(left), fingerprints, config)
    reason[left[~keep]] = why
    left = left[keep]
    wrong = contradicted(candidates.select(left), fingerprints, positions_xy, config)
    reason[left[wrong]] = CONTRADICTED
    left = left[~wrong]
    reason[left[_alone(fingerprints.walk[i[left]], fingerprints.walk[j[left]], config.min_loops_per_walk)]] = ALONE
    return Loops(candidates, reason)


def contradicted(
    loops: Pairs, fingerprints: Fingerprints, positions_xy: Array, config: ScreeningConfig
) -> NDArray[np.bool_]:
    """Mask (n,) of the loops whose neighbours in time agree with each other and not with it.

    Along a stretch that two walks share, odometry is good, so the loops before and after one, between the same two
    walks and within ``neighbour_m`` along both, bridge the same gap: the offset t_j - t_i of the estimate (temporal
    consistency, Gálvez-López and Tardós 2012). A loop is dropped where both neighbours' offsets lie within
    ``consistency_m`` of each other and its own lies farther from either.
    """
    walks = int(fingerprints.walk.max(initial=0)) + 1
    pair = fingerprints.walk[loops.i] * walks + fingerprints.walk[loops.j]
    along_i, along_j = fingerprints.distance_m[loops.i], fingerprints.distance_m[loops.j]
    order = np.lexsort((along_i, pair))
    wrong = np.zeros(len(loops), bool)
    if not config.consistency_m or len(loops) < 3:
        return wrong
    offset = (positions_xy[loops.j] - positions_xy[loops.i])[order]
    step_i, step_j = np.diff(along_i[order]), np.abs(np.diff(along_j[order]))
    near = (np.diff(pair[order]) == 0) & (step_i <= config.neighbour_m) & (step_j <= config.neighbour_m)
    apart = np.hypot(*(offset[1:] - offset[:-1]).T) > config.consistency_m
    outer = np.hypot(*(offset[2:] - offset[:-2]).T) <= config.consistency_m
    wrong[order[1:-1]] = near[:-1] & near[1:] & apart[:-1] & apart[1:] & outer
    return wrong


def _alone(walk_i: Integers, walk_j: Integers, least: int) -> NDArray[np.bool_]:
    """Mask (n,) of the loops with a walk that has fewer than ``least``, once all such are gone."""
    alone, own = np.zeros(len(walk_i), bool), walk_i == walk_j
    while True:
        left = ~alone
        ends = np.concatenate([walk_i[left], walk_j[left & ~own]])
        count = np.bincount(ends, minlength=int(max(walk_i.max(initial=0), walk_j.max(initial=0))) + 1)
        more = left & (np.minimum(count[walk_i], count[walk_j]) < least)
        if not more.any():
            return alone
        alone |= more


def _apply_rule(pairs: Pairs, fingerprints: Fingerprints, config: ScreeningConfig) -> tuple[NDArray[np.bool_], int]:
    """Mask of the pairs that the rule keeps, and why it drops the others."""
    if config.rule == "window":
        return _most_similar_in_window(pairs, fingerprints, config.window_m), LESS_SIMILAR
    if config.rule == "mutual":
        return first_in_claims(pairs.similarity, _scans_per_walk(pairs, fingerprints)), NOT_MUTUAL
    return take_greedily(pairs.similarity, *_single_claims(pairs, fingerprints, config.window_m)), LESS_SIMILAR


def _most_similar_in_window(pairs: Pairs, fingerprints: Fingerprints, window_m: float) -> NDArray[np.bool_]:
    """Mask of the pairs <i, j> that no <k, j> with k near i along its track surpasses; j is the later scan."""
    keep = np.ones(len(pairs), bool)
    along, track = fingerprints.distance_m[pairs.i], fingerprints.walk[pairs.i]
    order = np.lexsort((along, track, pairs.j))
    for shift in range(1, len(order)):
        a, b = order[:-shift], order[shift:]
        near = (pairs.j[a] == pairs.j[b]) & (track[a] == track[b]) & (along[b] - along[a] <= window_m)
        if not near.any():
            break
        better = pairs.similarity[a] >= pairs.similarity[b]
        keep[b[near & better]] = False
        keep[a[near & ~better]] = False
    return keep


def _scans_per_walk(pairs: Pairs, fingerprints: Fingerprints) -> Integers:
    """Claims (n, 2) of each pair: scan i for the walk of j, and scan j for the walk of i."""
    walk, walks = fingerprints.walk, int(fingerprints.walk.max(initial=0)) + 1
    return np.column_stack([pairs.i * walks + walk[pairs.j], pairs.j * walks + walk[pairs.i]])


def _single_claims(
    pairs: Pairs, fingerprints: Fingerprints, length_m: float
) -> tuple[Callable[[Integers], Integers], int]:
    """Claims (m, 4) of pairs by their numbers (m,), and how many claims there are.

    A pair claims its two scans, and of each walk the stretch that is to be tied to the other walk.
    """
    walk, walks, n = fingerprints.walk, int(fingerprints.walk.max(initial=0)) + 1, len(fingerprints)
    stretch = np.floor(fingerprints.distance_m / max(length_m, 1e-6)).astype(np.int64)
    count = int(stretch.max(initial=0)) + 1
    met = np.zeros((walks, walks), bool)
    met[walk[pairs.i], walk[pairs.j]] = True
    met |= met.T
    number = n + count * (np.cumsum(met) - 1).reshape(walks, walks)

    def claims_of(items: Integers) -> Integers:
        i, j = pairs.i[items], pairs.j[items]
        a, b = walk[i], walk[j]
        return np.column_stack([i, j, number[a, b] + stretch[j], number[b, a] + stretch[i]])

    return claims_of, n + count * int(met.sum())
