"""A radio map on a grid: where it is good, which access point is strongest, where to walk next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from radioslam.annotated_samples import AnnotatedSamples
from radioslam.config import FieldConfig
from radioslam.errors import ConfigError
from radioslam.field import StrengthMap, build_field
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Form = Literal["samples", "field"]

REACH_M = 8.0
"""The grid goes so far from where people walked."""
HEARD = 0.5
"""Where at least so many scans hear an access point, it counts as heard."""


@dataclass(frozen=True)
class Coverage:
    """On a grid of q places within reach of the walks: ``positions_xy`` (q, 2), ``mean_dbm`` (q, m), ``detection``
    (q, m), ``strongest`` (q,) column or -1 where none is heard, and ``uncertainty`` (q,) the median σ in dB.
    """

    positions_xy: Array
    mean_dbm: Array
    detection: Array
    strongest: Integers
    uncertainty: Array


def checked_form(name: str) -> Form:
    """The form of this name.

    Raises:
        ConfigError: there is none.
    """
    if name not in ("samples", "field"):
        raise ConfigError(f"unknown form {name!r}; expected samples or field")
    return "samples" if name == "samples" else "field"


def strength_map(samples: RadioMap, form: Form = "field") -> StrengthMap:
    """A map's samples in one of its two forms: themselves, annotated (the paper's), or the field learned from them.

    Raises:
        MappingError: nothing was heard.
    """
    if form == "samples":
        return AnnotatedSamples(samples.poses[:, :2], samples.rss_dbm)
    return build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, FieldConfig())


def grid(positions_xy: Array, step_m: float, reach_m: float = REACH_M) -> Array:
    """Places (q, 2) of a square grid within ``reach_m`` of positions (n, 2)."""
    low, high = positions_xy.min(axis=0) - reach_m, positions_xy.max(axis=0) + reach_m
    axes = [np.arange(a, b + step_m, step_m) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return places[cKDTree(positions_xy).query(places)[0] <= reach_m]


def cover(samples: RadioMap, step_m: float = 2.0, columns: Integers | None = None, form: Form = "field") -> Coverage:
    """Some access points, default all, of one floor on a grid of ``step_m``."""
    places = grid(samples.poses[:, :2], step_m)
    at = strength_map(samples, form).predict(places, columns)
    heard = np.where(at.detection >= HEARD, at.mean_dbm, -np.inf)
    strongest = np.where(np.isfinite(heard.max(axis=1)), heard.argmax(axis=1), -1)
    return Coverage(places, at.mean_dbm, at.detection, strongest, np.median(at.sigma_db, axis=1))


def walk_next(samples: RadioMap, count: int = 10) -> list[tuple[float, float, float]]:
    """Places (x, y, σ in dB) of one floor where the map knows least, at least ``REACH_M`` apart, the worst first."""
    coverage = cover(samples, step_m=2.0)
    chosen: list[tuple[float, float, float]] = []
    for k in np.argsort(-coverage.uncertainty, kind="stable"):
        x, y = coverage.positions_xy[k]
        if all(np.hypot(x - a, y - b) >= REACH_M for a, b, _ in chosen):
            chosen.append((float(x), float(y), float(coverage.uncertainty[k])))
        if len(chosen) == count:
            break
    return chosen
