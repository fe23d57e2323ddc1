"""How far apart are two scans of similarity s? Learned from short-term odometry (section III-D).

Odometry is good over short distances, so pairs of scans of one walk, less than 30 m apart along it, are samples
(s_k, d_k) that need no survey. The variance is

    var(s) = (1/c) Σ d_k²    over the c samples with |s_k - s| ≤ b/2,

kept as a look-up table over s; ``per_axis`` halves it, because d² is the sum of two axes' squares.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import UncertaintyConfig
from radioslam.errors import MappingError, ResultError
from radioslam.fingerprints import Fingerprints
from radioslam.similarity import pair_similarity

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

TABLE_STEP = 0.01


@dataclass(frozen=True)
class UncertaintyModel:
    """Look-up table similarity -> variance.

    Attributes:
        similarity: (n,) from 0 to 1 in steps of 0.01.
        variance_m2: (n,) var(s), finite and positive everywhere.
        sample_count: (n,) samples behind each entry; 0 where the entry comes from its neighbours.
    """

    similarity: Array
    variance_m2: Array
    sample_count: NDArray[np.int64]

    def variance(self, similarity: Array) -> Array:
        """var(s) in m², shape of ``similarity``, linear between the entries."""
        return np.interp(similarity, self.similarity, self.variance_m2)

    def sigma(self, similarity: Array) -> Array:
        """Standard deviation in m, shape of ``similarity``."""
        return np.sqrt(self.variance(similarity))

    def save(self, path: Path) -> None:
        """Write the table as JSON."""
        columns = {name: getattr(self, name).tolist() for name in self.__dataclass_fields__}
        path.write_text(json.dumps(columns), "utf-8")

    @staticmethod
    def load(path: Path) -> UncertaintyModel:
        """Read a table that ``save`` wrote.

        Raises:
            ResultError: not such a file.
        """
        try:
            columns = json.loads(path.read_text("utf-8"))
            model = UncertaintyModel(
                np.array(columns["similarity"], dtype=float),
                np.array(columns["variance_m2"], dtype=float),
                np.array(columns["sample_count"], dtype=np.int64),
            )
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ResultError(f"{path}: expected an uncertainty model (JSON), found: {error}") from None
        shapes = {model.similarity.shape, model.variance_m2.shape, model.sample_count.shape}
        if (
            shapes != {(model.similarity.size,)}
            or not model.similarity.size
            or not np.all(np.diff(model.similarity, prepend=-np.inf) > 0)
        ):
            raise ResultError(f"{path}: expected three columns of one length over increasing similarity, found others")
        if not (np.isfinite(model.variance_m2).all() and np.all(model.variance_m2 > 0)):
            raise ResultError(f"{path}: expected positive finite variances, found others")
        return model


def learn_from_samples(similarity: Array, distance_m: Array, config: UncertaintyConfig) -> UncertaintyModel:
    """Bin samples (s_k, d_k), both (n_samples,), into the table.

    Entries with fewer than ``min_samples`` samples are empty: they are interpolated linearly between their filled
    neighbours and extended flat at the ends. No entry falls below ``min_sigma_m`` squared.

    Raises:
        MappingError: no entry could be filled.
    """
    grid = np.round(np.arange(0.0, 1.0 + TABLE_STEP / 2, TABLE_STEP), 10)
    order = np.argsort(similarity)
    s, squares = similarity[order], np.concatenate([[0.0], np.cumsum(distance_m[order] ** 2)])
    first = np.searchsorted(s, grid - config.bin_width / 2 - 1e-12, side="left")
    last = np.searchsorted(s, grid + config.bin_width / 2 + 1e-12, side="right")
    count = last - first
    filled = count >= config.min_samples
    if not filled.any():
        raise MappingError(
            f"expected at least {config.min_samples} pairs of scans of one walk with common access points within "
            f"{config.max_distance_m:g} m, found {len(s)}; record longer walks or lower fingerprints.rss_threshold_dbm"
        )
    mean_square = (squares[last] - squares[first])[filled] / count[filled] / (2 if config.per_axis else 1)
    variance = np.interp(grid, grid[filled], mean_square)
    return UncertaintyModel(
        grid, np.maximum(variance, config.min_sigma_m**2), np.where(filled, count, 0).astype(np.int64)
    )


def learn_uncertainty(
    fingerprints: Fingerprints, strengths: sparse.csr_array, config: UncertaintyConfig
) -> UncertaintyModel:
    """Learn var(s) from all pairs of one walk that lie less than ``max_distance_m`` apart along it."""
    i, j = pairs_along_walks(fingerprints, config.max_distance_m)
    heard = np.diff(strengths.indptr) > 0
    both = heard[i] & heard[j]
    i, j = i[both], j[both]
    offset = fingerprints.poses[i, :2] - fingerprints.poses[j, :2]
    return learn_from_samples(pair_similarity(strengths, i, j), np.hypot(*offset.T), config)


def pairs_along_walks(fingerprints: Fingerprints, max_distance_m: float) -> tuple[Integers, Integers]:
    """Indices i < j, (n_pairs,) each, of all pairs of one walk less than so many metres apart along it."""
    # A step between walks that no pair can bridge makes one sorted axis of all walks.
    stride = float(fingerprints.distance_m.max(initial=0.0)) + 2 * max_distance_m
    along = fingerprints.distance_m + stride * fingerprints.walk
    end = np.searchsorted(along, along + max_distance_m, side="left")
    count = end - np.arange(len(along)) - 1
    i = np.repeat(np.arange(len(along)), count)
    j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count)
    return i, j
