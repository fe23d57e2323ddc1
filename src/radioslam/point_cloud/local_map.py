"""The clouds along the last metres of a walk as one surface, against which the next cloud is registered."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import ReferenceConfig, RegistrationConfig
from radioslam.point_cloud.registration import icp_covariance, matched_points, within_range
from radioslam.point_cloud.surface import Surface, make_surface, refine

Array = NDArray[np.float64]


class LocalMap:
    """Holds a cloud per key frame of the last ``local_map_m``, where each has been corrected to."""

    def __init__(self, settings: ReferenceConfig, limits: RegistrationConfig) -> None:
        self.settings, self.limits = settings, limits
        self.frames: deque[tuple[Array, Array]] = deque()
        self.surface = Surface(np.zeros((0, 3)), np.zeros((0, 3)), limits.normal_neighbours)

    def frame(self, points: Array) -> Surface:
        """A cloud (n, 3) in its sensor's frame, ready for ``measure`` and ``add``."""
        near = within_range(points, self.limits.max_range_m)
        return make_surface(near, self.limits.voxel_m, self.limits.normal_neighbours)

    def measure(self, frame: Surface, T_odom_sensor: Array) -> tuple[Array, Array] | None:
        """Pose (4, 4) and covariance (6, 6) of a cloud's sensor, from a predicted pose; None where too little matches.

        ICP looks first as far as the prediction may be wrong, then no farther than points of one surface lie apart.
        Directions that nothing holds have ten metres of standard deviation.
        """
        limits = self.limits
        if min(len(self.surface), len(frame)) <= limits.normal_neighbours:
            return None
        T_odom_map = self.frames[-1][0]
        T = rigid.inverse(T_odom_map) @ T_odom_sensor
        for reach_m in (limits.icp_reach_m, 2 * limits.voxel_m):
            T = refine(self.surface, frame, T, reach_m, limits.icp_points, limits.icp_iterations)
        matched, index = matched_points(self.surface, frame, T, limits)
        if matched.mean() <= limits.least_matched:
            return None
        return T_odom_map @ T, icp_covariance(self.surface, frame, T, index, matched, limits)

    def add(self, frame: Surface, T_odom_sensor: Array) -> None:
        """Take a corrected cloud in, if it is far enough from the last one, and leave out what is far behind."""
        if self.frames and self._near(T_odom_sensor):
            return
        self.frames.append((T_odom_sensor, frame.points))
        while self._length_m() > self.settings.local_map_m:
            self.frames.popleft()
        here = rigid.inverse(T_odom_sensor)
        points = np.concatenate([rigid.transform(here @ T, points) for T, points in self.frames])
        self.surface = make_surface(points, self.limits.voxel_m, self.limits.normal_neighbours)

    def _near(self, T_odom_sensor: Array) -> bool:
        moved_m, turned_rad = rigid.apart(self.frames[-1][0], T_odom_sensor)
        return bool(moved_m < self.settings.key_frame_m and turned_rad < self.settings.key_frame_rad)

    def _length_m(self) -> float:
        """Of the path through the clouds that are held."""
        at = np.array([T[:3, 3] for T, _ in self.frames])
        return float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
