"""How likely a scan is at each candidate place, under the field.

An access point that is heard with r dBm at x, where the field expects μ and detection p, adds
g (log p + log N(r - b; μ, v)); one that is not heard adds log(1 - p). v is the variance of its single readings. The
weight g of a reading is its exponential strength over the mean of those of its scan: near a transmitter a decibel is
worth few metres, and what is far errs together with everything else far. The offset b ~ N(0, β²) of the phone is common
to the scan and integrated out in closed form: with S = Σ g / v and R = Σ g (r - μ) / v it adds
½ R² / (S + 1/β²) - ½ log(1 + S β²). Scans (s, m) times tables (m, q) give all candidates at once.

Errors of neighbouring access points are not independent; the sum is tempered by τ / √k for k readings, and τ is
calibrated on walks that the field has not seen (``calibration.py``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import logsumexp

from radioslam.field import Field
from radioslam.fingerprints import represent
from radioslam.neighbours import STRENGTHS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Candidates:
    """q places with tables of m access points.

    Attributes:
        positions_xy: (q, 2).  precision: (m,) 1 / v.  normal: (m,) -½ log v, which tells floors apart.
        pull: (m, q) μ / v.  constant: (m, q) log p - ½ μ² / v.
        silent: (m, q) log(1 - p).  silence: (q,) its sum, the log-probability of hearing nothing at all.
        offset_sigma_db: β.
    """

    positions_xy: Array
    precision: Array
    normal: Array
    pull: Array
    constant: Array
    silent: Array
    silence: Array
    offset_sigma_db: float

    @staticmethod
    def of(field: Field, weights: Array, offset_sigma_db: float) -> Candidates:
        """The cells of a field; ``weights`` (m,) say how much each access point counts, 0 leaves it out."""
        places = field.cells.centre_xy
        at = field.predict(places)
        precision = weights / field.residual_variance
        pull = precision * at.mean_dbm
        constant = weights * np.log(at.detection) - 0.5 * pull * at.mean_dbm
        silent = weights * np.log1p(-at.detection)
        return Candidates(
            positions_xy=places,
            precision=precision,
            normal=-0.5 * weights * np.log(field.residual_variance),
            pull=_table(pull),
            constant=_table(constant),
            silent=_table(silent),
            silence=silent.sum(axis=1),
            offset_sigma_db=offset_sigma_db,
        )

    def log_likelihood(self, scans_dbm: sparse.csr_array) -> Array:
        """(s, q) of scans (s, m), offsets integrated out."""
        weight = relative_strengths(scans_dbm)
        level = _with(scans_dbm, weight.data * scans_dbm.data)
        heard = _with(scans_dbm, np.ones(scans_dbm.nnz))
        predicted = _single(weight) @ self.pull
        fit = _single(level) @ self.pull + _single(weight) @ self.constant - _single(heard) @ self.silent + self.silence
        squares = _with(scans_dbm, level.data * scans_dbm.data)
        everywhere = weight @ self.normal - 0.5 * (squares @ self.precision)
        if self.offset_sigma_db > 0:
            precision = weight @ self.precision
            above = (level @ self.precision)[:, None] - predicted
            fit += 0.5 * above**2 / (precision + self.offset_sigma_db**-2)[:, None]
            everywhere -= 0.5 * np.log1p(precision * self.offset_sigma_db**2)
        return np.asarray(fit + everywhere[:, None], dtype=np.float64)

    def tempered(self, scans_dbm: sparse.csr_array, temperature: float) -> Array:
        """Log-posterior (s, q) up to a constant, flat prior over places."""
        count = np.maximum(np.diff(scans_dbm.indptr), 1)
        return self.log_likelihood(scans_dbm) * (temperature / np.sqrt(count))[:, None]

    def moments(self, log_posterior: Array) -> tuple[Array, Array]:
        """Mean (s, 2) and standard deviation per axis (s, 2) of log-posteriors (s, q)."""
        weight = np.exp(log_posterior - logsumexp(log_posterior, axis=1, keepdims=True))
        mean = weight @ self.positions_xy
        variance = weight @ self.positions_xy**2 - mean**2
        return mean, np.sqrt(np.maximum(variance, 0.0))


def relative_strengths(scans_dbm: sparse.csr_array) -> sparse.csr_array:
    """(s, m) exponential strengths over the mean of those that a scan heard; an offset of the phone changes nothing."""
    strengths = represent(scans_dbm, STRENGTHS)
    count = np.diff(scans_dbm.indptr)
    mean = strengths.sum(axis=1) / np.maximum(count, 1)
    return _with(scans_dbm, strengths.data / np.repeat(mean, count))


def _with(pattern: sparse.csr_array, values: Array) -> sparse.csr_array:
    return sparse.csr_array((values, pattern.indices, pattern.indptr), shape=pattern.shape)


def _single(matrix: sparse.csr_array) -> sparse.csr_array:
    return matrix.astype(np.float32)


def _table(values: Array) -> Array:
    """(q, m) as (m, q) in single precision, in the order in which products read it."""
    table: Array = np.ascontiguousarray(values.T, dtype=np.float32)
    return table
