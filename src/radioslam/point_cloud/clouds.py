"""Point clouds from files: PLY, PCD, or a depth image; checked once, so that what follows need not ask again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.point_cloud.depth import DEPTH_ENDING, read_depth_cloud
from radioslam.point_cloud.pcd import read_pcd
from radioslam.point_cloud.ply import read_ply

Array = NDArray[np.float64]

FEWEST_POINTS = 100
FLAT_M = 1e-4
"""Real surfaces and sensors are rougher than this; a cloud thinner is a plane or a line."""
FARTHEST_MEDIAN_M = 200.0
"""No depth sensor sees so far on average: such numbers are millimetres."""

READERS: dict[str, Callable[[Path], Array]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    DEPTH_ENDING: read_depth_cloud,
}


def is_cloud(path: Path) -> bool:
    """Whether a file is a point cloud by its name."""
    return path.name.endswith(tuple(READERS))


def read_cloud(path: Path, metres_per_unit: float = 1.0) -> Array:
    """Points (n, 3) in the sensor's frame.

    Raises:
        LogError: the file cannot be read, or holds a number that is not finite.
    """
    for ending, read in READERS.items():
        if path.name.endswith(ending):
            points = read(path) * metres_per_unit
            break
    else:
        raise LogError(path, f"a point cloud ({', '.join(READERS)})", f"{path.suffix or 'no ending'}")
    bad = int(np.sum(~np.isfinite(points).all(axis=1)))
    if bad:
        raise LogError(path, "finite points", f"{bad} of {len(points)} with NaN or infinity", "remove them")
    return points


def check_cloud(points: Array, path: Path) -> Array:
    """The points (n, 3), if they can be registered at all.

    Raises:
        LogError: there are too few, or all lie on a plane or a line.
    """
    if len(points) < FEWEST_POINTS:
        found = f"{len(points)} points" if len(points) else "an empty cloud"
        raise LogError(path, f"at least {FEWEST_POINTS} points", found)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
    if spread[2] < FLAT_M:
        found = "all of them on a line" if spread[1] < FLAT_M else "all of them on a plane"
        raise LogError(path, "points of a surface with depth", found, "a flat cloud slides and cannot be registered")
    return points


def unit_warning(points: Array, path: Path) -> str | None:
    """What to say if the numbers look like millimetres."""
    median = float(np.median(np.linalg.norm(points, axis=1))) if len(points) else 0.0
    if median <= FARTHEST_MEDIAN_M:
        return None
    return f"{path}: points lie {median:.0f} m from the sensor in the median, as if in millimetres; try --unit 0.001"
