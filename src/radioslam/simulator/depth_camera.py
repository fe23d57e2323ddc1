"""Depth frames of a walk: rays cast from a phone's camera into the furnished building.

The camera looks ahead and a little down; its frame has x right, y down, z forward. A ray p + t (u, v, 1) meets an
upright rectangle where it crosses its line in the plan, and a level one where it reaches its height; the smallest t is
the depth. Noise grows with the square of the depth, as with structured light and stereo (Khoshelham and Elberink 2012).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.point_cloud.depth import DEPTH_ENDING, INTRINSICS_NAME, write_depth
from radioslam.point_cloud.recordings import CLOUDS_NAME, MOUNT_NAME, TIMES_NAME
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.tracker import travel_headings
from radioslam.walk import Walk

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DepthCamera:
    """A phone's depth sensor, held before the body.

    Attributes:
        width, height: pixels.  focal_px: of the pinhole.
        range_m: what lies deeper gives no reading.  noise_m, noise_per_m: standard deviation at depth z is
            noise_m + noise_per_m z².
        height_m: above the floor.  pitch_rad: below the horizon.
    """

    width: int = 128
    height: int = 96
    focal_px: float = 110.0
    range_m: float = 5.0
    noise_m: float = 0.001
    noise_per_m: float = 0.0015
    height_m: float = 1.4
    pitch_rad: float = 0.15

    def intrinsics(self) -> Array:
        """K (3, 3)."""
        middle = [(self.width - 1) / 2, (self.height - 1) / 2]
        return np.array([[self.focal_px, 0, middle[0]], [0, self.focal_px, middle[1]], [0, 0, 1.0]])

    def mount(self) -> Array:
        """T_body_camera (4, 4): the body has x ahead, y to the left, z up, and stands on the floor."""
        sine, cosine = np.sin(self.pitch_rad), np.cos(self.pitch_rad)
        axes = np.array([[0.0, -sine, cosine], [-1.0, 0.0, 0.0], [0.0, -cosine, -sine]])
        return rigid.motion(axes, np.array([0.0, 0.0, self.height_m]))

    def measure(self, depth_m: Array, rng: np.random.Generator) -> Array:
        """Noisy depth; no reading (0) beyond the range."""
        known = np.isfinite(depth_m)
        depth_m = np.where(known, depth_m, 0.0)
        noise = (self.noise_m + self.noise_per_m * depth_m**2) * rng.standard_normal(depth_m.shape)
        return np.where(known, depth_m + noise, 0.0)

    def rays(self) -> Array:
        """Directions (height · width, 3) in the camera's frame with z = 1."""
        v, u = np.mgrid[: self.height, : self.width]
        pixels = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
        return np.asarray(pixels @ np.linalg.inv(self.intrinsics()).T)


def true_poses(positions_xy: Array) -> Array:
    """Planar poses (n, 3) of somebody who looks where they go; as the tracker's, without drift."""
    heading = travel_headings(np.diff(positions_xy, axis=0))
    return np.column_stack([positions_xy, np.concatenate([heading[:1], heading])])


def depth_of(scene: Scene, T_map_camera: Array, rays: Array, range_m: float) -> Array:
    """Depth (n,) in metres along rays (n, 3) with z = 1 in the camera's frame; infinite where nothing is near."""
    origin, directions = T_map_camera[:3, 3], rays @ T_map_camera[:3, :3].T
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


def write_frames(
    walk: Walk, scene: Scene, folder: Path, rng: np.random.Generator, camera: DepthCamera | None = None
) -> None:
    """Write a depth frame for every true position of a simulated walk into ``folder/clouds``.

    Beside them stand their times, the intrinsics and the camera's mount on the body that the odometry tracks.
    """
    camera = camera or DepthCamera()
    rays, (time_s, cameras) = camera.rays(), _camera_poses(walk, camera)
    target = folder / CLOUDS_NAME
    target.mkdir(parents=True)
    np.savetxt(target / INTRINSICS_NAME, camera.intrinsics())
    np.savetxt(target / MOUNT_NAME, camera.mount())
    names = [f"frame-{k:06d}{DEPTH_ENDING}" for k in range(len(time_s))]
    for name, T in zip(names, cameras, strict=True):
        depth_m = camera.measure(depth_of(scene, T, rays, camera.range_m), rng)
        write_depth(target / name, depth_m.reshape(camera.height, camera.width))
    lines = (f"{time:.6f} {name}\n" for time, name in zip(time_s.tolist(), names, strict=True))
    (target / TIMES_NAME).write_text("".join(lines), "utf-8")


def _camera_poses(walk: Walk, camera: DepthCamera) -> tuple[Array, Array]:
    if walk.reference is None:
        raise ValueError("expected a walk with its true positions")
    return walk.reference.time_s, rigid.from_planar(true_poses(walk.reference.positions_xy)) @ camera.mount()
