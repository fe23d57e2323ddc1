"""Metres of a map <-> latitude and longitude, by two or more known points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.errors import ResultError
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
KnownPoint = tuple[float, float, float, float]
Georeference = tuple[float, float, float]

WORST_RATIO = 0.2
"""Known points may disagree with the map by this part of their spread."""


def parse_point(text: str) -> KnownPoint:
    """``x,y,latitude,longitude``.

    Raises:
        ResultError: not four finite numbers, or no latitude and longitude.
    """
    try:
        x, y, latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise ResultError(f"expected a point X,Y,LAT,LON, found {text!r}") from None
    if not (np.isfinite([x, y]).all() and abs(latitude) <= 90 and abs(longitude) <= 180):
        raise ResultError(f"expected metres and degrees X,Y,LAT,LON, found {text!r}; latitude comes before longitude")
    return x, y, latitude, longitude


def georeferenced(radio_map: RadioMap, points: Sequence[KnownPoint]) -> RadioMap:
    """The map tied to latitude and longitude by ``fit_georeference``."""
    return replace(radio_map, georeference=fit_georeference(points))


def fit_georeference(points: Sequence[KnownPoint]) -> Georeference:
    """Where (0, 0) lies and the angle from east to the x axis, by the rigid motion that fits the points best.

    Raises:
        ResultError: fewer than two different points, or points that no rigid motion brings to their places.
    """
    from pymap3d import enu2geodetic, geodetic2enu

    table = np.array(points, dtype=float).reshape(-1, 4)
    if len(table) < 2 or not np.ptp(table[:, :2], axis=0).any():
        raise ResultError(f"expected two or more different known points, found {len(table)}; add --point X,Y,LAT,LON")
    latitude, longitude = table[0, 2:]
    east, north, _ = geodetic2enu(table[:, 2], table[:, 3], 0.0, latitude, longitude, 0.0)
    target = np.column_stack([east, north])
    pose = planar.align_rigid(table[:, :2], target)
    worst = float(np.hypot(*(planar.transform(pose, table[:, :2]) - target).T).max())
    if worst > WORST_RATIO * float(np.hypot(*np.ptp(table[:, :2], axis=0))) + 0.5:
        raise ResultError(f"expected points that fit the map, found one {worst:.0f} m off; check the order X,Y,LAT,LON")
    at = enu2geodetic(pose[0], pose[1], 0.0, latitude, longitude, 0.0)
    return float(at[0]), float(at[1]), float(pose[2])


def from_wgs84(georeference: Georeference, latitude_longitude: Array) -> Array:
    """Positions (n, 2) in a map's frame of latitudes and longitudes (n, 2) in degrees."""
    from pymap3d import geodetic2enu

    latitude, longitude, angle = georeference
    east, north, _ = geodetic2enu(*latitude_longitude.T, 0.0, latitude, longitude, 0.0)
    return planar.rotate(-angle, np.column_stack([east, north]))


def to_wgs84(radio_map: RadioMap, positions_xy: Array) -> Array:
    """Latitude and longitude (n, 2) in degrees of positions (n, 2) of a georeferenced map.

    Raises:
        ResultError: the map is not georeferenced.
    """
    if radio_map.georeference is None:
        raise ResultError("expected a georeferenced map, found none; use radioslam georeference")
    return frame_to_wgs84(radio_map.georeference, positions_xy)


def frame_to_wgs84(georeference: Georeference, positions_xy: Array) -> Array:
    """Latitude and longitude (n, 2) in degrees of positions (n, 2) in a frame that is tied so."""
    from pymap3d import enu2geodetic

    latitude, longitude, angle = georeference
    east, north = planar.rotate(angle, positions_xy).T
    lat, lon, _ = enu2geodetic(east, north, 0.0, latitude, longitude, 0.0)
    return np.column_stack([lat, lon])
