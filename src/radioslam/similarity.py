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

import itertools
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
TERMS = 1 << 14
"""Terms that are summed together: more would ask the system for fresh memory each time."""
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
    heard = _Readings.of(rows)
    for begin, end, behind in candidates(rows, order, begins, threshold, gate):
        for pairs in _tile_pairs(heard, begin, end, behind, threshold, margin):
            i, j = order[pairs.i], order[pairs.j]
            pairs = Pairs(np.minimum(i, j), np.maximum(i, j), pairs.similarity)
            yield pairs.select(gate.lets(pairs.i, pairs.j)) if gate else pairs


def pair_similarity(strengths: sparse.csr_array, i: Integers, j: Integers) -> Array:
    """Similarity (n_pairs,) of the given pairs of rows only."""
    rows, similarity = unit_rows(strengths), np.empty(len(i))
    rows.sort_indices()
    heard = _Readings.of(rows)
    tile_of_pair = i // TILE
    order = np.argsort(tile_of_pair, kind="stable")
    cuts = np.flatnonzero(np.diff(tile_of_pair[order], prepend=-1, append=-1))
    for first, last in itertools.pairwise(cuts.tolist()):
        pairs = order[first:last]
        begin = int(tile_of_pair[pairs[0]]) * TILE
        tile, local = heard.tile(begin, min(begin + TILE, rows.shape[0]))
        others, place = np.unique(j[pairs], return_inverse=True)
        similarity[pairs] = _products(tile, i[pairs] - begin, *heard.of_scans(others, local), place)
    return np.minimum(similarity, 1.0)


@dataclass(frozen=True)
class _Readings:
    """Unit rows in the order of the tiles: of scan k ``count`` readings from ``first`` on; at the end one of nothing.

    ``nothing`` is its transmitter, the number of those that there are.
    """

    first: Integers
    count: Integers
    column: NDArray[np.int32]
    value: Array
    nothing: int

    @staticmethod
    def of(rows: sparse.csr_array) -> _Readings:
        m = rows.shape[1]
        first, count = rows.indptr[:-1].astype(np.int64), np.diff(rows.indptr)
        column = np.append(rows.indices, m).astype(np.int32)
        return _Readings(first, count, column, np.append(rows.data, 0.0), m)

    def tile(self, begin: int, end: int) -> tuple[Array, Integers]:
        """Some rows (t, w) over the transmitters that they hear, and where each transmitter stands there (m + 1,).

        All others, and nothing, share the last column, which is empty.
        """
        heard = np.unique(self.column[self.first[begin] : self.first[end - 1] + self.count[end - 1]])
        local = np.full(self.nothing + 1, len(heard))
        local[heard] = np.arange(len(heard))
        return _dense(*self.of_scans(np.arange(begin, end), local), len(heard) + 1), local

    def of_scans(self, scans: Integers, local: Integers) -> tuple[Integers, Array]:
        """Columns and strengths (s, k) of the readings of some scans, shorter ones filled up with nothing."""
        count = self.count[scans][:, None]
        k = np.arange(int(count.max(initial=0)))
        place = np.where(k < count, self.first[scans][:, None] + k, len(self.value) - 1)
        return local[self.column[place]], self.value[place]


def _tile_pairs(
    heard: _Readings, begin: int, end: int, behind: Integers, threshold: float, margin: float
) -> Iterator[Pairs]:
    """Pairs of the scans from ``begin`` to ``end`` with those ``behind`` that may match, in the order of the tiling."""
    tile, local = heard.tile(begin, end)
    width = tile.shape[1]
    single = np.ascontiguousarray(tile[:, :-1].T, dtype=np.float32)
    part = max(BUFFER // (width + end - begin), FEWEST)
    for k in range(0, len(behind), part):
        scans = behind[k : k + part]
        number, strength = heard.of_scans(scans, local)
        products = _dense(number, strength.astype(np.float32), width)[:, :-1] @ single
        other, own = np.divmod(np.flatnonzero(products.ravel() >= threshold - margin), end - begin)
        later = scans[other] > begin + own
        other, own = other[later], own[later]
        similarity = _products(tile, own, number, strength, other)
        keep = (similarity.round(DIGITS) >= threshold) & (similarity > 0)
        yield Pairs(begin + own[keep], scans[other[keep]], np.minimum(similarity[keep], 1.0))


def _dense(number: Integers, strength: Array, width: int) -> Array:
    """Readings (s, k) as rows (s, width); the last column holds what the tile does not hear."""
    table = np.zeros((len(number), width), strength.dtype)
    table.ravel()[number + width * np.arange(len(number))[:, None]] = strength
    table[:, -1] = 0.0
    return table


def _products(tile: Array, own: Integers, number: Integers, strength: Array, other: Integers) -> Array:
    """Products (p,) of rows ``own`` of the tile with scans ``other``, in parts that fit the buffer."""
    product, part = np.empty(len(own)), max(TERMS // max(number.shape[1], 1), 1)
    number, strength = np.ascontiguousarray(number.T), np.ascontiguousarray(strength.T)
    for k in range(0, len(own), part):
        a, b = own[k : k + part], other[k : k + part]
        place = np.take(number, b, axis=1)
        place += tile.shape[1] * a
        terms = np.take(tile, place)
        terms *= np.take(strength, b, axis=1)
        # One row after the other, also where there is one column, which sum would add up in another order.
        product[k : k + part] = terms.cumsum()[-1:] if terms.shape[1] == 1 and len(terms) else terms.sum(axis=0)
    return product
