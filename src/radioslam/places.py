"""A map condensed to places: a few scans per cell of the floor stand for all that were ever made there.

However many walks cross a cell, it keeps the ``per_cell`` scans whose positions are known best, at most one of each
walk. What the rest of the crowd knows is in the positions and deviations of those, which its optimization gave them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import GrowingConfig
from radioslam.similarity import Pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Samples:
    """n scans with what a loop to them needs.

    Attributes:
        walk: (n,) number of the walk.  scan: (n,) index within it.  poses: (n, 3) in the map's frame.
        velocity: (n, 2) m/s in that frame.  sigma_m: (n,) of the position per axis, finite.  distance_m: (n,) walked.
        strengths: (n, m) CSR with rows of length 1.
    """

    walk: Integers
    scan: Integers
    poses: Array
    velocity: Array
    sigma_m: Array
    distance_m: Array
    strengths: sparse.csr_array

    def __len__(self) -> int:
        return len(self.walk)

    @staticmethod
    def none() -> Samples:
        """No scan at all."""
        number, value = np.zeros(0, np.int64), np.zeros(0)
        return Samples(number, number, np.zeros((0, 3)), np.zeros((0, 2)), value, value, sparse.csr_array((0, 0)))

    def select(self, rows: NDArray[np.bool_] | Integers) -> Samples:
        """The samples that a mask (n,) or an index array picks."""
        return Samples(*(getattr(self, name)[rows] for name in Samples.__dataclass_fields__))

    def widened(self, transmitters: int) -> Samples:
        """The same with so many columns."""
        rows = self.strengths
        wide = sparse.csr_array((rows.data, rows.indices, rows.indptr), shape=(len(self), transmitters))
        return replace(self, strengths=wide)

    @staticmethod
    def concatenate(parts: Iterable[Samples]) -> Samples:
        """All samples of the parts, in their order."""
        parts = [part for part in parts if len(part)]
        if not parts:
            return Samples.none()
        columns = max(part.strengths.shape[1] for part in parts)
        names = [name for name in Samples.__dataclass_fields__ if name != "strengths"]
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        rows = sparse.vstack([part.widened(columns).strengths for part in parts], format="csr")
        return Samples(**joined, strengths=sparse.csr_array(rows))


def condense(samples: Samples, config: GrowingConfig) -> Samples:
    """The best known ``per_cell`` samples of every cell, one of each walk in it, in the order of the samples."""
    if not len(samples):
        return samples
    corner = np.floor(samples.poses[:, :2] / config.cell_m).astype(np.int64)
    cell = np.unique(corner, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((samples.sigma_m, samples.walk, cell))
    again = (np.diff(cell[order]) == 0) & (np.diff(samples.walk[order]) == 0)
    order = order[np.append(True, ~again)]
    order = order[np.lexsort((samples.walk[order], samples.sigma_m[order], cell[order]))]
    first = np.flatnonzero(np.append(True, np.diff(cell[order]) != 0))
    rank = np.arange(len(order)) - np.repeat(first, np.diff(np.append(first, len(order))))
    return samples.select(np.sort(order[rank < config.per_cell]))


def similar_to(places: Samples, scans: sparse.csr_array, threshold: float) -> Pairs:
    """Pairs (place, scan) of similarity ≥ ``threshold``; scans (n, m) have rows of length 1 over the same
    columns, of which either may know only the first."""
    columns = max(places.strengths.shape[1], scans.shape[1])
    rows = sparse.csr_array((scans.data, scans.indices, scans.indptr), shape=(scans.shape[0], columns))
    products = (places.widened(columns).strengths @ rows.T.tocsr()).tocoo()
    near = (products.data >= threshold) & (products.data > 0)
    i, j = (index[near].astype(np.int64) for index in (products.row, products.col))
    return Pairs(i, j, np.minimum(products.data[near], 1.0))
