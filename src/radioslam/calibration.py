"""What the walks of a map, left out of it in turn, teach about positioning in it: how sure to be, and what is foreign.

Errors are distances to the map's own positions; no reference is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.config import Config
from radioslam.field import Field, build_field
from radioslam.likelihood import Candidates
from radioslam.neighbours import Neighbours
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]

TEMPERATURES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
COVERAGE = 0.95
SHARES = 4
"""Groups of scans, by how like the map they are, that have a radius of their own."""
NOT_HERE_QUANTILE = 0.01
"""Share of the map's own held-out scans that may be called foreign."""
UNUSUAL_QUANTILE = 0.05
"""Share of them that are less like the map than half of a walk's scans may be."""


@dataclass(frozen=True)
class Calibration:
    """What walks that were left out taught.

    Attributes:
        temperature: τ.  similarities: (b - 1,) that part held-out scans into b equal shares, by the likest sample.
        radius_per_sigma: (b,) metres of radius per metre of σ in each share: a scan that is like no sample was made in
        a gap of the map, and errs more than it knows.  sigma_floor_m: added to σ.
        least_similarity: below it a scan is not here.  usual_similarity: most scans of a walk that is here reach it.
        coverage: share of held-out scans inside the radius.
    """

    temperature: float
    similarities: Array
    radius_per_sigma: Array
    sigma_floor_m: float
    least_similarity: float
    usual_similarity: float
    coverage: float


def learn_models(
    samples: RadioMap, weights: Array, config: Config, learned: tuple[float, float] | None = None
) -> tuple[Field, Candidates, Neighbours]:
    """What a floor's scans are compared with; ``learned`` are ℓ and λ of the field where they are known already."""
    field = build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, config.field, learned)
    candidates = Candidates.of(field, weights, config.positioning.offset_sigma_db)
    return field, candidates, Neighbours.of(samples.poses[:, :2], samples.rss_dbm)


def calibrate(samples: RadioMap, weights: Array, config: Config, learned: tuple[float, float]) -> Calibration:
    """Leave groups of walks out, locate their scans in the map of the rest, and learn what to promise.

    Errors are distances to the map's own positions, no reference is used; a map of one walk is split in time instead.
    """
    folds = config.positioning.folds
    walk = np.unique(samples.walk, return_inverse=True)[1]
    fold = walk % folds if walk.max() > 0 else np.arange(len(samples)) * folds // len(samples)
    errors, sigmas, closest = [], [], []
    for k in np.unique(fold):
        rest, held = samples.select(fold != k), samples.select(fold == k)
        _, candidates, neighbours = learn_models(rest, weights, config, learned)
        closest.append(neighbours.similarity(held.rss_dbm, np.zeros(len(held))).max(axis=1))
        fits = candidates.log_likelihood(held.rss_dbm) / np.sqrt(np.maximum(np.diff(held.rss_dbm.indptr), 1))[:, None]
        moments = [candidates.moments(temperature * fits) for temperature in TEMPERATURES]
        errors.append([np.hypot(*(mean - held.poses[:, :2]).T) for mean, _ in moments])
        sigmas.append([np.hypot(*sigma.T) for _, sigma in moments])
    error, sigma, likeness = np.concatenate(errors, axis=1), np.concatenate(sigmas, axis=1), np.concatenate(closest)
    best = int(error.mean(axis=1).argmin())
    floor_m = float(np.median(error[best]))
    ratio = error[best] / np.hypot(sigma[best], floor_m)
    similarities = np.quantile(likeness, np.arange(1, SHARES) / SHARES)
    share = np.digitize(likeness, similarities)
    everywhere = np.quantile(ratio, COVERAGE)  # for a share that is empty, where many scans are equally similar
    scale = np.array([np.quantile(ratio[share == k], COVERAGE) if k in share else everywhere for k in range(SHARES)])
    return Calibration(
        temperature=TEMPERATURES[best],
        similarities=similarities,
        radius_per_sigma=scale,
        sigma_floor_m=floor_m,
        least_similarity=float(np.quantile(likeness, NOT_HERE_QUANTILE)),
        usual_similarity=float(np.quantile(likeness, UNUSUAL_QUANTILE)),
        coverage=float(np.mean(ratio <= scale[share])),
    )
