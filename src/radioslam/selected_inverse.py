"""Diagonal of the inverse of a sparse matrix from its factor, without the rest of the inverse.

For H = L D Lᵀ with L unit lower triangular, Z = H⁻¹ is needed only on the pattern of L (Takahashi et al. 1973). Columns
that share their pattern, nearly, make a supernode J with the rows S below it, and

    Z_SJ = -Z_SS L_SJ L_JJ⁻¹,      Z_JJ = L_JJ⁻ᵀ D_JJ⁻¹ L_JJ⁻¹ - (L_SJ L_JJ⁻¹)ᵀ Z_SJ,

from the last supernode to the first. Z_SS stands in the front, Z over J ∪ S, of the parent: the supernode of the first
row of S. All is dense algebra on blocks; the cost is that of the factorisation, the memory that of the fronts whose
children still wait.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg.lapack import dtrtri

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


RELAXED = 8
"""A column joins the next with so many rows that it does not have itself: few large blocks are faster than many."""


@dataclass
class _Front:
    rows: Integers
    inverse: Array


def inverse_diagonal(lower: sparse.csc_array, pivots: Array) -> Array:
    """Diagonal (n,) of (L D Lᵀ)⁻¹ for the strictly lower part of L (n, n) and the diagonal of D (n,)."""
    lower.sort_indices()
    begin, parent = _supernodes(lower)
    end = np.append(begin[1:], lower.shape[0])
    waiting = np.bincount(parent[parent >= 0], minlength=len(begin))
    diagonal, fronts = np.empty(lower.shape[0]), dict[int, _Front]()
    for k in range(len(begin) - 1, -1, -1):
        columns = slice(begin[k], end[k])
        below = lower.indices[lower.indptr[end[k] - 1] : lower.indptr[end[k]]].astype(np.int64)
        z_ss = _part(fronts[int(parent[k])], below) if len(below) else np.zeros((0, 0))
        z_jj, z_sj = _eliminate(_block(lower, begin[k], end[k], below), pivots[columns], z_ss)
        diagonal[columns] = np.diag(z_jj)
        if waiting[k]:
            rows = np.concatenate([np.arange(begin[k], end[k]), below])
            fronts[k] = _Front(rows, _joined(z_jj, z_sj, z_ss))
        if parent[k] >= 0:
            waiting[parent[k]] -= 1
            if not waiting[parent[k]]:
                del fronts[int(parent[k])]
    return diagonal


def _supernodes(lower: sparse.csc_array) -> tuple[Integers, Integers]:
    """First column of each supernode, and the number of its parent or -1."""
    n, count = lower.shape[0], np.diff(lower.indptr)
    heir = np.full(n, -1, dtype=np.int64)
    heir[count > 0] = lower.indices[lower.indptr[:-1][count > 0]]
    goes_on = (heir[:-1] == np.arange(1, n)) & (count[1:] + 1 - count[:-1] <= RELAXED)
    begin = np.flatnonzero(np.concatenate([[True], ~goes_on]))
    number = np.repeat(np.arange(len(begin)), np.diff(np.append(begin, n)))
    last = np.append(begin[1:], n) - 1
    return begin, np.where(heir[last] >= 0, number[heir[last]], -1)


def _block(lower: sparse.csc_array, begin: int, end: int, below: Integers) -> Array:
    """Columns ``begin`` to ``end`` of L with its unit diagonal, dense, (width + below, width)."""
    width, inside = end - begin, slice(lower.indptr[begin], lower.indptr[end])
    row, column = lower.indices[inside], np.repeat(np.arange(width), np.diff(lower.indptr[begin : end + 1]))
    block = np.eye(width + len(below), width)
    block[np.where(row < end, row - begin, width + np.searchsorted(below, row)), column] = lower.data[inside]
    return block


def _eliminate(block: Array, pivots: Array, z_ss: Array) -> tuple[Array, Array]:
    """Z_JJ (w, w) and Z_SJ (m, w)."""
    width = block.shape[1]
    # Called tens of thousands of times on small blocks: LAPACK without the checks around it.
    inverse = dtrtri(block[:width], lower=1, unitdiag=1)[0] if width > 1 else np.ones((1, 1))
    coupling = block[width:] @ inverse
    z_sj = -z_ss @ coupling
    return (inverse.T / pivots) @ inverse - coupling.T @ z_sj, z_sj


def _joined(z_jj: Array, z_sj: Array, z_ss: Array) -> Array:
    width = len(z_jj)
    front = np.empty((width + len(z_ss), width + len(z_ss)))
    front[:width, :width], front[width:, width:] = z_jj, z_ss
    front[width:, :width], front[:width, width:] = z_sj, z_sj.T
    return front


def _part(front: _Front, rows: Integers) -> Array:
    place = np.searchsorted(front.rows, rows)
    return front.inverse[place[:, None], place]
