"""Where in a map a walk was whose start nobody knows: its scans vote.

Each scan k of the walk, at q_k by odometry, is like some places p of the map, and each of those says where the walk's
frame lies: o = p - R(θ) q_k. Votes of all scans are counted on a grid of o for some turns θ of the compass; every scan
has one vote in all. Where most agree the walk was, if most do and nowhere else nearly as many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from radioslam.config import Config
from radioslam.places import Samples, similar_to
from radioslam.planar import rotate
from radioslam.similarity import Pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

TURNS = np.linspace(-2.0, 2.0, 13)
"""Turns that are tried, in standard deviations of a compass."""
BIN_M = 2.0
BLUR_M = 4.0
"""How far votes for one place lie apart: similarity and drift."""
MATCHES = 8
"""Places that share the vote of a scan: those most like it."""
AGREE_M = 12.0
"""A scan agrees if one of its places is so near to where the walk's best place puts it."""
LEAST_SHARE = 0.5
"""Of scans that must agree."""
AMBIGUOUS = 0.8
"""A second place, beyond ``AGREE_M``, must have fewer votes than this part of the first's."""
CORRELATED_SCANS = 10.0
"""So many scans of a walk err together."""
FEWEST_SCANS = 3
"""That must agree."""
MAX_SIGMA_M = 8.0
"""Where the scans do not tell the place better, they do not tell it."""


@dataclass(frozen=True)
class FoundPlace:
    """Where a walk was at ``time_s``: ``position_xy`` (2,) in the map's frame, known to ``sigma_m`` per axis.

    ``turn_rad`` is that of its compass against the map. Or no position, with the ``reason`` why nobody can tell.
    """

    time_s: float = np.nan
    position_xy: Array | None = None
    sigma_m: float = np.nan
    turn_rad: float = 0.0
    reason: str = ""


def seek(own: Samples, time_s: Array, places: Samples, config: Config) -> FoundPlace:
    """Find a walk in a map by its scans, ``own`` (n,) with poses in the walk's own frame, made at ``time_s`` (n,)."""
    heard = int(np.sum(np.diff(own.strengths.indptr) > 0))
    pairs = _best_matches(similar_to(places, own.strengths, config.loops.similarity_threshold))
    if len(np.unique(pairs.j)) < LEAST_SHARE * heard or not heard:
        return FoundPlace(reason=f"{len(np.unique(pairs.j))} of {heard} scans are like any of the map")
    place_xy, path_xy = places.poses[pairs.i, :2], own.poses[pairs.j, :2]
    weight = pairs.similarity / np.bincount(pairs.j, pairs.similarity)[pairs.j]
    sigma_rad = config.placement.turn_sigma_rad
    polls = [_poll(place_xy - rotate(np.full(len(path_xy), t * sigma_rad), path_xy), weight) for t in TURNS]
    best = int(np.argmax([poll[1] * np.exp(-(t**2) / 8) for poll, t in zip(polls, TURNS, strict=True)]))
    turn_rad, (offset, votes, second) = TURNS[best] * sigma_rad, polls[best]
    off = place_xy - rotate(np.full(len(path_xy), turn_rad), path_xy) - offset
    agreeing = np.unique(pairs.j[np.hypot(*off.T) <= AGREE_M])
    if len(agreeing) < max(LEAST_SHARE * heard, FEWEST_SCANS):
        return FoundPlace(reason=f"{len(agreeing)} of {heard} scans agree on one place")
    if second > AMBIGUOUS * votes:
        return FoundPlace(reason=f"two places are alike: {votes:.0f} and {second:.0f} of {heard} votes")
    common_m = float(np.sqrt(np.mean(places.sigma_m[pairs.i] ** 2)))
    return _refined(off, pairs, offset, turn_rad, own, time_s, agreeing, common_m)


def _best_matches(pairs: Pairs) -> Pairs:
    """The ``MATCHES`` most similar places of each scan."""
    order = np.lexsort((-pairs.similarity, pairs.j))
    first = np.flatnonzero(np.append(True, np.diff(pairs.j[order]) != 0)) if len(order) else order
    rank = np.arange(len(order)) - np.repeat(first, np.diff(np.append(first, len(order))))
    return pairs.select(order[rank < MATCHES])


def _poll(offsets: Array, weight: Array) -> tuple[Array, float, float]:
    """The offset (2,) with most votes, its votes, and those of the best one far from it."""
    low = offsets.min(axis=0) - 3 * BLUR_M
    cell = ((offsets - low) / BIN_M).astype(np.int64)
    shape = cell.max(axis=0) + 1 + int(3 * BLUR_M / BIN_M)
    votes = np.zeros(shape)
    np.add.at(votes, tuple(cell.T), weight)
    votes = gaussian_filter(votes, BLUR_M / BIN_M, mode="constant") * 2 * np.pi * (BLUR_M / BIN_M) ** 2
    top = np.array(np.unravel_index(int(votes.argmax()), votes.shape))
    away = np.hypot(*(np.indices(votes.shape) - top[:, None, None])) * BIN_M > AGREE_M
    return low + (top + 0.5) * BIN_M, float(votes.max()), float(votes[away].max(initial=0.0))


def _refined(
    off: Array,
    pairs: Pairs,
    offset: Array,
    turn_rad: float,
    own: Samples,
    time_s: Array,
    agreeing: Integers,
    common_m: float,
) -> FoundPlace:
    """The weighted middle of the votes near the winner, told at the scan nearest to the middle of those that agree."""
    shift = np.zeros(2)
    for _ in range(10):
        square = np.sum((off - shift) ** 2, axis=1)
        weight = pairs.similarity / (1 + square / BLUR_M**2) ** 2
        shift = weight @ off / weight.sum()
    spread = float(np.sqrt(weight @ square / weight.sum() / 2))
    middle = own.poses[agreeing, :2].mean(axis=0)
    k = int(np.hypot(*(own.poses[agreeing, :2] - middle).T).argmin())
    at = agreeing[k]
    position = rotate(turn_rad, own.poses[at, :2]) + offset + shift
    sigma_m = float(np.hypot(spread / np.sqrt(max(len(agreeing) / CORRELATED_SCANS, 1)), common_m))
    if sigma_m > MAX_SIGMA_M:
        return FoundPlace(reason=f"its scans tell its place to {sigma_m:.0f} m, {MAX_SIGMA_M:.0f} m are needed")
    return FoundPlace(float(time_s[at]), position, sigma_m, turn_rad)
