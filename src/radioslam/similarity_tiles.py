"""Which scans may match which: tiles of a crowd for the similarity join, and the scans that may match each tile.

Without positions a tile holds scans that are alike. A scan at the angle α from the tile's mean, whose own scans lie
within the angle ρ of it, is at least α - ρ away from each of them, so that it may match one only where

    α ≤ ρ + arccos(threshold).

Where positions are known, a tile holds scans that are near, and a scan farther than the gate from the box around them
matches none.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

TILE = 128
"""Scans per tile, more or less: small tiles are narrow, large ones are fast to multiply."""
FEW = 1000
"""So few scans are not worth an order."""
GROUP = 64
"""Tiles whose candidates are sought at a time."""
SLACK_RAD = 1e-5
"""What angles may err by: √(2 ε) where the cosine is near 1."""


@dataclass(frozen=True)
class Gate:
    """Pairs of scans of one frame, at most ``radius_m`` apart: ``positions_xy`` (n, 2), ``frame`` (n,)."""

    positions_xy: Array
    frame: Integers
    radius_m: float

    def points(self) -> Array:
        """Positions (n, 3) with frames as layers that the radius does not bridge."""
        return np.column_stack([self.positions_xy, self.frame * (4 * self.radius_m + 1.0)])

    def lets(self, i: Integers, j: Integers) -> NDArray[np.bool_]:
        """Mask (n_pairs,) of the pairs that pass."""
        offset = self.positions_xy[j] - self.positions_xy[i]
        return (self.frame[i] == self.frame[j]) & (np.hypot(offset[:, 0], offset[:, 1]) <= self.radius_m)


def tiles_of(rows: sparse.csr_array, gate: Gate | None) -> tuple[Integers, Integers]:
    """An order (n,) of unit rows (n, m), and where each tile begins in it, (t + 1,) with the end."""
    if gate:
        tree = cKDTree(gate.points(), leafsize=TILE)
        return np.asarray(tree.indices, dtype=np.int64), _leaves(tree)
    if rows.shape[0] <= FEW:
        return np.arange(rows.shape[0]), _cuts(np.arange(rows.shape[0]) // (2 * TILE))
    label = _nearest_landmark(rows)
    order = np.argsort(label, kind="stable")
    return order, _cuts(label[order])


def candidates(
    rows: sparse.csr_array, order: Integers, begin: Integers, threshold: float, gate: Gate | None
) -> Iterator[tuple[int, int, Integers]]:
    """Of each tile: where it begins and ends, and the places of all scans that may match it, its own and later ones.

    Rows (n, m) are unit rows of one sign in the order of the tiles; matches are at least as similar as the threshold.
    """
    if gate:
        yield from _near_candidates(gate.points()[order], begin, gate.radius_m)
    elif rows.shape[0] <= FEW:
        yield from ((b, e, np.arange(b, rows.shape[0])) for b, e in itertools.pairwise(begin.tolist()))
    else:
        yield from _like_candidates(rows, begin, threshold)


def _nearest_landmark(rows: sparse.csr_array) -> Integers:
    """Number (n,) of the landmark most like each row; landmarks are rows spread evenly."""
    n = rows.shape[0]
    landmarks = rows[np.linspace(0, n - 1, -(-n // TILE)).astype(np.int64)]
    label = np.zeros(n, np.int64)
    columns = landmarks.T.tocsr()
    for k in range(0, n, 1 << 15):
        products = (rows[k : k + (1 << 15)] @ columns).tocsr()
        alike, count = np.abs(products.data), np.diff(products.indptr)
        met = np.flatnonzero(count)
        most = np.repeat(np.maximum.reduceat(alike, products.indptr[met]), count[met]) if len(met) else alike
        best = np.flatnonzero(alike == most)
        label[k + np.repeat(met, count[met])[best]] = products.indices[best]
    return label


def _cuts(label: Integers) -> Integers:
    """Where tiles begin, (t + 1,) with the end, in sorted labels (n,); no tile has more than 2 · TILE scans."""
    first = np.flatnonzero(np.diff(label, prepend=-1))
    size = np.diff(np.append(first, len(label)))
    parts = -(-size // (2 * TILE))
    part = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    begin = np.repeat(first, parts) + part * np.repeat(size, parts) // np.repeat(parts, parts)
    return np.append(begin, len(label))


def _like_candidates(rows: sparse.csr_array, begin: Integers, threshold: float) -> Iterator[tuple[int, int, Integers]]:
    """Tiles of sorted unit rows; the means of some tiles at a time meet all rows."""
    n, tiles, columns = rows.shape[0], len(begin) - 1, rows.T.tocsr()
    of_tile = sparse.csr_array((np.ones(n), np.arange(n), begin), shape=(tiles, n))
    reach_rad = np.arccos(np.clip(threshold, -1.0, 1.0)) + SLACK_RAD
    for k in range(0, tiles, GROUP):
        means = of_tile[k : k + GROUP] @ rows
        length = np.sqrt(means.multiply(means).sum(axis=1))
        products = (means @ columns).tocsr()
        for t, (first, last) in enumerate(itertools.pairwise(products.indptr)):
            scans, (b, e) = products.indices[first:last], begin[k + t : k + t + 2].tolist()
            angle_rad = np.arccos(np.minimum(products.data[first:last] / max(length[t], 1e-300), 1.0))
            radius_rad = angle_rad[(scans >= b) & (scans < e)].max(initial=0.0)
            yield b, e, np.sort(scans[(scans >= b) & (angle_rad <= radius_rad + reach_rad)]).astype(np.int64)


def _leaves(tree: cKDTree) -> Integers:
    """Where the leaves of a k-d tree begin in its order, (t + 1,) with the end."""
    begin, waiting = [tree.n], [tree.tree]
    while waiting:
        node = waiting.pop()
        if node.split_dim < 0:
            begin.append(node.start_idx)
        else:
            waiting += [node.lesser, node.greater]
    return np.sort(np.array(begin))


def _near_candidates(points: Array, begin: Integers, radius_m: float) -> Iterator[tuple[int, int, Integers]]:
    """Tiles of sorted points (n, d); each meets the scans near its box, of tiles whose boxes are near."""
    low, high = np.minimum.reduceat(points, begin[:-1]), np.maximum.reduceat(points, begin[:-1])
    reach_m = radius_m * (1 + 1e-9)
    for t, (b, e) in enumerate(itertools.pairwise(begin.tolist())):
        gap = np.maximum(np.maximum(low[t:] - high[t], low[t] - high[t:]), 0.0)
        near = t + np.flatnonzero(np.sum(gap**2, axis=1) <= reach_m**2)
        scans = _ranges(begin[near], begin[near + 1])
        gap = np.maximum(np.maximum(points[scans] - high[t], low[t] - points[scans]), 0.0)
        yield b, e, scans[np.sum(gap**2, axis=1) <= reach_m**2]


def _ranges(begin: Integers, end: Integers) -> Integers:
    """The numbers of all ranges, one after the other."""
    count = end - begin
    return np.arange(count.sum()) + np.repeat(begin - np.cumsum(count) + count, count)
