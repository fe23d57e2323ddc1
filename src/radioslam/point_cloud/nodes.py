"""The nodes of a reference graph: clouds taken far enough from each other, ready to be registered."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import ReferenceConfig, RegistrationConfig
from radioslam.errors import LogError, MappingError
from radioslam.point_cloud.clouds import check_cloud, read_cloud, unit_warning
from radioslam.point_cloud.recordings import Recording
from radioslam.point_cloud.registration import Features, make_features, within_range
from radioslam.progress import Tell

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Nodes:
    """n clouds of all walks, in the order of walks and of time.

    Attributes:
        walk: (n,) number of the recording.  cloud: (n,) number in it.  time_s: (n,) on its clock.
        T_odom_body: (n, 4, 4) odometry, in each walk's own frame.
        distance_m: (n,) path of the sensor up to here.
        T_body_sensor: (n, 4, 4) mounts.
        middle: (n, 3) middle of the cloud in the sensor's frame.
        measured: (w,) whether clouds corrected each walk's odometry.
        features: what registration needs of each.
        skipped: clouds that were left out, with the reason.  warnings: what a person should look at.
    """

    walk: Integers
    cloud: Integers
    time_s: Array
    T_odom_body: Array
    distance_m: Array
    T_body_sensor: Array
    middle: Array
    measured: NDArray[np.bool_]
    features: tuple[Features, ...]
    skipped: tuple[str, ...]
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.walk)


def collect_nodes(
    recordings: Sequence[Recording],
    config: RegistrationConfig,
    settings: ReferenceConfig,
    metres_per_unit: float,
    tell: Tell,
) -> Nodes:
    """Read the clouds of key frames: those ``key_frame_m`` or ``key_frame_rad`` apart from the one before.

    With ``submap_m`` each is joined with its neighbours along the walk, as odometry lays them. Flat, empty or far
    clouds are left out, with the reason.

    Raises:
        LogError: a file cannot be read or holds NaN.
        MappingError: fewer than two clouds are left.
    """
    chosen = [
        (k, frame, T, walked)
        for k, recording in enumerate(recordings)
        for frame, T, walked in _key_frames(recording, settings.key_frame_m, settings.key_frame_rad)
    ]
    rows, skipped, warnings = [], [], []
    for done, (k, frame, T, walked) in enumerate(chosen):
        path = recordings[k].clouds[frame]
        tell(f"describing {path.name}", done, len(chosen))
        points = _submap(recordings[k], frame, settings.submap_m, config.max_range_m, metres_per_unit)
        warnings += [text for text in [unit_warning(points, path)] if text]
        try:
            features = _features(points, path, config)
        except LogError as error:
            skipped.append(str(error))
            continue
        rows.append((k, frame, recordings[k].cloud_s[frame], T, walked, recordings[k].T_body_sensor, features))
    if len(rows) < 2:
        why = (warnings or skipped or [""])[0]
        raise MappingError(f"expected two clouds or more that can be registered, found {len(rows)}; {why}")
    walk, cloud, time_s, poses, distance_m, mounts, described = zip(*rows, strict=True)
    middle = np.array([np.median(one.surface.points, axis=0) for one in described])
    return Nodes(
        np.array(walk, dtype=np.int64),
        np.array(cloud, dtype=np.int64),
        np.array(time_s),
        np.array(poses),
        np.array(distance_m),
        np.array(mounts),
        middle,
        np.array([recording.steps is not None for recording in recordings]),
        tuple(described),
        tuple(skipped),
        tuple(warnings[:1]),
    )


def _submap(recording: Recording, frame: int, submap_m: float, max_range_m: float, metres_per_unit: float) -> Array:
    """Points (n, 3) of a cloud and of those beside it along the walk, in the cloud's frame."""
    points = [read_cloud(recording.clouds[frame], metres_per_unit)]
    sensor = recording.sensor_at_clouds()
    for other in beside(walked_m(sensor), frame, submap_m):
        cloud = read_cloud(recording.clouds[other], metres_per_unit)
        near = within_range(cloud, max_range_m)
        points.append(rigid.transform(rigid.inverse(sensor[frame]) @ sensor[other], near))
    return np.concatenate(points)


def walked_m(sensor: Array) -> Array:
    """Path length (n,) up to each of the poses (n, 4, 4)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(sensor[:, :3, 3], axis=0), axis=1))])


def beside(walked: Array, frame: int, submap_m: float) -> Integers:
    """The clouds that make up a submap with this one: about one per half of ``submap_m``, so far before and after."""
    if not submap_m:
        return np.zeros(0, np.int64)
    away = walked - walked[frame]
    near = np.flatnonzero((np.abs(away) <= submap_m) & (np.abs(away) > submap_m / 4))
    near = near[np.argsort(np.abs(near - frame), kind="stable")]
    _, first = np.unique(np.rint(away[near] / (submap_m / 2)), return_index=True)
    return np.sort(near[first]).astype(np.int64)


def _features(points: Array, path: Path, config: RegistrationConfig) -> Features:
    near = within_range(points, config.max_range_m)
    if len(points) and not len(near):
        raise LogError(
            path, f"points within {config.max_range_m:g} m of the sensor", "none", "see registration.max_range_m"
        )
    return make_features(check_cloud(near, path), config)


def _key_frames(recording: Recording, move_m: float, turn_rad: float) -> Iterator[tuple[int, Array, float]]:
    """Number, odometry and path length of the first cloud and of each that is far enough from the one before."""
    poses, sensor = recording.body_at_clouds(), recording.sensor_at_clouds()
    walked = walked_m(sensor)
    last = 0
    for k in range(len(poses)):
        moved_m, turned_rad = rigid.apart(sensor[last], sensor[k])
        if k == 0 or moved_m >= move_m or turned_rad >= turn_rad:
            yield k, poses[k], float(walked[k])
            last = k
