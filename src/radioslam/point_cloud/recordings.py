"""Walks with point clouds on disk: which clouds, when, and where odometry thinks they were taken.

    WALK/clouds/*           clouds of a walk in the open format, beside its trajectory.tum (and scans.csv)
    FOLDER/*                clouds alone, odometry given or in NAME.pose.txt beside each depth image

A folder of clouds may hold ``clouds.txt`` (``time_s name`` per line; without it a cloud's time is the last number in
its name), ``camera-intrinsics.txt`` (depth images) and ``mount.txt`` (4 × 4, the sensor's pose on the body whose
odometry it is).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.errors import LogError
from radioslam.formats import open_format
from radioslam.formats.tum import read_spatial_tum
from radioslam.point_cloud.clouds import is_cloud
from radioslam.point_cloud.depth import DEPTH_ENDING, POSE_ENDING, read_pose
from radioslam.walk import Walk

Array = NDArray[np.float64]

TIMES_NAME = "clouds.txt"
MOUNT_NAME = "mount.txt"
CLOUDS_NAME = "clouds"


@dataclass(frozen=True)
class CloudSteps:
    """What registration made of the odometry between each cloud and the one before.

    Attributes:
        covariance: (n, 6, 6) of a small motion of the body in its own axes, rotation (rad) before translation (m).
        registered: (n,) whether the cloud corrected the step.
    """

    covariance: Array
    registered: NDArray[np.bool_]


@dataclass(frozen=True)
class Recording:
    """One walk with clouds.

    Attributes:
        name: of the walk.
        time_s: (m,) of the odometry.  T_odom_body: (m, 4, 4), the tracker's poses.
        clouds: (n,) files.  cloud_s: (n,) when they were taken, within the odometry's time.
        T_body_sensor: (4, 4) how the sensor is mounted.
        walk: with the radio scans, where there are any.
        steps: how well each step is known, once clouds have corrected the odometry.
    """

    name: str
    time_s: Array
    T_odom_body: Array
    clouds: tuple[Path, ...]
    cloud_s: Array
    T_body_sensor: Array
    walk: Walk | None = None
    steps: CloudSteps | None = None

    def body_at_clouds(self) -> Array:
        """Odometry (n, 4, 4) at the clouds' times."""
        return rigid.interpolate(self.time_s, self.T_odom_body, self.cloud_s)

    def sensor_at_clouds(self) -> Array:
        """Poses (n, 4, 4) of the sensor when each cloud was taken, by odometry."""
        return self.body_at_clouds() @ self.T_body_sensor

    @property
    def is_planar(self) -> bool:
        """Whether odometry knows no heights and no slopes."""
        upright = np.abs(self.T_odom_body[:, 2, 2] - 1.0).max() < 1e-6
        return bool(upright and np.ptp(self.T_odom_body[:, 2, 3]) < 1e-6)


def find_recordings(paths: Sequence[Path], odometry: Path | None = None) -> list[Recording]:
    """The walks with clouds below these folders, sorted by name.

    Args:
        paths: folders of clouds, walks with clouds, or folders of those.
        odometry: TUM trajectory of the only walk; None: what stands beside the clouds.

    Raises:
        LogError: nothing there, a cloud without pose or time, or two walks of one name.
    """
    found = sorted((r for path in paths for r in _below(path, odometry)), key=lambda recording: recording.name)
    names = [recording.name for recording in found]
    if len(set(names)) < len(names):
        raise LogError(paths[0], "walks of different names", f"two called {max(names, key=names.count)!r}")
    if odometry is not None and len(found) > 1:
        raise LogError(odometry, "one walk for one trajectory", f"{len(found)} walks with clouds")
    return found


def _below(path: Path, odometry: Path | None) -> list[Recording]:
    if not path.is_dir():
        raise LogError(path, "a folder of point clouds", "none", "check the path")
    if any(is_cloud(file) for file in path.iterdir()):
        return [_read(path, path.resolve().name, odometry, None)]
    walks = [folder.parent for folder in sorted(path.rglob(CLOUDS_NAME)) if folder.is_dir()]
    if not walks:
        raise LogError(path, "point clouds (.ply, .pcd, .depth.png) or walks with a folder clouds", "none below it")
    return [_read(walk / CLOUDS_NAME, walk.resolve().name, odometry, walk) for walk in walks]


