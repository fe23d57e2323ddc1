"""Dissimilar scans were not made at one place: one-sided factors that keep walks apart.

Loops only ever pull, so a crowd that is held by nothing else falls in on itself. What pushes back is every pair of
scans that is less similar than scans of one walk at their distance would be:

    e = √w / σ · max(0, d_lo(s) - |p_j - p_i|),      w = λ / √(n_i n_j)

d_lo(s) is a low quantile of the distance between scans of one walk at similarity s, and n the number of scans of other
walks nearby, since a thousand pairs in one corridor say what one says. d_lo is cut at a few metres: beyond, few pairs
of one walk have taught it, and scans that heard little for reasons of their own would blow the map up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from radioslam.config import PlacementConfig
from radioslam.fingerprints import Fingerprints
from radioslam.losses import LossName
from radioslam.rigid_walks import RigidWalks
from radioslam.similarity import pair_similarity
from radioslam.uncertainty import pairs_along_walks

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SAMPLE_DISTANCE_M = 30.0
BINS = 25
LEAST_SAMPLES = 10
MARGIN_M = 5.0
"""Pairs so much beyond their least distance are watched, since a step may bring them nearer."""
LEAST_DISTANCE_M = 3.0
"""Smaller least distances say nothing at the spacing of the fingerprints."""


@dataclass(frozen=True)
class LeastDistance:
    """d_lo: a table from similarity (n,), increasing, to metres (n,), not increasing."""

    similarity: Array
    distance_m: Array

    def at(self, similarity: Array) -> Array:
        """d_lo(s) in m, shape of ``similarity``."""
        return np.interp(similarity, self.similarity, self.distance_m)


def learn_least_distance(
    fingerprints: Fingerprints, strengths: sparse.csr_array, config: PlacementConfig
) -> LeastDistance:
    """The quantile of the distance between scans of one walk in bins of similarity, made monotone and cut.

    Without enough pairs nothing is kept apart: d_lo = 0.
    """
    i, j = pairs_along_walks(fingerprints, SAMPLE_DISTANCE_M)
    distance = np.hypot(*(fingerprints.poses[i, :2] - fingerprints.poses[j, :2]).T)
    bin_of = np.minimum((pair_similarity(strengths, i, j) * BINS).astype(np.int64), BINS - 1)
    grid, table = (np.arange(BINS) + 0.5) / BINS, np.full(BINS, np.nan)
    for k in range(BINS):
        samples = distance[bin_of == k]
        if len(samples) >= LEAST_SAMPLES:
            table[k] = np.quantile(samples, config.apart_quantile)
    known = np.isfinite(table)
    if not known.any():
        return LeastDistance(grid, np.zeros(BINS))
    filled = np.interp(grid, grid[known], table[known])
    monotone = np.maximum.accumulate(filled[::-1])[::-1]
    return LeastDistance(grid, np.minimum(monotone, config.apart_limit_m))


@dataclass(frozen=True)
class Dissimilar:
    """Pairs of points that may come too near: ``i``, ``j`` (m,), least distance (m,) in m, and σ/√w (m,) in m."""

    i: Integers
    j: Integers
    least_m: Array
    sigma_m: Array


def find_dissimilar(
    walk: Integers, positions_xy: Array, strengths: sparse.csr_array, least: LeastDistance, config: PlacementConfig
) -> Dissimilar:
    """Pairs of points of different walks (n,) that stand nearer than their least distance, or nearly so."""
    reach = max(config.crowd_radius_m, float(least.distance_m.max()) + MARGIN_M)
    pairs = cKDTree(positions_xy).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = pairs[walk[pairs[:, 0]] != walk[pairs[:, 1]]]
    i, j = pairs[np.lexsort(pairs.T[::-1])].T
    distance = np.hypot(*(positions_xy[j] - positions_xy[i]).T)
    near = distance <= config.crowd_radius_m
    crowd = np.maximum(np.bincount(np.concatenate([i[near], j[near]]), minlength=len(walk)), 1)
    least_m = least.at(pair_similarity(strengths, i, j))
    keep = (least_m > LEAST_DISTANCE_M) & (distance < least_m + MARGIN_M)
    i, j = i[keep], j[keep]
    weight = config.apart_weight / np.sqrt(crowd[i] * crowd[j])
    return Dissimilar(i, j, least_m[keep], config.apart_sigma_m / np.sqrt(weight))


class ApartBlock:
    """Repulsion: e = max(0, d_lo - |p_j - p_i|) / σ for each dissimilar pair."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, walks: RigidWalks, pairs: Dissimilar) -> None:
        self.walks, self.pairs = walks, pairs
        self.variables = np.concatenate([walks.variables(pairs.i), walks.variables(pairs.j)], axis=1)

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 1)."""
        return self._gap(x)[1]

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 1) and Jacobians (m, 1, 10), zero where the pair is far enough apart."""
        direction, residuals = self._gap(x)
        jacobian = np.zeros((len(residuals), 1, 10))
        near = np.flatnonzero(residuals[:, 0] > 0)
        towards = -(direction / self.pairs.sigma_m[:, None])[near]
        ends = [-self.walks.jacobians(x, self.pairs.i[near]), self.walks.jacobians(x, self.pairs.j[near])]
        jacobian[near, 0] = np.einsum("ma,mab->mb", towards, np.concatenate(ends, axis=2))
        return residuals, jacobian

    def _gap(self, x: Array) -> tuple[Array, Array]:
        """Unit vectors (m, 2) from i to j, and whitened residuals (m, 1)."""
        positions = self.walks.positions(x)
        offset = positions[self.pairs.j] - positions[self.pairs.i]
        distance = np.hypot(*offset.T)
        direction = offset / np.maximum(distance, 1e-9)[:, None]
        return direction, (np.maximum(self.pairs.least_m - distance, 0.0) / self.pairs.sigma_m)[:, None]
