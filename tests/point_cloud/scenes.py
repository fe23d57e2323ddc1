"""Clouds with known geometry for the tests of point clouds."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from radioslam import rigid
from radioslam.simulator.depth_camera import DepthCamera
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.ray_casting import depth_of

Array = NDArray[np.float64]

CAMERA = DepthCamera(width=96, height=72, focal_px=80.0)


def box(west: float, south: float, east: float, north: float, low: float, high: float) -> tuple[Array, Array]:
    corners = [(west, south), (east, south), (east, north), (west, north)]
    sides = [[*corners[k], *corners[(k + 1) % 4], low, high] for k in range(4)]
    return np.array(sides), np.array([[west, south, east, north, low], [west, south, east, north, high]])


@cache
def room() -> Scene:
    """6 m × 5 m × 2.8 m with eight pieces of furniture, none like another."""
    rng = np.random.default_rng(4)
    parts = [box(0.0, 0.0, 6.0, 5.0, 0.0, 2.8)]
    for _ in range(14):
        centre, half = rng.uniform([0.3, 0.3], [5.7, 4.7]), rng.uniform(0.1, 0.5, 2)
        if np.linalg.norm(centre - [2.0, 2.5]) > 1.2:
            low = float(rng.choice([0.0, 0.9]))
            parts.append(box(*(centre - half), *(centre + half), low, low + float(rng.uniform(0.3, 1.3))))
    return Scene(np.concatenate([upright for upright, _ in parts]), np.concatenate([level for _, level in parts]))


def camera_at(x: float, y: float, heading_rad: float) -> Array:
    """T_map_camera of somebody who stands there."""
    return rigid.from_planar(np.array([[x, y, heading_rad]]))[0] @ CAMERA.mount()


def view(T_map_camera: Array, seed: int | None = 0) -> Array:
    """The cloud (n, 3) seen from there in the camera's frame; without a seed without noise."""
    rays = CAMERA.rays()
    depth = depth_of(room(), T_map_camera, rays, CAMERA.range_m)
    if seed is not None:
        depth = CAMERA.measure(depth, np.random.default_rng(seed))
    known = np.isfinite(depth) & (depth > 0)
    return rays[known] * depth[known, None]


def random_motion(seed: int, metres: float = 3.0) -> Array:
    rng = np.random.default_rng(seed)
    return rigid.motion(Rotation.random(rng=rng).as_matrix(), rng.uniform(-metres, metres, 3))