def _read(folder: Path, name: str, odometry: Path | None, walk_folder: Path | None) -> Recording:
    clouds, cloud_s = _clouds(folder)
    beside = walk_folder / open_format.FOLDER_NAMES["trajectory"] if walk_folder else None
    trajectory = odometry or (beside if beside and beside.exists() else None)
    mount = folder / MOUNT_NAME
    time_s, poses = read_spatial_tum(trajectory) if trajectory else (cloud_s, _poses_beside(clouds))
    outside = np.flatnonzero((cloud_s < time_s[0] - 1e-6) | (cloud_s > time_s[-1] + 1e-6))
    if len(outside):
        expected = f"a pose at {cloud_s[outside[0]]:g} s in {trajectory}"
        raise LogError(clouds[outside[0]], expected, f"poses from {time_s[0]:g} to {time_s[-1]:g} s", "mind the clocks")
    return Recording(
        name=name,
        time_s=time_s,
        T_odom_body=poses,
        clouds=clouds,
        cloud_s=cloud_s,
        T_body_sensor=read_pose(mount, "the sensor's mount") if mount.exists() else np.eye(4),
        walk=_radio_of(walk_folder),
    )


def _radio_of(walk_folder: Path | None) -> Walk | None:
    scans = walk_folder / open_format.FOLDER_NAMES["scans"] if walk_folder else None
    return open_format.read(scans) if scans and scans.exists() else None


def _clouds(folder: Path) -> tuple[tuple[Path, ...], Array]:
    files = sorted(file for file in folder.iterdir() if is_cloud(file))
    if not files:
        raise LogError(folder, "point clouds (.ply, .pcd, .depth.png)", "none")
    listed = _listed_times(folder / TIMES_NAME)
    missing = [file for file in files if listed is not None and file.name not in listed]
    if missing:
        raise LogError(folder / TIMES_NAME, f"the time of {missing[0].name}", "none", "list every cloud or remove it")
    times = np.array([_time_in_name(file) if listed is None else listed[file.name] for file in files])
    order = np.argsort(times, kind="stable")
    if np.any(np.diff(times[order]) <= 0):
        twin = files[order[int(np.argmin(np.diff(times[order])))]]
        raise LogError(twin, "a time of its own for each cloud", "two of one time", f"list times in {TIMES_NAME}")
    return tuple(files[k] for k in order), times[order]


def _listed_times(path: Path) -> dict[str, float] | None:
    if not path.exists():
        return None
    times = {}
    for number, line in enumerate(path.read_text("utf-8", "replace").splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            times[words[1]] = float(words[0])
        except (IndexError, ValueError):
            raise LogError(path, "time_s and name", repr(line), line=number) from None
    return times


def _time_in_name(path: Path) -> float:
    """The last number in a name: ``frame-000010.depth.png`` is 10, ``1311868164.36.pcd`` what it says."""
    stem = path.name.removesuffix(DEPTH_ENDING) if path.name.endswith(DEPTH_ENDING) else path.stem
    numbers = re.findall(r"\d+(?:\.\d+)?", stem)
    if not numbers:
        raise LogError(path, "a number in the name, or clouds.txt", "neither", "tell when each cloud was taken")
    return float(numbers[-1])


def _poses_beside(clouds: Sequence[Path]) -> Array:
    """Poses (n, 4, 4) of ``NAME.pose.txt`` beside each cloud, as depth cameras are recorded."""
    stems = [c.name.removesuffix(DEPTH_ENDING) if c.name.endswith(DEPTH_ENDING) else c.stem for c in clouds]
    files = [cloud.with_name(stem + POSE_ENDING) for cloud, stem in zip(clouds, stems, strict=True)]
    return np.array([read_pose(file, "the cloud's pose (or --odometry TUM)") for file in files])
