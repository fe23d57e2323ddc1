"""Surfaces: down-sampled points with normals, and ICP between two of them; the only file that knows ``small_gicp``."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ConfigError

Array = NDArray[np.float64]

FEWEST_NEIGHBOURS = 5
PREPARED = 256
"""So many surfaces keep their k-d tree and covariances, ten times the size of their points, while they live."""


@dataclass(frozen=True, eq=False)
class Surface:
    """One point cloud, ready to be registered, in the frame of its sensor.

    Attributes:
        points: (n, 3) metres, one per occupied voxel.  normals: (n, 3) unit vectors, turned to the sensor.
        normal_neighbours: points from which each normal was estimated.
    """

    points: Array
    normals: Array
    normal_neighbours: int

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
        advice = "install it with: pip install 'radioslam[pointcloud]'"
        raise ConfigError(f"point clouds need small_gicp; {advice}") from None
    return library


def make_surface(points: Array, voxel_m: float, normal_neighbours: int) -> Surface:
    """Down-sample points (n, 3) to one per voxel and estimate normals; points without a normal are left out."""
    if len(points) < FEWEST_NEIGHBOURS:
        return Surface(np.zeros((0, 3)), np.zeros((0, 3)), normal_neighbours)
    cloud, _ = small_gicp().preprocess_points(points, voxel_m, normal_neighbours)
    kept, normals = cloud.points()[:, :3], cloud.normals()[:, :3]
    known = np.linalg.norm(normals, axis=1) > 0.5
    away = np.einsum("nj,nj->n", kept, normals) > 0
    normals[away] *= -1.0
    return Surface(kept[known], normals[known], normal_neighbours)


_kept: OrderedDict[weakref.ref[Surface], tuple[Any, Any]] = OrderedDict()


def _prepared(surface: Surface) -> tuple[Any, Any]:
    """Cloud with covariances and k-d tree for ``small_gicp``; while it is among the last used and lives."""
    key = weakref.ref(surface, lambda gone: _kept.pop(gone, None))
    if key not in _kept:
        _kept[key] = _prepare(surface)
        while len(_kept) > PREPARED:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]


def _prepare(surface: Surface) -> tuple[Any, Any]:
    library = small_gicp()
    cloud = library.PointCloud(surface.points)
    tree = library.KdTree(cloud)
    library.estimate_normals_covariances(cloud, tree, surface.normal_neighbours)
    return cloud, tree


@lru_cache(maxsize=PREPARED)
def _thinned(surface: Surface, most: int) -> Any:
    """About ``most`` of the points, evenly chosen, with covariances."""
    library = small_gicp()
    every = max(1, round(len(surface) / most))
    if every == 1:
        return _prepared(surface)[0]
    # small_gicp takes covariances only from its own estimate: that among the thinned points, of as wide a patch.
    cloud = library.PointCloud(surface.points[::every])
    library.estimate_covariances(cloud, None, max(5, surface.normal_neighbours // every))
    return cloud


def refine(
    target: Surface, source: Surface, T_target_source: Array, reach_m: float, most_points: int, iterations: int
) -> Array:
    """The motion (4, 4) after ICP from plane to plane (Segal et al. 2009), pairing points within ``reach_m``.

    Of the source about ``most_points`` points take part.
    """
    cloud, tree = _prepared(target)
    result = small_gicp().align(
        cloud,
        _thinned(source, most_points),
        tree,
        T_target_source,
        registration_type="GICP",
        max_correspondence_distance=reach_m,
        max_iterations=iterations,
    )
    return np.array(result.T_target_source)


def nearest(target: Surface, points: Array) -> tuple[NDArray[np.int64], Array]:
    """Index (n,) of the nearest point of the target, and its distance (n,), for points (n, 3)."""
    index, squared = _prepared(target)[1].batch_knn_search(points, 1)
    return index[:, 0].astype(np.int64), np.sqrt(squared[:, 0])
