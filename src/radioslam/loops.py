"""Loop candidates (section III-F) and their screening (section III-G); every rejection has a reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import LoopConfig, ScreeningConfig
from radioslam.fingerprints import Fingerprints
from radioslam.merging import MergedTracks
from radioslam.similarity import Pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

KEPT = "kept"
NEAR_IN_TIME = "neighbours in time"
LESS_SIMILAR = "a more similar match nearby"
NOT_MUTUAL = "not the best match of both scans"


@dataclass(frozen=True)
class Loops:
    """Candidates with their verdicts.

    Attributes:
        pairs: the candidates as pairs of fingerprints i < j with their similarity.
        reason: (n_pairs,) text, ``kept`` or why not.
    """

    pairs: Pairs
    reason: NDArray[np.str_]

    @property
    def kept(self) -> Pairs:
        """The loops proper."""
        return self.pairs.select(self.reason == KEPT)


def find_candidates(
    similar: Pairs, merged: MergedTracks, fingerprints: Fingerprints, gate_m: float, config: LoopConfig
) -> Pairs:
    """Pairs of scans that may have been made at one place.

    Of all pairs that are ``similar`` enough (s ≥ ϑ_s): those of walks that share a frame, at most ``gate_m`` apart
    and near enough in orientation under the current estimate, ``merged.poses``.
    """
    poses = merged.poses[merged.node_of_fingerprint]
    offset = poses[similar.j] - poses[similar.i]
    frame = merged.frame[fingerprints.walk]
    return similar.select(
        (frame[similar.i] == frame[similar.j])
        & (np.hypot(offset[:, 0], offset[:, 1]) <= gate_m)
        & (np.abs(planar.wrap(offset[:, 2])) <= config.max_orientation_rad)
    )


def screen_candidates(candidates: Pairs, fingerprints: Fingerprints, config: ScreeningConfig) -> Loops:
    """Decide which candidates become loops.

    Always: scans of one walk fewer than M apart in number are no loop. Then by ``config.rule``:

    ``window`` (the paper's): of candidates <i, j>, <i, k> of a later scan i, with k within ϑ_w metres of j along that
    track, the more similar stays. ``mutual``: a pair stays if each scan is the other's best match in the other's walk.
    ``single``: in order of similarity, each scan takes part in one loop, and two walks are tied once per ϑ_w metres.
    """
    i, j = candidates.i, candidates.j
    same = fingerprints.walk[i] == fingerprints.walk[j]
    reason = np.full(len(candidates), KEPT, dtype="<U32")
    near = same & (fingerprints.scan[j] - fingerprints.scan[i] < config.min_index_gap)
    reason[near] = NEAR_IN_TIME
    left = np.flatnonzero(~near)
    keep, why = _apply_rule(candidates.select(left), fingerprints, config)
    reason[left[~keep]] = why
    return Loops(candidates, reason)


def _apply_rule(pairs: Pairs, fingerprints: Fingerprints, config: ScreeningConfig) -> tuple[NDArray[np.bool_], str]:
    """Mask of the pairs that the rule keeps, and why it drops the others."""
    if config.rule == "window":
        return _most_similar_in_window(pairs, fingerprints, config.window_m), LESS_SIMILAR
    if config.rule == "mutual":
        return first_in_claims(_rank(pairs.similarity), _scans_per_walk(pairs, fingerprints)), NOT_MUTUAL
    claims = np.column_stack([pairs.i, pairs.j, _stretches(pairs, fingerprints, config.window_m)])
    return take_greedily(pairs.similarity, claims), LESS_SIMILAR


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


def _stretches(pairs: Pairs, fingerprints: Fingerprints, length_m: float) -> Integers:
    """Claims (n, 2) of each pair: the stretch of each walk that is to be tied to the other walk.

    Numbers begin behind those of the scans.
    """
    walk, walks = fingerprints.walk, int(fingerprints.walk.max(initial=0)) + 1
    stretch = np.floor(fingerprints.distance_m / max(length_m, 1e-6)).astype(np.int64)
    count = int(stretch.max(initial=0)) + 1

    def number(one: Integers, other: Integers) -> Integers:
        return (walk[one] * walks + walk[other]) * count + stretch[other] + len(fingerprints)

    return np.column_stack([number(pairs.i, pairs.j), number(pairs.j, pairs.i)])


def _rank(priority: Array) -> Integers:
    """(n,) 0 for the lowest; among equals the first ranks highest, so that nothing depends on chance."""
    rank = np.empty(len(priority), np.int64)
    rank[np.lexsort((-np.arange(len(priority)), priority))] = np.arange(len(priority))
    return rank


def first_in_claims(rank: Integers, claims: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items that rank (n,) highest among all that share any of their claims (n, k)."""
    return _first(rank, *_compact(claims))


def _compact(claims: Integers) -> tuple[Integers, int]:
    """Claims numbered densely enough to index arrays with, and how many numbers there are."""
    count = int(claims.max(initial=-1)) + 1
    if count <= 4 * claims.size + 1000:
        return claims, count
    values, flat = np.unique(claims, return_inverse=True)
    return flat.reshape(claims.shape).astype(np.int64), len(values)


def _first(rank: Integers, claims: Integers, count: int) -> NDArray[np.bool_]:
    order = np.arange(len(rank)) if np.all(np.diff(rank) > 0) else np.argsort(rank)
    top = np.full(count, -1)
    for column in claims.T:
        # Of equal places the last written stays: the highest rank.
        highest = np.full(count, -1)
        highest[column[order]] = rank[order]
        top = np.maximum(top, highest)
    return np.all(top[claims] == rank[:, None], axis=1)


def take_greedily(priority: Array, claims: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items taken in order of priority (n,), each only if all its claims (n, k) are still free.

    In rounds: whoever comes first in all of its claims is taken, and all who share a claim with it are out. That
    is what a loop over the sorted items gives, in about log n rounds.
    """
    claims, count = _compact(claims)
    order = np.argsort(_rank(priority))  # from here on the last is the first to choose
    claims, waiting, busy = claims[order], np.arange(len(order)), np.zeros(count, bool)
    taken = np.zeros(len(order), bool)
    while len(waiting):
        won = waiting[_first(waiting, claims[waiting], count)]
        taken[order[won]] = True
        busy[claims[won]] = True
        waiting = waiting[~busy[claims[waiting]].any(axis=1)]
    return taken
