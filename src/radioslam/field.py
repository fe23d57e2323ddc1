"""The field: mean strength, its deviation and the probability of being heard, for every access point, anywhere.

Gaussian process regression (Rasmussen & Williams 2006, chapter 2) on cells of the sampled places. All access points
share one kernel and one noise, so that one Cholesky factor serves them all and they are its right-hand sides:

    K = C(X, X) + diag((λ + 2 σ / ℓ) / n),   C(a, b) = exp(-‖a - b‖ / ℓ),   μ(x) = floor + C(x, X) K⁻¹ y

with n samples in a cell. A position known to σ only blurs what is measured there (McHutchon & Rasmussen 2011): under C
the strengths of two places σ apart differ by a variance of 2 σ / ℓ. What was not heard is censored at the
detection limit: it enters with its expectation below the limit under the field itself, found by a few sweeps with the
same factor. ℓ and λ maximize the marginal likelihood summed over access points, their amplitudes eliminated.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist
from scipy.special import log_ndtr

from radioslam.config import FieldConfig
from radioslam.errors import MappingError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

LENGTHS_M = (6.0, 12.0, 25.0, 50.0)
NOISES = (0.1, 0.3, 1.0, 3.0)
LEARNING_CELLS = 400


@dataclass(frozen=True)
class Prediction:
    """At q places for m access points.

    Attributes:
        mean_dbm: (q, m) expected strength where it is heard.  sigma_db: (q, m) its standard deviation.
        detection: (q, m) probability that a scan hears it.
    """

    mean_dbm: Array
    sigma_db: Array
    detection: Array


class StrengthMap(Protocol):
    """What both forms of a radio map answer: the annotated samples (nearest ones) and the field."""

    def predict(self, positions_xy: Array, columns: Integers | None = None) -> Prediction:
        """Strengths at positions (q, 2) of the access points ``columns`` (m,), default all."""
        ...


@dataclass(frozen=True)
class Cells:
    """Samples condensed on a grid: ``centre_xy`` (c, 2) mean position, ``count`` (c,), ``sigma_m`` (c,), and
    ``average`` (c, n) CSR, the matrix that averages samples.
    """

    centre_xy: Array
    count: Array
    sigma_m: Array
    average: sparse.csr_array


@dataclass(frozen=True)
class Field:
    """A learned field of m access points over c cells.

    Attributes:
        cells: where it was sampled.  length_m: ℓ.  noise: λ.  floor_dbm: the mean far from everything.
        weights: (c, 2 m) K⁻¹ y of strengths above the floor and of detections.
        factor: Cholesky factor of K.  signal_variance: (m,) dB².  residual_variance: (m,) dB² of single readings.
    """

    cells: Cells
    length_m: float
    noise: float
    floor_dbm: float
    weights: Array
    factor: tuple[Array, bool]
    signal_variance: Array
    residual_variance: Array

    def predict(self, positions_xy: Array, columns: Integers | None = None) -> Prediction:
        """Strengths at positions (q, 2) of the access points ``columns`` (m,), default all."""
        m = len(self.signal_variance)
        chosen = np.arange(m) if columns is None else columns
        near = kernel(positions_xy, self.cells.centre_xy, self.length_m)
        unexplained = np.clip(1.0 - np.einsum("qc,cq->q", near, cho_solve(self.factor, near.T)), 0.0, 1.0)
        variance = np.outer(unexplained, self.signal_variance[chosen]) + self.residual_variance[chosen]
        return Prediction(
            mean_dbm=self.floor_dbm + near @ self.weights[:, chosen],
            sigma_db=np.sqrt(variance),
            detection=np.clip(near @ self.weights[:, m + chosen], 0.01, 0.99),
        )


def build_field(
    positions_xy: Array,
    sigma_m: Array,
    rss_dbm: sparse.csr_array,
    config: FieldConfig,
    learned: tuple[float, float] | None = None,
) -> Field:
    """Learn the field of samples at positions (n, 2), known to ``sigma_m`` (n,) per axis, from strengths (n, m).

    ``learned`` are ℓ and λ where they are known already.

    Raises:
        MappingError: nothing was heard.
    """
    if not rss_dbm.nnz:
        raise MappingError("expected samples that heard access points, found none; map walks with WiFi scans")
    limit_dbm = float(rss_dbm.data.min())
    cells = condense(positions_xy, sigma_m, config.cell_m, config.max_cells)
    heard = _ones(rss_dbm)
    detection = (cells.average @ heard).toarray()
    strength = (cells.average @ rss_dbm).toarray()  # sums over what was heard, divided by all samples of the cell
    floor_dbm = limit_dbm - config.floor_below_db
    excess = strength - detection * floor_dbm
    length_m, noise = learned or learn_kernel(cells, excess)
    factor, spread = _factor(cells, length_m, noise)
    excess = _impute(factor, spread, excess, detection, limit_dbm - floor_dbm, config.sweeps)
    weights = cho_solve(factor, np.hstack([excess, detection]))
    ours = weights[:, : excess.shape[1]]
    signal = np.maximum(np.sum(excess * ours, axis=0) / len(excess), 1.0)
    fitted_dbm = floor_dbm + excess - spread[:, None] * ours
    residual = _residual_variance(cells, fitted_dbm, rss_dbm, config.min_sigma_db)
    return Field(cells, length_m, noise, floor_dbm, weights, factor, signal, residual)


def kernel(a_xy: Array, b_xy: Array, length_m: float) -> Array:
    """C (a, b) between places (a, 2) and (b, 2): continuous, not smooth, as strengths behind walls are."""
    return np.exp(-cdist(a_xy, b_xy) / length_m)


def condense(positions_xy: Array, sigma_m: Array, cell_m: float, max_cells: int) -> Cells:
    """Average the samples (n, 2) of each square of ``cell_m``, in wider squares while these are too many."""
    while True:
        squares = np.unique(np.floor(positions_xy / cell_m), axis=0, return_inverse=True)[1].ravel()
        count = np.bincount(squares).astype(float)
        if len(count) <= max_cells:
            break
        cell_m *= 1.25
    n = len(positions_xy)
    average = sparse.csr_array((1 / count[squares], (squares, np.arange(n))), shape=(len(count), n))
    return Cells(average @ positions_xy, count, average @ np.nan_to_num(sigma_m), average)


def learn_kernel(cells: Cells, excess: Array) -> tuple[float, float]:
    """ℓ (m) and λ of the greatest marginal likelihood, summed over access points with amplitudes profiled out.

    For one: -½ n log(yᵀ K⁻¹ y / n) - ½ log |K|  (Rasmussen & Williams, 5.8); on a few hundred cells at most.
    """
    rows = np.linspace(0, len(cells.count) - 1, min(len(cells.count), LEARNING_CELLS)).astype(int)
    few = Cells(cells.centre_xy[rows], cells.count[rows], cells.sigma_m[rows], cells.average)
    y = excess[rows]
    y = y[:, np.any(y != 0, axis=0)]
    return max(itertools.product(LENGTHS_M, NOISES), key=lambda pair: _evidence(few, y, *pair))


def _evidence(cells: Cells, y: Array, length_m: float, noise: float) -> float:
    factor, _ = _factor(cells, length_m, noise)
    quadratic = np.sum(y * cho_solve(factor, y), axis=0) / len(y)
    half_determinant = np.sum(np.log(np.diag(factor[0])))
    return float(-0.5 * len(y) * np.sum(np.log(quadratic)) - y.shape[1] * half_determinant)


def _factor(cells: Cells, length_m: float, noise: float) -> tuple[tuple[Array, bool], Array]:
    """Cholesky factor of K, and its noise (c,). The fit at the cells is C K⁻¹ y = y - noise · K⁻¹ y."""
    blur = 2 * cells.sigma_m / length_m
    spread = (noise + blur) / cells.count + 1e-6
    covariance = kernel(cells.centre_xy, cells.centre_xy, length_m) + np.diag(spread)
    return cho_factor(covariance, lower=True), spread


def _impute(
    factor: tuple[Array, bool], spread: Array, heard: Array, detection: Array, limit: float, sweeps: int
) -> Array:
    """Give what was not heard E[y | y < limit] under the field, (c, m), as in a Tobit model; ``heard`` is the rest."""
    filled = heard
    for _ in range(sweeps):
        mean = filled - spread[:, None] * cho_solve(factor, filled)
        sigma = max(float(np.std((filled - mean)[detection > 0])), 1.0)
        standing = np.minimum((limit - mean) / sigma, 6.0)
        hazard = np.exp(-0.5 * standing**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(standing))
        filled = heard + (1.0 - detection) * np.clip(mean - sigma * hazard, 0.0, limit)
    return filled


def _residual_variance(cells: Cells, fitted_dbm: Array, rss_dbm: sparse.csr_array, min_sigma_db: float) -> Array:
    """(m,) mean square of reading minus field (c, m) over an access point's readings, shrunk towards that of all."""
    m = rss_dbm.shape[1]
    entries = rss_dbm.tocoo()
    cell_of_sample = np.empty(rss_dbm.shape[0], np.int64)
    cell_of_sample[cells.average.indices] = np.repeat(np.arange(len(cells.count)), np.diff(cells.average.indptr))
    residual = entries.data - fitted_dbm[cell_of_sample[entries.row], entries.col]
    count = np.bincount(entries.col, minlength=m)
    total = np.bincount(entries.col, residual**2, minlength=m)
    return np.maximum((total + 10 * np.mean(residual**2)) / (count + 10), min_sigma_db**2)


def _ones(matrix: sparse.csr_array) -> sparse.csr_array:
    return sparse.csr_array((np.ones_like(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
