"""Cosine similarity between fingerprints, equation (2), and the similarity join.

    s_ij = f_i · f_j / (‖f_i‖ ‖f_j‖)

over the access points of either scan. A transmitter that one scan misses counts as strength 0 there: it adds
nothing to the product but lengthens the norm of the scan that heard it, so it lowers the similarity.

The join finds all pairs above a threshold, exactly. Scans that are alike, or near each other, make a tile
(``similarity_tiles``), which says what scans may match it. Over the tile's own access points all of them become one
dense product in single precision; what comes near the threshold is computed again in double precision, by a sum over
the access points in their order, so that equals have one similarity to the last bit in whatever tile they meet.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.similarity_tiles import TILE, Gate, candidates, tiles_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

__all__ = ["Gate", "Pairs", "pair_similarity", "similar_pairs", "stream_similar_pairs", "unit_rows"]

BUFFER = 1 << 19
"""Numbers in the largest array of a tile; some ten of them are alive at a time, and fit a processor's cache."""
BLOCK = 1 << 17
"""Pairs that are gathered before they are stored."""
PAIRS = 1 << 14
"""Given pairs that are looked at together."""
FEWEST = 64
"""Candidates that are looked at together however wide the tile."""
DIGITS = 12
"""A similarity equal to the threshold in so many digits is similar enough."""


@dataclass(frozen=True)
class Pairs:
    """Pairs of fingerprints i < j with their similarity; three arrays of shape (n_pairs,)."""

    i: Integers
    j: Integers
    similarity: Array

    def __len__(self) -> int:
        return len(self.i)

    def select(self, mask: NDArray[np.bool_] | Integers) -> Pairs:
        """The pairs that a mask (n_pairs,) or an index array picks."""
        return Pairs(self.i[mask], self.j[mask], self.similarity[mask])

    @staticmethod
    def collect(parts: Iterable[Pairs]) -> Pairs:
        """All pairs of the parts by i, and of one i the later j first."""
        blocks, small = list[Pairs](), list[Pairs]()
        for part in parts:
            small.append(part)
            if sum(map(len, small)) >= BLOCK:  # thousands of small arrays that stay would leave memory full of holes
                blocks.append(_joined(small))
                small = []
        pairs = _joined([*blocks, *small])
        return pairs.select(np.argsort((pairs.i + 1) * (pairs.j.max(initial=0) + 1) - pairs.j))


def _joined(parts: list[Pairs]) -> Pairs:
    none = np.zeros(0, np.int64)
    parts = [Pairs(none, none, np.zeros(0)), *parts]
    return Pairs(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("i", "j", "similarity")))


def unit_rows(strengths: sparse.csr_array) -> sparse.csr_array:
    """Scale each row of (n, m) to Euclidean length 1; empty rows stay empty."""
    norms = np.sqrt(strengths.multiply(strengths).sum(axis=1))
    scale = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0)
    return sparse.csr_array(sparse.diags_array(scale) @ strengths)


def similar_pairs(strengths: sparse.csr_array, threshold: float = 0.0, gate: Gate | None = None) -> Pairs:
    """All pairs i < j with similarity ≥ ``threshold`` and at least one common transmitter.

    They come by i, and of one i the later j first.

    Args:
        strengths: (n, m), all of one sign.
        threshold: of the cosine.
        gate: where the scans are and how far apart those of a pair may be; None: anywhere.
    """
    return Pairs.collect(stream_similar_pairs(strengths, threshold, gate))


def stream_similar_pairs(
    strengths: sparse.csr_array, threshold: float = 0.0, gate: Gate | None = None
) -> Iterator[Pairs]:
    """The pairs of ``similar_pairs`` in parts of no particular order.

    Beside the strengths this takes three more arrays of their size and 0.2 GB, however many scans and pairs there are.
    """
    rows = unit_rows(strengths)
    rows.sort_indices()
    most = int(np.diff(rows.indptr).max(initial=0))
    if not most:
        return
    margin = (most + 4) * 2.0**-23  # what single precision may err in a sum of so many products
    order, begins = tiles_of(rows, gate)
    rows = rows[order]
    for begin, end, behind in candidates(rows, order, begins, threshold, gate):
        for pairs in _tile_pairs(rows, begin, end, behind, threshold, margin):
            i, j = order[pairs.i], order[pairs.j]
            pairs = Pairs(np.minimum(i, j), np.maximum(i, j), pairs.similarity)
            yield pairs.select(gate.lets(pairs.i, pairs.j)) if gate else pairs


