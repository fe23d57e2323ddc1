"""Surfaces: down-sampled points with normals, and ICP between two of them; the only file that knows ``small_gicp``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """One point cloud, ready to be registered, in the frame of its sensor.

    Attributes:
        points: (n, 3) metres, one per occupied voxel.  normals: (n, 3) unit vectors, turned to the sensor.
        cloud, tree: the same for ``small_gicp``.
    """

    points: Array
    normals: Array
    cloud: Any
    tree: Any

    def __len__(self) -> int:
        return len(self.points)


def small_gicp() -> Any:
    """The library, imported late.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        import small_gicp as library
    except ImportError:
        raise ConfigError("point clouds need small_gicp; install it with: pip install 'radioslam[pointcloud]'") from None
    return library


def make_surface(points: Array, voxel_m: float, normal_neighbours: int) -> Surface:
    """Down-sample points (n, 3) to one per voxel and estimate normals; points without a normal are left out."""
    library = small_gicp()
    cloud, tree = library.preprocess_points(points, voxel_m, normal_neighbours)
    kept, normals = cloud.points()[:, :3], cloud.normals()[:, :3]
    known = np.linalg.norm(normals, axis=1) > 0.5
    if not known.all():
        cloud, tree = library.preprocess_points(kept[known], voxel_m / 1000, normal_neighbours)
        kept, normals = cloud.points()[:, :3], cloud.normals()[:, :3]
    towards = np.where(np.einsum("nj,nj->n", kept, normals) > 0, -1.0, 1.0)
    return Surface(np.array(kept), normals * towards[:, None], cloud, tree)


def refine(target: Surface, source: Surface, T_target_source: Array, reach_m: float, iterations: int) -> Array:
    """The motion (4, 4) after ICP from plane to plane (Segal et al. 2009), pairing points within ``reach_m``."""
    result = small_gicp().align(
        target.cloud,
        source.cloud,
        target.tree,
        T_target_source,
        registration_type="GICP",
        max_correspondence_distance=reach_m,
        max_iterations=iterations,
    )
    return np.array(result.T_target_source)


def nearest(target: Surface, points: Array) -> tuple[NDArray[np.int64], Array]:
    """Index (n,) of the nearest point of the target, and its distance (n,), for points (n, 3)."""
    index, squared = target.tree.batch_knn_search(points, 1)
    return index[:, 0].astype(np.int64), np.sqrt(squared[:, 0])
