"""Who gets what several claim: items in order of priority, each taken only if all that it claims is still free.

Vectorised forms of two loops over the sorted items; claims are numbers, k per item.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CHUNK = 1 << 16


def first_in_claims(priority: Array, claims: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items first by priority (n,) among all that share any of their claims (n, k)."""
    numbers, flat = np.unique(claims, return_inverse=True)
    order = _by_priority(priority)
    first = np.zeros(len(order), bool)
    first[order] = _first(flat.reshape(claims.shape)[order], np.empty(len(numbers), np.int64))
    return first


def take_greedily(priority: Array, claims_of: Callable[[Integers], Integers], count: int) -> NDArray[np.bool_]:
    """Mask (n,) of the items taken in order of priority (n,), each only if all its claims are still free.

    In chunks of that order, and in rounds within a chunk: whoever comes first in all of its claims is taken, and all
    who share a claim with it are out. That is what a loop over the sorted items gives; most of the items meet only
    claims that an earlier chunk has taken, and cost one look.

    Args:
        priority: (n,).
        claims_of: items (m,) -> their claims (m, k), numbers below ``count``; asked for a chunk at a time.
        count: how many claims there are.
    """
    order, busy, taken = _by_priority(priority), np.zeros(count, bool), np.zeros(len(priority), bool)
    earliest = np.empty(count, np.int64)
    for begin in range(0, len(order), CHUNK):
        waiting = order[begin : begin + CHUNK]
        claims = claims_of(waiting)
        while len(waiting):
            free = ~busy[claims].any(axis=1)
            waiting, claims = waiting[free], claims[free]
            won = _first(claims, earliest)
            taken[waiting[won]], busy[claims[won]] = True, True
    return taken


def _by_priority(priority: Array) -> Integers:
    """Indices (n,), the highest priority first and equal ones as they stand, so that nothing depends on chance."""
    return np.argsort(-priority, kind="stable")


def _first(claims: Integers, earliest: Integers) -> NDArray[np.bool_]:
    """Mask (n,) of the items that no earlier one shares a claim (n, k) with; ``earliest`` has room for each claim."""
    place = np.repeat(np.arange(len(claims)), claims.shape[1]).reshape(claims.shape)
    earliest[claims.ravel()[::-1]] = place.ravel()[::-1]  # of equal claims the last written stays: the earliest
    return np.all(earliest[claims] == place, axis=1)