def pair_similarity(strengths: sparse.csr_array, i: Integers, j: Integers) -> Array:
    """Similarity (n_pairs,) of the given pairs of rows only; fastest where i increases."""
    rows, similarity = unit_rows(strengths), np.empty(len(i))
    rows.sort_indices()
    order = np.argsort(i // TILE, kind="stable")
    ends = np.flatnonzero(np.diff(i[order] // TILE, append=-1)) + 1
    for first, last in zip(np.append(0, ends[:-1]).tolist(), ends.tolist(), strict=True):
        pairs = order[first:last]
        begin = int(i[pairs[0]]) // TILE * TILE
        tile = _Tile.of(rows[begin : begin + TILE])
        for k in range(0, len(pairs), PAIRS):
            part = pairs[k : k + PAIRS]
            similarity[part] = tile.products(i[part] - begin, tile.seen(rows[j[part]]))
    return np.minimum(similarity, 1.0)


@dataclass(frozen=True)
class _Tile:
    """Unit rows (t, m) over the transmitters that one of them heard: ``table`` (t, w).

    ``column`` (m,) tells where in it a transmitter stands; all that none of them heard share the last, which is 0.
    """

    table: Array
    column: NDArray[np.int32]

    @staticmethod
    def of(rows: sparse.csr_array) -> _Tile:
        heard = np.unique(rows.indices)
        column = np.full(rows.shape[1], len(heard), np.int32)
        column[heard] = np.arange(len(heard))
        return _Tile(_in_columns(rows, column, len(heard) + 1).toarray(), column)

    def seen(self, rows: sparse.csr_array) -> sparse.csr_array:
        """Rows (s, m) as (s, w)."""
        return _in_columns(rows, self.column, self.table.shape[1])

    def products(self, own: Integers, others: sparse.csr_array) -> Array:
        """Products (p,) of the tile's rows ``own`` (p,) with rows (p, w), summed in the order of the transmitters."""
        begin = np.repeat((own * self.table.shape[1]).astype(np.int32), np.diff(others.indptr))
        terms = (others.data, others.indices + begin, others.indptr)
        return np.asarray(sparse.csr_array(terms, shape=(len(own), self.table.size)) @ self.table.ravel())


def _in_columns(rows: sparse.csr_array, column: NDArray[np.int32], width: int) -> sparse.csr_array:
    return sparse.csr_array((rows.data, column[rows.indices], rows.indptr), shape=(rows.shape[0], width))


def _tile_pairs(
    rows: sparse.csr_array, begin: int, end: int, behind: Integers, threshold: float, margin: float
) -> Iterator[Pairs]:
    """Pairs of the scans from ``begin`` to ``end`` with those ``behind`` that may match, in the order of the tiling."""
    tile, size = _Tile.of(rows[begin:end]), end - begin
    single = np.ascontiguousarray(tile.table.T, dtype=np.float32)
    part = max(BUFFER // (len(single) + size), FEWEST)
    for k in range(0, len(behind), part):
        scans = behind[k : k + part]
        others = tile.seen(rows[scans])
        products = others.astype(np.float32).toarray() @ single
        other, own = np.divmod(np.flatnonzero(products.ravel() >= threshold - margin), size)
        later = scans[other] > begin + own
        other, own = other[later], own[later]
        for p in range(0, len(own), PAIRS):
            yield _alike(tile, own[p : p + PAIRS], others, other[p : p + PAIRS], threshold, begin, scans)


def _alike(
    tile: _Tile, own: Integers, others: sparse.csr_array, other: Integers, threshold: float, begin: int, scans: Integers
) -> Pairs:
    """Of pairs that may be alike those that are."""
    similarity = tile.products(own, others[other])
    keep = (similarity.round(DIGITS) >= threshold) & (similarity > 0)
    return Pairs(begin + own[keep], scans[other[keep]], np.minimum(similarity[keep], 1.0))
