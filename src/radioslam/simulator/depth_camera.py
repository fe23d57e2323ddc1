"""A phone's depth camera in a furnished building.

The camera looks ahead and a little down; its frame has x right, y down, z forward. Noise grows with the square of the
depth, as with structured light and stereo (Khoshelham and Elberink 2012).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.point_cloud.depth import DEPTH_ENDING, INTRINSICS_NAME, write_depth
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.ray_casting import depth_of

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

    def write(self, stem: Path, scene: Scene, T_map_camera: Array, rng: np.random.Generator) -> Path:
        """Write one frame as ``STEM.depth.png``, and the intrinsics beside it."""
        intrinsics = stem.with_name(INTRINSICS_NAME)
        if not intrinsics.exists():
            np.savetxt(intrinsics, self.intrinsics())
        path = stem.with_name(stem.name + DEPTH_ENDING)
        depth_m = self.measure(depth_of(scene, T_map_camera, self.rays(), self.range_m), rng)
        write_depth(path, depth_m.reshape(self.height, self.width))
        return path
