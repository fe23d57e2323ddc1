"""What odometry says of the motion between nodes, and how well it knows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import ReferenceConfig
from radioslam.point_cloud.nodes import Nodes
from radioslam.point_cloud.recordings import Recording
from radioslam.point_cloud.spatial_graph import SpatialEdges, moved

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

LEAST_MOVED_M = 0.01
"""Variances do not begin at nothing: who stands still turns and sways."""


def odometry_covariance(moved_m: Array, config: ReferenceConfig) -> Array:
    """Covariances (m, 6, 6) of raw odometry over distances (m,), with which variances grow."""
    variance = np.repeat([config.odometry_rotation_sigma_rad**2, config.odometry_translation_sigma_m**2], 3)
    return np.asarray(np.maximum(moved_m, LEAST_MOVED_M)[:, None, None] * np.diag(variance))


def odometry_edges(nodes: Nodes, recordings: Sequence[Recording], config: ReferenceConfig) -> SpatialEdges:
    """From each node to the next of its walk."""
    i = np.flatnonzero(nodes.walk[:-1] == nodes.walk[1:])
    covariance = odometry_covariance(nodes.distance_m[i + 1] - nodes.distance_m[i], config)
    for k, recording in enumerate(recordings):
        mine = np.flatnonzero(nodes.walk[i] == k)
        if recording.steps is not None:
            poses, steps = recording.body_at_clouds(), recording.steps.covariance
            ends = nodes.cloud[i[mine]], nodes.cloud[i[mine] + 1]
            covariance[mine] = [joined_steps(poses, steps, a, b) for a, b in zip(*ends, strict=True)]
    return SpatialEdges(i, i + 1, rigid.inverse(nodes.T_odom_body[i]) @ nodes.T_odom_body[i + 1], covariance)


def joined_steps(T_odom_body: Array, steps: Array, start: int, end: int) -> Array:
    """Covariance (6, 6) of the motion from pose ``start`` to ``end``, of its steps' (n, 6, 6)."""
    along = slice(start + 1, end + 1)
    T_end_step = rigid.inverse(T_odom_body[end]) @ T_odom_body[along]
    return np.asarray(moved(steps[along], T_end_step).sum(axis=0))
