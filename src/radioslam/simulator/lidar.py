"""Lidar turns of a walk: rays cast all around from a spinning scanner into the furnished building.

The scanner stands upright on its carrier; its frame is the body's, lifted: x ahead, y to the left, z up. A turn is
taken from one place, as if the scanner's driver had undone what the carrier moved meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.point_cloud.pcd import write_pcd
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.ray_casting import depth_of, within_sector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lidar:
    """A scanner with rings, on a robot or a pole.

    Attributes:
        rings: evenly spaced from ``lowest_rad`` to ``highest_rad`` above the horizon.  columns: per turn.
        range_m: what lies farther gives no reading.  noise_m: standard deviation of the range.
        height_m: above the floor.
        sectors: in which rays are cast together, for speed alone.
    """

    rings: int = 16
    columns: int = 512
    lowest_rad: float = -np.pi / 12
    highest_rad: float = np.pi / 12
    range_m: float = 20.0
    noise_m: float = 0.02
    height_m: float = 1.0
    sectors: int = 32

    def mount(self) -> Array:
        """T_body_lidar (4, 4)."""
        return rigid.motion(np.eye(3), np.array([0.0, 0.0, self.height_m]))

    def rays(self) -> Array:
        """Unit directions (columns, rings, 3) in the scanner's frame."""
        azimuth = 2 * np.pi * np.arange(self.columns)[:, None] / self.columns
        rise = np.linspace(self.lowest_rad, self.highest_rad, self.rings)[None]
        parts = [np.cos(azimuth) * np.cos(rise), np.sin(azimuth) * np.cos(rise), np.sin(rise) + 0 * azimuth]
        return np.stack(parts, axis=-1)

    def turn(self, scene: Scene, T_map_lidar: Array, rng: np.random.Generator) -> Array:
        """Noisy points (n, 3) of one turn in the scanner's frame; an upright pose is expected."""
        found = []
        for rays in np.array_split(self.rays(), self.sectors):
            visible = within_sector(scene, T_map_lidar, rays[0, 0], rays[-1, 0])
            flat = rays.reshape(-1, 3)
            range_m = depth_of(visible, T_map_lidar, flat, self.range_m)
            near = np.isfinite(range_m)
            measured = range_m[near] + self.noise_m * rng.standard_normal(int(near.sum()))
            found.append(flat[near] * measured[:, None])
        return np.concatenate(found)

    def write(self, stem: Path, scene: Scene, T_map_lidar: Array, rng: np.random.Generator) -> Path:
        """Write one turn as ``STEM.pcd``."""
        path = stem.with_name(stem.name + ".pcd")
        write_pcd(path, self.turn(scene, T_map_lidar, rng))
        return path
