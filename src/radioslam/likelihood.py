"""How likely a scan is at each candidate place, under the field.

An access point that is heard with r dBm at x, where the field expects N(μ, v) and detection p, adds
log p + log N(r - b; μ, v); one that is not heard adds log(1 - p). The offset b ~ N(0, β²) of the phone is common to the
scan and integrated out in closed form: with S = Σ 1/v and R = Σ (r - μ)/v it adds ½ R² / (S + 1/β²) - ½ log(1 + S β²).
Everything is quadratic in r, so that scans (s, m) times tables (m, q) give all candidates at once.

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

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Candidates:
    """q places with tables of m access points; the tables are (m, q).

    Attributes:
        positions_xy: (q, 2).  precision: 1 / v.  pull: μ / v.  constant: terms without r of a heard access point.
        silence: (q,) log-probability of hearing nothing at all.  offset_sigma_db: β.
    """

    positions_xy: Array
    precision: Array
    pull: Array
    constant: Array
    silence: Array
    offset_sigma_db: float

    @staticmethod
    def of(field: Field, weights: Array, offset_sigma_db: float) -> Candidates:
        """The cells of a field; ``weights`` (m,) say how much each access point counts, 0 leaves it out."""
        places = field.cells.centre_xy
        at = field.predict(places)
        precision = weights / at.sigma_db**2
        silent = weights * np.log1p(-at.detection)
        heard = weights * (np.log(at.detection) - np.log(at.sigma_db))
        pull = precision * at.mean_dbm
        constant = heard - silent - 0.5 * pull * at.mean_dbm
        precision, pull, constant = (_table(one) for one in (precision, pull, constant))
        return Candidates(places, precision, pull, constant, silent.sum(axis=1), offset_sigma_db)

    def log_likelihood(self, scans_dbm: sparse.csr_array) -> Array:
        """(s, q) of scans (s, m), offsets integrated out."""
        heard, squares = scans_dbm.astype(np.float32), scans_dbm.astype(np.float32)
        squares.data = heard.data**2
        ones = sparse.csr_array((np.ones_like(heard.data), heard.indices, heard.indptr), shape=heard.shape)
        precision = ones @ self.precision
        pull = heard @ self.precision - ones @ self.pull
        fit = heard @ self.pull - 0.5 * (squares @ self.precision) + ones @ self.constant
        if self.offset_sigma_db > 0:
            fit += 0.5 * pull**2 / (precision + self.offset_sigma_db**-2)
            fit -= 0.5 * np.log1p(precision * self.offset_sigma_db**2)
        return np.asarray(fit + self.silence, dtype=np.float64)

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


def _table(values: Array) -> Array:
    """(q, m) as (m, q) in single precision, in the order in which products read it."""
    table: Array = np.ascontiguousarray(values.T, dtype=np.float32)
    return table
