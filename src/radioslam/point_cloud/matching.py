"""Matches of descriptors, and the rigid motion most of them agree on (RANSAC, Fischler and Bolles 1981)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

POLISHING = 3
"""How often the motion is fitted again to the matches that it explains."""


def match(target: NDArray[np.float32], source: NDArray[np.float32], ratio: float) -> tuple[Integers, Integers]:
    """Pairs of target and source descriptors (n, 352) and (m, 352) of which each is nearest to the other.

    Of a source's two nearest targets the first must be nearer than ``ratio`` times the second (Lowe 2004).
    """
    if len(target) < 2 or not len(source):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    product = target @ source.T
    columns = np.arange(len(source))
    first = product.argmax(axis=0)
    best = product[first, columns]
    mutual = product.argmax(axis=1)[first] == columns
    product[first, columns] = -np.inf
    second = product.max(axis=0)
    # Of unit vectors the squared distance is 2 - 2 a·b.
    clear = (1.0 - best) <= ratio**2 * (1.0 - second)
    kept = np.flatnonzero(mutual & clear)
    return first[kept].astype(np.int64), kept


def find_motions(
    target: Array, source: Array, tolerance_m: float, trials: int, most: int, rng: np.random.Generator
) -> list[tuple[Array, int]]:
    """Motions T_target_source that explain the most of the matched points (n, 3), best first, with their support.

    Three matches give a motion by SVD; triples whose sides differ in length, or that are too short to hold a rotation,
    are passed over before. The best motion is fitted again to what it explains; the next one must explain matches
    that those before do not, and so on up to ``most``.
    """
    n = len(target)
    if n < 3:
        return []
    triples = _triples(target, source, tolerance_m, trials, rng)
    if not len(triples):
        return []
    motions = rigid.fit(source[triples], target[triples])
    explained = np.linalg.norm(rigid.transform(motions, source) - target, axis=-1) <= tolerance_m
    found: list[tuple[Array, int]] = []
    free = np.ones(n, bool)
    for _ in range(most):
        votes = (explained & free).sum(axis=1)
        best = int(votes.argmax())
        if votes[best] < 3:
            break
        T, inliers = _polish(motions[best], explained[best], target, source, tolerance_m)
        found.append((T, int(inliers.sum())))
        free &= ~(inliers | explained[best])
    return found


def _triples(target: Array, source: Array, tolerance_m: float, trials: int, rng: np.random.Generator) -> Integers:
    """Three different matches (t, 3) each, whose triangles are congruent within the tolerance."""
    n = len(target)
    triples = rng.integers(0, n, (trials, 3))
    keep = np.ones(trials, bool)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        side = np.linalg.norm(target[triples[:, a]] - target[triples[:, b]], axis=1)
        its = np.linalg.norm(source[triples[:, a]] - source[triples[:, b]], axis=1)
        keep &= (np.abs(side - its) <= tolerance_m) & (side > 3 * tolerance_m)
    return triples[keep].astype(np.int64)


def _polish(
    T: Array, inliers: NDArray[np.bool_], target: Array, source: Array, tolerance_m: float
) -> tuple[Array, NDArray[np.bool_]]:
    for _ in range(POLISHING):
        fitted = rigid.fit(source[inliers], target[inliers])
        wider = np.linalg.norm(rigid.transform(fitted, source) - target, axis=-1) <= tolerance_m
        if wider.sum() < inliers.sum():
            break
        T, inliers = fitted, wider
    return T, inliers
