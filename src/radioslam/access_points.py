"""Where each access point stands, with its uncertainty, or why the data do not tell.

The log-distance law (Rappaport 2002, section 4.9) over the places where it was heard,

    r_i = P - 10 n log10(√(‖x_i - a‖² + h²)) + ε_i,   ε_i ~ N(0, s²),   P ~ N(P₀, σ_P²),   n ~ N(n₀, σ_n²),

with the readings of each square averaged into one r_i, since neighbouring readings share their shadowing. It is linear
in P and n, which are integrated out in closed form at every candidate position a of a grid (Bishop 2006, section 3.5):

    log p(r | a) = -½ (ω rᵀr / s² - bᵀ A⁻¹ b) - ½ log |A| - ω k log s,   A = Λ + ω XᵀX / s²,   b = ω Xᵀr / s²,

r without its prior mean, Λ the prior precision; s is summed over a few values, and ω is the evidence in one square,
whose neighbours share its shadowing. Mean and deviation over the grid are the answer; the deviation of the samples' own
positions is added.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from scipy.special import logsumexp

from radioslam.map_health import find_unhealthy
from radioslam.radio_map import RadioMap
from radioslam.whole_files import whole_file

Array = NDArray[np.float64]

SQUARE_M = 4.0
"""About how far shadowing reaches indoors."""
HEIGHT_M = 1.5
"""h: of a ceiling above a hand."""
POWER_DBM, POWER_SIGMA_DB = -38.0, 10.0
"""P₀, the strength a metre away, and its deviation over transmitters and phones."""
EXPONENT, EXPONENT_SIGMA = 3.0, 1.0
"""n₀ indoors, and its deviation over buildings."""
EVIDENCE = 0.7
"""ω; between 0.4, the effective count where shadowing falls to 1/e in 5 m along a path, and 1 of independent squares:
so that nine of ten lie within their 95 % (simulated offices and towers, seeds 1-3)."""
SHADOWING_DB = (3.0, 4.5, 6.5, 9.0)
"""s."""
GRID_M = 2.0
REACH_M = 24.0
"""Candidates lie so far from where people walked."""
LEAST_PLACES = 5
MOST_PLACES = 80
"""The strongest of them tell the most."""
OUTSIDE_SHARE = 0.2
"""With so much probability at the rim of the candidates it stands beyond them."""
MAX_SIGMA_M = 12.0
"""A vaguer position is none."""


COLUMNS = ("bssid", "floor", "samples", "strongest_dbm", "x_m", "y_m", "sigma_m", "health", "position")


@dataclass(frozen=True)
class AccessPoint:
    """What a map knows of one access point.

    Attributes:
        transmitter: its identity.  floor: of the samples, "" where floors have no names.
        samples: that heard it.  strongest_dbm: the strongest reading.
        position_xy: (x, y) in the map's frame, None where the data do not tell.  sigma_m: its standard deviation per
            axis.  reason: why there is no position, else "".
    """

    transmitter: str
    floor: str
    samples: int
    strongest_dbm: float
    position_xy: tuple[float, float] | None
    sigma_m: float
    reason: str


def access_points(samples: RadioMap) -> tuple[AccessPoint, ...]:
    """Every access point of the largest map that was heard, floor by floor and in the order of the names."""
    return tuple(point for floor, part in samples.by_floor() for point in _of_floor(floor, part))


def _of_floor(floor: str, samples: RadioMap) -> Iterator[AccessPoint]:
    square = np.unique(np.floor(samples.poses[:, :2] / SQUARE_M), axis=0, return_inverse=True)[1].ravel()
    places = _mean_by(square, samples.poses[:, :2])
    candidates, rim = _candidates(places)
    log_distance = -5 * np.log10(cdist(places, candidates, "sqeuclidean") + HEIGHT_M**2)
    blur_m = float(np.median(np.nan_to_num(samples.sigma_m)))
    columns = samples.rss_dbm.tocsc()
    for k in np.flatnonzero(np.diff(columns.indptr)):
        part = slice(columns.indptr[k], columns.indptr[k + 1])
        rss = columns.data[part]
        heard, of_reading = np.unique(square[columns.indices[part]], return_inverse=True)
        position: tuple[float, float] | None = None
        sigma_m, reason = np.nan, f"heard in {len(heard)} of {LEAST_PLACES} places that are needed"
        if len(heard) >= LEAST_PLACES:
            mean = _mean_by(of_reading, rss[:, None])[:, 0]
            chosen = np.sort(np.argsort(-mean, kind="stable")[:MOST_PLACES])
            log_posterior = log_evidence(log_distance[heard[chosen]], mean[chosen])
            position, sigma_m, reason = _place(candidates, rim, log_posterior, blur_m)
        yield AccessPoint(samples.transmitters[k], floor, len(rss), float(rss.max()), position, sigma_m, reason)


def _mean_by(group: NDArray[np.int64], values: Array) -> Array:
    """(g, d) means of values (n, d) by group (n,)."""
    n = len(group)
    count = np.bincount(group)
    mean: Array = sparse.csr_array((1 / count[group], (group, np.arange(n))), shape=(len(count), n)) @ values
    return mean


def _candidates(places_xy: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Positions (q, 2) of a grid around the places, and which of them (q,) are its rim."""
    low, high = places_xy.min(axis=0) - REACH_M, places_xy.max(axis=0) + REACH_M
    axes = [np.arange(a, b + GRID_M, GRID_M) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    away = cKDTree(places_xy).query(grid)[0]
    return grid[away <= REACH_M], away[away <= REACH_M] > REACH_M - 2 * GRID_M


def log_evidence(log_distance: Array, rss_dbm: Array) -> Array:
    """log p(r | a) (q,) up to a constant, of mean strengths (k,) and ``log_distance`` (k, q): -10 log10 of metres."""
    k, above = len(rss_dbm), rss_dbm - POWER_DBM
    sums, products = np.stack([np.ones(k), above]) @ log_distance
    moments = (sums, np.einsum("kq,kq->q", log_distance, log_distance))
    pulls = (above.sum() - EXPONENT * sums, products - EXPONENT * moments[1])
    squares = above @ above - 2 * EXPONENT * products + EXPONENT**2 * moments[1]
    evidence = []
    for s in SHADOWING_DB:
        w = EVIDENCE / s**2
        a, c, d = POWER_SIGMA_DB**-2 + w * k, w * moments[0], EXPONENT_SIGMA**-2 + w * moments[1]
        b = [w * pull for pull in pulls]
        determinant = a * d - c**2
        explained = (d * b[0] ** 2 - 2 * c * b[0] * b[1] + a * b[1] ** 2) / determinant
        evidence.append(-0.5 * (w * squares - explained + np.log(determinant)) - EVIDENCE * k * np.log(s))
    return np.asarray(logsumexp(evidence, axis=0))


def _place(
    candidates: Array, rim: NDArray[np.bool_], log_posterior: Array, blur_m: float
) -> tuple[tuple[float, float] | None, float, str]:
    """Position, deviation per axis and reason of none."""
    weight = np.exp(log_posterior - logsumexp(log_posterior))
    x, y = weight @ candidates
    spread = weight @ np.sum((candidates - [x, y]) ** 2, axis=1) / 2
    sigma_m = float(np.sqrt(spread + GRID_M**2 / 12 + blur_m**2))
    if weight[rim].sum() > OUTSIDE_SHARE:
        return None, np.nan, "outside the walked area"
    if sigma_m > MAX_SIGMA_M:
        return None, np.nan, f"known to {sigma_m:.0f} m only"
    return (float(x), float(y)), sigma_m, ""


def as_rows(samples: RadioMap) -> list[dict[str, str]]:
    """The access points of a map as rows of ``COLUMNS``, most samples first: position and health, or what is wrong."""
    health = {finding.transmitter: f"{finding.kind}: {finding.reason}" for finding in find_unhealthy(samples)}
    rows = []
    for point in sorted(access_points(samples), key=lambda point: -point.samples):
        x, y = point.position_xy or (None, None)
        numbers = (x, y, None if x is None else point.sigma_m)
        texts = ("" if number is None else f"{number:.1f}" for number in numbers)
        head = (point.transmitter, point.floor, f"{point.samples}", f"{point.strongest_dbm:.0f}")
        tail = (health.get(point.transmitter, "good"), point.reason or "found")
        rows.append(dict(zip(COLUMNS, (*head, *texts, *tail), strict=True)))
    return rows


def write_csv(rows: Sequence[Mapping[str, str]], path: Path) -> None:
    """Write what ``as_rows`` gives, whole or not at all."""
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
