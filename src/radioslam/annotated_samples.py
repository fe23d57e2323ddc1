"""The paper's radio map as a ``StrengthMap``: the annotated samples themselves, asked by the nearest of them.

Kernel regression (Nadaraya 1964, Watson 1964) over the k nearest samples, weight exp(-d / ℓ) at distance d. What the
neighbours say of spread and detection is joined by one reading's worth of what all samples say, so that an answer far
from every sample is as uncertain as the access point's readings differ, and hears nothing.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from radioslam.errors import MappingError
from radioslam.field import Prediction

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

NEIGHBOURS = 8
LENGTH_M = 5.0
"""ℓ: about how far shadowing reaches indoors."""
SILENCE = 0.1
"""Weight of hearing nothing, against that of the samples near by."""
MIN_SIGMA_DB = 3.0
"""No reading is trusted more than this."""


@dataclass(frozen=True)
class AnnotatedSamples:
    """n samples at ``positions_xy`` (n, 2) that heard ``rss_dbm`` (n, m) CSR; what is not stored was not heard.

    Raises:
        MappingError: nothing was heard.
    """

    positions_xy: Array
    rss_dbm: sparse.csr_array

    def __post_init__(self) -> None:
        if not self.rss_dbm.nnz:
            raise MappingError("expected samples that heard access points, found none; map walks with WiFi scans")

    def predict(self, positions_xy: Array, columns: Integers | None = None) -> Prediction:
        """Strengths at positions (q, 2) of the access points ``columns`` (m,), default all.

        Where no near sample heard one, its mean is the weakest reading of the map.
        """
        chosen = np.arange(self.rss_dbm.shape[1]) if columns is None else columns
        rss = self.rss_dbm[:, chosen].tocsr()
        heard, squares = rss.copy(), rss.copy()
        heard.data, squares.data = np.ones_like(rss.data), rss.data**2
        near = self._weights(positions_xy)
        weight, total, square = ((near @ one).toarray() for one in (heard, rss, squares))
        known = weight > 0
        mean = np.divide(total, weight, out=np.full_like(total, self.rss_dbm.data.min()), where=known)
        within = np.maximum(square - weight * mean**2, 0.0) * known
        variance = (within + self._overall_variance[chosen]) / (weight + 1.0)
        detection = weight / (near.sum(axis=1) + SILENCE)[:, None]
        return Prediction(mean, np.sqrt(np.maximum(variance, MIN_SIGMA_DB**2)), np.clip(detection, 0.01, 0.99))

    @functools.cached_property
    def _overall_variance(self) -> Array:
        return overall_variance(self.rss_dbm)

    def _weights(self, positions_xy: Array) -> sparse.csr_array:
        k = min(NEIGHBOURS, len(self.positions_xy))
        away, rows = cKDTree(self.positions_xy).query(positions_xy, k=np.arange(1, k + 1))
        indptr = np.arange(0, rows.size + 1, k)
        shape = (len(positions_xy), len(self.positions_xy))
        return sparse.csr_array((np.exp(-away / LENGTH_M).ravel(), rows.ravel(), indptr), shape=shape)


def overall_variance(rss_dbm: sparse.csr_array) -> Array:
    """(m,) of an access point's readings, shrunk towards that of all as if ten readings had it."""
    m, column, data = rss_dbm.shape[1], rss_dbm.indices, rss_dbm.data
    count = np.bincount(column, minlength=m)
    mean = np.bincount(column, data, m) / np.maximum(count, 1)
    squares = (data - mean[column]) ** 2
    common = float(squares.mean()) if len(squares) else MIN_SIGMA_DB**2
    return (np.bincount(column, squares, m) + 10 * common) / (count + 10)
