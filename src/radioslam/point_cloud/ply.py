"""PLY (ascii and binary) by ``plyfile``; the only file that knows it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ConfigError, LogError


def read_ply(path: Path) -> NDArray[np.float64]:
    """Points (n, 3) of the element ``vertex``.

    Raises:
        LogError: no PLY, cut off, or without x, y, z.
    """
    try:
        from plyfile import PlyData, PlyParseError
    except ImportError:
        raise ConfigError("PLY needs plyfile; install it with: pip install 'radioslam[pointcloud]'") from None
    try:
        vertex = PlyData.read(str(path))["vertex"]
        return np.column_stack([np.asarray(vertex[axis], dtype=float) for axis in "xyz"])
    except (PlyParseError, KeyError, ValueError, UnicodeDecodeError) as error:
        raise LogError(path, "a PLY file with vertices x, y, z", f"one that is broken ({error})") from None
