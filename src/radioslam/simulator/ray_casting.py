"""Rays cast into a furnished building.

A ray p + t d meets an upright rectangle where it crosses its line in the plan, and a level one where it reaches its
height; the smallest t is the depth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam.simulator.furnishing import Scene

Array = NDArray[np.float64]


def depth_of(scene: Scene, T_map_sensor: Array, rays: Array, range_m: float) -> Array:
    """Depth (n,) in multiples of rays (n, 3), given in the sensor's frame; infinite where nothing is within the range.

    Rays with z = 1 have the depth of a camera, rays of length one the range of a scanner.
    """
    origin, directions = T_map_sensor[:3, 3], rays @ T_map_sensor[:3, :3].T
    reach = range_m * float(np.linalg.norm(rays, axis=1).max())
    depth = np.full(len(rays), np.inf)
    for crossing in (_upright_crossings, _level_crossings):
        found = crossing(scene, origin, directions, reach)
        if len(found):
            depth = np.minimum(depth, found.min(axis=0))
    return np.where(depth <= range_m, depth, np.inf)


def _upright_crossings(scene: Scene, origin: Array, directions: Array, reach_m: float) -> Array:
    """Depth (k, n) of each ray at the upright rectangles near by, infinite where it misses."""
    walls = scene.upright
    start, along = walls[:, :2] - origin[:2], walls[:, 2:4] - walls[:, :2]
    share = np.clip(-np.sum(start * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12), 0.0, 1.0)
    near = np.linalg.norm(start + share[:, None] * along, axis=1) <= reach_m
    start, along, low, high = start[near], along[near], walls[near, 4], walls[near, 5]
    dx, dy, dz = directions.T
    with np.errstate(divide="ignore", invalid="ignore"):
        across = np.outer(along[:, 1], dx) - np.outer(along[:, 0], dy)
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0])[:, None] / across
        s = (np.outer(start[:, 0], dy) - np.outer(start[:, 1], dx)) / across
        z = origin[2] + t * dz
        hit = (t > 0) & (s >= 0) & (s <= 1) & (z >= low[:, None]) & (z <= high[:, None])
    return np.where(hit, t, np.inf)


def _level_crossings(scene: Scene, origin: Array, directions: Array, reach_m: float) -> Array:
    """Depth (k, n) of each ray at the level rectangles near by, infinite where it misses."""
    west, south, east, north, z = scene.level.T
    gap = np.hypot(
        np.maximum(0.0, np.maximum(west - origin[0], origin[0] - east)),
        np.maximum(0.0, np.maximum(south - origin[1], origin[1] - north)),
    )
    west, south, east, north, z = scene.level[gap <= reach_m].T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (z - origin[2]) / directions[:, 2]
        x, y = origin[0] + t * directions[:, 0], origin[1] + t * directions[:, 1]
        hit = (t > 0) & (x >= west) & (x <= east) & (y >= south) & (y <= north)
    return np.where(hit, t, np.inf)


def within_sector(scene: Scene, T_map_sensor: Array, right: Array, left: Array) -> Scene:
    """What of the scene reaches into the sector of the plan between two rays (3,), less than π apart."""
    origin, rotation = T_map_sensor[:2, 3], T_map_sensor[:3, :3]
    right, left = (rotation @ right)[:2], (rotation @ left)[:2]
    ahead = right + left
    edges = [right, -left, np.array([ahead[1], -ahead[0]])]
    west, south, east, north, _ = scene.level.T
    corners = np.array([[west, south], [east, south], [east, north], [west, north]])
    upright = _reaches(scene.upright[:, :4].reshape(-1, 2, 2).transpose(1, 2, 0), origin, edges)
    return Scene(scene.upright[upright], scene.level[_reaches(corners, origin, edges)])


def _reaches(corners: Array, origin: Array, edges: list[Array]) -> NDArray[np.bool_]:
    """Mask (n,) of the polygons (k, 2, n) with a corner to the left of, or on, each edge through the origin."""
    x, y = corners[:, 0] - origin[0], corners[:, 1] - origin[1]
    return np.all([(dx * y - dy * x >= -1e-9).any(axis=0) for dx, dy in edges], axis=0)
