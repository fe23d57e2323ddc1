"""Who gets what several claim: items in order of priority, each taken only if all that it claims is still free.

Vectorised forms of two loops over the sorted items; claims are numbers, k per item.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CHUNK = 1 << 16


def first_in_claims(priority: Array, claims: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items first by priority (n,) among all that share any of their claims (n, k)."""
    claims, count = _compact(claims)
    order = _by_priority(priority)
    first = np.zeros(len(order), bool)
    first[order] = _first(claims[order], count)
    return first


def take_greedily(priority: Array, claims: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items taken in order of priority (n,), each only if all its claims (n, k) are still free.

    In chunks of that order, and in rounds within a chunk: whoever comes first in all of its claims is taken, and all
    who share a claim with it are out. That is what a loop over the sorted items gives; most of the items meet only
    claims that an earlier chunk has taken, and cost one look.
    """
    claims, count = _compact(claims)
    order, busy, taken = _by_priority(priority), np.zeros(count, bool), np.zeros(len(priority), bool)
    for begin in range(0, len(order), CHUNK):
        waiting = order[begin : begin + CHUNK]
        waiting = waiting[~busy[claims[waiting]].any(axis=1)]
        while len(waiting):
            won = waiting[_first(claims[waiting], count)]
            taken[won], busy[claims[won]] = True, True
            waiting = waiting[~busy[claims[waiting]].any(axis=1)]
    return taken


def _by_priority(priority: Array) -> Integers:
    """Indices (n,), the highest priority first and equal ones as they stand, so that nothing depends on chance."""
    return np.argsort(-priority, kind="stable")


def _compact(claims: Integers) -> tuple[Integers, int]:
    """Claims numbered densely enough to index arrays with, and how many numbers there are."""
    count = int(claims.max(initial=-1)) + 1
    if count <= 4 * claims.size + 1000:
        return claims, count
    values, flat = np.unique(claims, return_inverse=True)
    return flat.reshape(claims.shape).astype(np.int64), len(values)


def _first(claims: Integers, count: int) -> NDArray[np.bool_]:
    """Mask (n,) of the items that no earlier one shares a claim (n, k) with; there are ``count`` claims."""
    place = np.arange(len(claims))
    first = np.full(count, len(claims))
    for column in claims.T:
        earliest = np.full(count, len(claims))
        earliest[column[::-1]] = place[::-1]  # of equal claims the last written stays: the earliest
        np.minimum(first, earliest, out=first)
    return np.all(first[claims] == place[:, None], axis=1)
