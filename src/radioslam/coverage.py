"""The field on a grid: where the map is good, which access point is strongest, where they stand, where to walk next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from radioslam.config import FieldConfig
from radioslam.field import Field, build_field
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

REACH_M = 8.0
"""The grid goes so far from where people walked."""
STRONG_DBM = -65.0


@dataclass(frozen=True)
class Coverage:
    """On a grid of q places within reach of the walks: ``positions_xy`` (q, 2), ``mean_dbm`` (q, m), ``detection``
    (q, m), ``strongest`` (q,) column, and ``uncertainty`` (q,) the median σ (dB) of the field.
    """

    positions_xy: Array
    mean_dbm: Array
    detection: Array
    strongest: Integers
    uncertainty: Array


def field_of(samples: RadioMap, config: FieldConfig | None = None) -> Field:
    """The field of a map's samples."""
    return build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, config or FieldConfig())


def grid(positions_xy: Array, step_m: float, reach_m: float = REACH_M) -> Array:
    """Places (q, 2) of a square grid within ``reach_m`` of positions (n, 2)."""
    low, high = positions_xy.min(axis=0) - reach_m, positions_xy.max(axis=0) + reach_m
    axes = [np.arange(a, b + step_m, step_m) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return places[cKDTree(positions_xy).query(places)[0] <= reach_m]


def cover(samples: RadioMap, step_m: float = 2.0, columns: Integers | None = None) -> Coverage:
    """The field of some access points, default all, on a grid of ``step_m``."""
    places = grid(samples.poses[:, :2], step_m)
    at = field_of(samples).predict(places, columns)
    heard = np.where(at.detection >= 0.5, at.mean_dbm, -np.inf)
    return Coverage(places, at.mean_dbm, at.detection, heard.argmax(axis=1), np.median(at.sigma_db, axis=1))


def walk_next(samples: RadioMap, count: int = 10) -> list[tuple[float, float, float]]:
    """Places (x, y, σ in dB) where the map knows least, at least ``REACH_M`` apart, the worst first."""
    coverage = cover(samples, step_m=2.0)
    chosen: list[tuple[float, float, float]] = []
    for k in np.argsort(-coverage.uncertainty, kind="stable"):
        x, y = coverage.positions_xy[k]
        if all(np.hypot(x - a, y - b) >= REACH_M for a, b, _ in chosen):
            chosen.append((float(x), float(y), float(coverage.uncertainty[k])))
        if len(chosen) == count:
            break
    return chosen


def access_point_positions(samples: RadioMap) -> dict[str, tuple[float, float, float]]:
    """x, y and spread (m) of access points by the centroid of strong readings, weighted by received power.

    Only those with three strong readings of two walks; others would be a guess.
    """
    columns = samples.rss_dbm.tocsc()
    found = {}
    for k, name in enumerate(samples.transmitters):
        part = slice(columns.indptr[k], columns.indptr[k + 1])
        rows, rss = columns.indices[part], columns.data[part]
        strong = rss >= STRONG_DBM
        if strong.sum() < 3 or len(np.unique(samples.walk[rows[strong]])) < 2:
            continue
        weight = 10 ** (rss[strong] / 20)
        xy = samples.poses[rows[strong], :2]
        centre = weight @ xy / weight.sum()
        spread = np.sqrt(weight @ np.sum((xy - centre) ** 2, axis=1) / weight.sum())
        found[name] = (float(centre[0]), float(centre[1]), float(spread))
    return found
