"""Cosine similarity between fingerprints, equation (2), and the similarity join.

    s_ij = f_i · f_j / (‖f_i‖ ‖f_j‖)

over the access points of either scan. A transmitter that one scan misses counts as strength 0 there: it adds
nothing to the product but lengthens the norm of the scan that heard it, so it lowers the similarity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


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


def unit_rows(strengths: sparse.csr_array) -> sparse.csr_array:
    """Scale each row of (n, m) to Euclidean length 1; empty rows stay empty."""
    norms = np.sqrt(strengths.multiply(strengths).sum(axis=1))
    scale = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0)
    return sparse.csr_array(sparse.diags_array(scale) @ strengths)


def similar_pairs(strengths: sparse.csr_array, threshold: float = 0.0, block: int = 1024) -> Pairs:
    """All pairs i < j with similarity ≥ ``threshold`` and at least one common transmitter.

    Rows (n, m) are joined block by block, so that beside the answer the memory stays at
    ``block`` · n numbers whatever the overlap; the time grows with the number of common readings.
    """
    rows = unit_rows(strengths)
    columns = rows.T.tocsr()
    found = [_block_pairs(rows[k : k + block] @ columns, k, threshold) for k in range(0, rows.shape[0], block)]
    if not found:
        return Pairs(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
    return Pairs(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _block_pairs(products: sparse.csr_array, offset: int, threshold: float) -> tuple[Integers, Integers, Array]:
    products = products.tocoo()
    i, j = products.row.astype(np.int64) + offset, products.col.astype(np.int64)
    keep = (i < j) & (products.data >= threshold) & (products.data > 0)
    return i[keep], j[keep], np.minimum(products.data[keep], 1.0)


def pair_similarity(strengths: sparse.csr_array, i: Integers, j: Integers) -> Array:
    """Similarity (n_pairs,) of the given pairs of rows only."""
    rows = unit_rows(strengths)
    return np.minimum(np.asarray(rows[i].multiply(rows[j]).sum(axis=1)).ravel(), 1.0)
