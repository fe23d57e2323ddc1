"""Depth images: 16-bit PNG in millimetres beside the camera's intrinsics; the only file that knows Pillow.

A pixel (u, v) of depth z lies at z K⁻¹ (u, v, 1)ᵀ in the camera's frame: x right, y down, z forward.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ConfigError, LogError

Array = NDArray[np.float64]

DEPTH_ENDING = ".depth.png"
POSE_ENDING = ".pose.txt"
INTRINSICS_NAME = "camera-intrinsics.txt"
NO_READING = (0, 65535)


def pillow() -> Any:
    """Pillow's image module, imported late.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        from PIL import Image
    except ImportError:
        raise ConfigError("depth images need Pillow; install it with: pip install 'radioslam[pointcloud]'") from None
    return Image


def read_depth_cloud(path: Path) -> Array:
    """Points (n, 3) of a depth image, with the intrinsics of its folder.

    Raises:
        LogError: the image is no 16-bit PNG, or the folder has no intrinsics.
    """
    depth_mm = read_depth(path)
    return back_project(depth_mm, read_matrix(path.with_name(INTRINSICS_NAME), 3, "intrinsics of the depth camera"))


def read_depth(path: Path) -> NDArray[np.uint16]:
    """Depth in millimetres (height, width)."""
    image_of = pillow()
    try:
        with image_of.open(path) as image:
            mode, pixels = image.mode, np.array(image)
    except (OSError, SyntaxError) as error:
        raise LogError(path, "a depth image (PNG)", f"one that is broken ({error})") from None
    if not mode.startswith("I"):
        raise LogError(path, "a depth image with 16 bits per pixel", f"one of mode {mode}")
    return pixels.astype(np.uint16)


def write_depth(path: Path, depth_m: Array) -> None:
    """Write a depth image (height, width) of metres, 0 where there is no reading."""
    depth_mm = np.round(depth_m * 1000.0).clip(0, NO_READING[1] - 1)
    pillow().fromarray(depth_mm.astype(np.uint16)).save(path)


def back_project(depth_mm: NDArray[np.uint16], K: Array) -> Array:
    """Points (n, 3) in metres of the pixels that have a reading."""
    v, u = np.nonzero(~np.isin(depth_mm, NO_READING))
    z = depth_mm[v, u] / 1000.0
    return np.column_stack([(u - K[0, 2]) / K[0, 0] * z, (v - K[1, 2]) / K[1, 1] * z, z])


def read_matrix(path: Path, size: int, what: str) -> Array:
    """A square matrix from text.

    Raises:
        LogError: there is no such file, or something else is in it.
    """
    try:
        matrix = np.loadtxt(path, dtype=float, ndmin=2)
    except FileNotFoundError:
        raise LogError(path, what, "no such file", f"put a {size} × {size} matrix there") from None
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise LogError(path, f"{what}, a {size} × {size} matrix", str(error)) from None
    if matrix.shape != (size, size) or not np.isfinite(matrix).all():
        raise LogError(path, f"{what}, a {size} × {size} matrix", f"{matrix.shape[0]} × {matrix.shape[1]} or NaN")
    return np.asarray(matrix)


def read_pose(path: Path, what: str) -> Array:
    """A rigid motion (4, 4), its rotation made exact: text has few digits.

    Raises:
        LogError: no such file, or the matrix is no rigid motion (7-Scenes marks lost tracking so).
    """
    T = read_matrix(path, 4, what)
    U, stretch, Vt = np.linalg.svd(T[:3, :3])
    if np.abs(stretch - 1.0).max() > 0.05 or np.linalg.det(U @ Vt) < 0 or np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-3:
        raise LogError(path, f"{what}, a rigid motion", "a matrix that stretches or mirrors")
    T[:3, :3] = U @ Vt
    return T
