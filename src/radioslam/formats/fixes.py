"""Latitudes and longitudes of a receiver -> reference positions in metres, as good as the receiver says."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam.formats.lines import Lines
from radioslam.formats.streams import make_reference
from radioslam.walk import Reference

Array = NDArray[np.float64]

WORST_ACCURACY_M = 50.0
"""Fixes that their receiver itself holds for worse tell nothing within a building."""
RADIUS_68_SIGMAS = float(np.sqrt(-2 * np.log(1 - 0.68)))
"""Radius that holds 68 % of a circular normal distribution, in standard deviations per axis."""


def geodetic_reference(
    lines: Lines,
    time_s: Array,
    latitude_deg: Array,
    longitude_deg: Array,
    notes: list[str],
    accuracy_m: Array | None = None,
) -> Reference | None:
    """Fixes in metres east and north of the earliest; their σ is the median of what the receiver says.

    Args:
        lines: where each fix stands, for messages.
        time_s: (n,).
        latitude_deg: (n,).
        longitude_deg: (n,).
        notes: is told of fixes that were left out.
        accuracy_m: (n,) radius that holds 68 %, NaN where unknown; None for surveyed positions.

    Raises:
        LogError: a latitude, longitude or time that cannot be.
    """
    check_coordinates(lines, latitude_deg, longitude_deg)
    sigma_m = None
    if accuracy_m is not None:
        good = ~((accuracy_m < 0) | (accuracy_m > WORST_ACCURACY_M))
        if not good.all():
            notes.append(f"{np.sum(~good)} fixes with an accuracy beyond {WORST_ACCURACY_M:g} m or none left out")
        lines, time_s, accuracy_m = lines.take(np.flatnonzero(good)), time_s[good], accuracy_m[good]
        latitude_deg, longitude_deg = latitude_deg[good], longitude_deg[good]
        told = accuracy_m[accuracy_m > 0]
        sigma_m = float(np.median(told)) / RADIUS_68_SIGMAS if len(told) else None
    if not len(lines):
        return None
    first = int(time_s.argmin())
    origin = (float(latitude_deg[first]), float(longitude_deg[first]))
    from pymap3d import geodetic2enu

    east, north, _ = geodetic2enu(latitude_deg, longitude_deg, 0.0, *origin, 0.0)
    return make_reference(lines, time_s, np.column_stack([east, north]), notes, origin, sigma_m)


def check_coordinates(lines: Lines, latitude_deg: Array, longitude_deg: Array) -> None:
    """Raise LogError unless all are latitudes and longitudes in degrees."""
    wrong = ~((np.abs(latitude_deg) <= 90) & (np.abs(longitude_deg) <= 180))
    if wrong.any():
        index = int(wrong.argmax())
        found = f"{latitude_deg[index]:g}, {longitude_deg[index]:g}"
        raise lines.error(index, "a latitude and longitude in degrees", found, "mend or remove the line")
