"""Point clouds of a simulated walk, as its carrier's sensor takes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.point_cloud.recordings import CLOUDS_NAME, MOUNT_NAME, TIMES_NAME
from radioslam.simulator.depth_camera import DepthCamera
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.lidar import Lidar
from radioslam.simulator.tracker import travel_headings
from radioslam.walk import Walk

Array = NDArray[np.float64]


class Sensor(Protocol):
    """What takes point clouds: a depth camera, a lidar."""

    def mount(self) -> Array:
        """T_body_sensor (4, 4): the body has x ahead, y to the left, z up, and stands on the floor."""
        ...

    def write(self, stem: Path, scene: Scene, T_map_sensor: Array, rng: np.random.Generator) -> Path:
        """Write one cloud to a file whose name begins with the stem's, and what its format needs beside it."""
        ...


SENSORS: dict[str, Callable[[], Sensor]] = {"depth": DepthCamera, "lidar": Lidar}


def true_poses(positions_xy: Array) -> Array:
    """Planar poses (n, 3) of somebody who looks where they go; as the tracker's, without drift."""
    heading = travel_headings(np.diff(positions_xy, axis=0))
    return np.column_stack([positions_xy, np.concatenate([heading[:1], heading])])


def write_clouds(walk: Walk, scene: Scene, folder: Path, rng: np.random.Generator, sensor: Sensor) -> None:
    """Write a cloud for every true position of a simulated walk into ``folder/clouds``.

    Beside them stand their times and the sensor's mount on the body that the odometry tracks.
    """
    if walk.reference is None:
        raise ValueError("expected a walk with its true positions")
    target = folder / CLOUDS_NAME
    target.mkdir(parents=True)
    np.savetxt(target / MOUNT_NAME, sensor.mount())
    poses = rigid.from_planar(true_poses(walk.reference.positions_xy)) @ sensor.mount()
    names = [sensor.write(target / f"frame-{k:06d}", scene, T, rng).name for k, T in enumerate(poses)]
    lines = (f"{time:.6f} {name}\n" for time, name in zip(walk.reference.time_s.tolist(), names, strict=True))
    (target / TIMES_NAME).write_text("".join(lines), "utf-8")
