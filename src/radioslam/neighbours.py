"""Weighted k nearest neighbours in signal space: the baseline that everybody knows.

Nearness is the cosine of exponential strengths (``fingerprints.represent``), the weight of each of the k its cosine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import FingerprintConfig
from radioslam.fingerprints import represent
from radioslam.similarity import unit_rows

Array = NDArray[np.float64]

STRENGTHS = FingerprintConfig(representation="exponential")


@dataclass(frozen=True)
class Neighbours:
    """Samples at ``positions_xy`` (n, 2) with ``strengths`` (n, m): unit rows of exponential strengths."""

    positions_xy: Array
    strengths: sparse.csr_array

    @staticmethod
    def of(positions_xy: Array, rss_dbm: sparse.csr_array) -> Neighbours:
        """From strengths (n, m) in dBm."""
        return Neighbours(positions_xy, unit_rows(represent(rss_dbm, STRENGTHS)))

    def similarity(self, scans_dbm: sparse.csr_array, unknown: Array) -> Array:
        """Cosine (s, n) between scans (s, m) and samples.

        ``unknown`` (s,) counts readings of access points that the map does not know; each lengthens the scan by the
        mean square of its known strengths.
        """
        strengths = represent(scans_dbm, STRENGTHS)
        known = np.maximum(np.diff(scans_dbm.indptr), 1)
        products: Array = (unit_rows(strengths) @ self.strengths.T).toarray()
        return products * np.sqrt(known / (known + unknown))[:, None]

    def locate(self, similarity: Array, k: int) -> Array:
        """Positions (s, 2) from cosines (s, n)."""
        k = min(k, similarity.shape[1])
        best = np.argpartition(-similarity, k - 1, axis=1)[:, :k]
        weight = np.maximum(np.take_along_axis(similarity, best, axis=1), 1e-9)
        position: Array = np.einsum("sk,skd->sd", weight / weight.sum(axis=1, keepdims=True), self.positions_xy[best])
        return position
