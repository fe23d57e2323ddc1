"""Odometry corrected by the clouds themselves: each is registered with a local map of those taken shortly before it.

The map holds clouds where they have been corrected to, so that it bends far less than odometry does (frame to map, as
in LOAM, Zhang and Singh 2014, or KISS-ICP, Vizzo et al. 2023). A step from one cloud to the next is that of a Kalman
filter: odometry predicts the pose T with covariance P, registration measures it as Z with covariance R,

    K = P (P + R)⁻¹,    T ← T exp(K log(T⁻¹ Z)),    Σ = (I - K) P,

and where clouds slide, R is large and odometry stands. Covariances (6, 6) are of a small motion in the moved frame's
own axes, rotation (rad) before translation (m).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import Config, RegistrationConfig
from radioslam.point_cloud.clouds import read_cloud
from radioslam.point_cloud.local_map import LocalMap
from radioslam.point_cloud.odometry_edges import odometry_covariance
from radioslam.point_cloud.recordings import CloudSteps, Recording
from radioslam.point_cloud.spatial_graph import moved
from radioslam.point_cloud.surface import Surface
from radioslam.progress import Tell

Array = NDArray[np.float64]

GATE = 22.5
"""Of the squared normalized difference (six degrees of freedom): one right registration in a thousand lies beyond."""


def follow_clouds(
    recording: Recording,
    config: Config,
    planar: bool,
    metres_per_unit: float = 1.0,
    tell: Tell = lambda text, done, total: None,
) -> Recording:
    """The recording with odometry as its clouds correct it, at their times and its own, and how well steps are known.

    Args:
        recording: with raw odometry.
        config: ``reference.local_map_m`` and its likes; every limit of ``registration``.
        planar: keep heights, and stay upright.
        metres_per_unit: of the clouds' coordinates.
        tell: is told what is being done.

    Raises:
        LogError: a cloud cannot be read.
    """
    settings, mount, odometry = config.reference, recording.T_body_sensor, recording.body_at_clouds()
    local = LocalMap(settings, local_limits(config))
    poses: list[Array] = []
    covariances, registered = [], []
    for k, path in enumerate(recording.clouds):
        tell(f"following {path.name}", k, len(recording.clouds))
        frame = local.frame(read_cloud(path, metres_per_unit))
        before = max(k - 1, 0)
        step = rigid.inverse(odometry[before]) @ odometry[k]
        T = poses[before] @ step if k else odometry[0]
        P = odometry_covariance(np.linalg.norm(step[None, :3, 3], axis=1), settings)[0]
        measured = _measured(local, frame, T, P, mount)
        if measured is not None:
            T, P = fuse(T, P, *measured)
        poses.append(_upright(T, odometry[k]) if planar else rigid.proper(T))
        covariances.append(P + _of_the_map(step, config))
        registered.append(measured is not None)
        local.add(frame, poses[k] @ mount)
    return _corrected(recording, np.array(poses), CloudSteps(np.array(covariances), np.array(registered)))


def _measured(local: LocalMap, frame: Surface, T: Array, P: Array, mount: Array) -> tuple[Array, Array] | None:
    """The body's pose and covariance by the local map, if that can be and agrees with the prediction."""
    found = local.measure(frame, T @ mount)
    if found is None:
        return None
    Z, R = found[0] @ rigid.inverse(mount), moved(found[1], mount)
    difference = rigid.to_vector(rigid.inverse(T) @ Z)
    return (Z, R) if difference @ np.linalg.solve(P + R, difference) <= GATE else None


def local_limits(config: Config) -> RegistrationConfig:
    """Registration to the local map looks farther and more coarsely; partners are as near as points can lie.

    What is systematic in clouds is left out of its covariance: it moves the map as it moves the cloud.
    """
    settings, exact = config.reference, {"systematic_sigma_m": 0.0, "systematic_sigma_rad": 0.0}
    coarse = {"voxel_m": settings.local_voxel_m, "match_distance_m": settings.local_voxel_m}
    return config.registration.model_copy(update={"max_range_m": settings.local_range_m} | coarse | exact)


def _of_the_map(step: Array, config: Config) -> Array:
    """What is systematic comes in with each new map, so that its variance grows with the distance moved (6, 6)."""
    limits = config.registration
    variance = np.repeat([limits.systematic_sigma_rad, limits.systematic_sigma_m], 3) ** 2
    return np.asarray(np.linalg.norm(step[:3, 3]) / config.reference.local_map_m * np.diag(variance))


def fuse(T: Array, P: Array, Z: Array, R: Array) -> tuple[Array, Array]:
    """The pose (4, 4) between the predicted and the measured one, and its covariance (6, 6)."""
    gain = np.linalg.solve(P + R, P).T
    return T @ rigid.from_vector(gain @ rigid.to_vector(rigid.inverse(T) @ Z)), P - gain @ P


def _upright(T: Array, odometry: Array) -> Array:
    """The pose in the plane, at the odometry's height."""
    flat = rigid.from_planar(rigid.to_planar(T[None]))[0]
    flat[2, 3] = odometry[2, 3]
    return flat


def _corrected(recording: Recording, poses: Array, steps: CloudSteps) -> Recording:
    time_s = np.union1d(recording.time_s, recording.cloud_s)
    raw = rigid.interpolate(recording.time_s, recording.T_odom_body, time_s)
    path = rigid.bent(time_s, raw, recording.cloud_s, poses)
    return replace(recording, time_s=time_s, T_odom_body=path, steps=steps)
