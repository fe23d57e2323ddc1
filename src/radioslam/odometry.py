"""Walk -> track: planar poses with a known uncertainty, from a tracker or by pedestrian dead reckoning.

Dead reckoning counts steps on the norm of the acceleration, gives each a length (Weinberg 2002) and lays it along
the heading of the phone's y axis. The heading is the integral of the gyroscope's rate about the vertical, slowly
pulled towards the compass: the gyroscope is smooth but drifts, the compass is right on average but bends near steel.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, find_peaks, sosfiltfilt
from scipy.spatial.transform import Rotation

from radioslam import planar
from radioslam.config import OdometryConfig
from radioslam.errors import LogError
from radioslam.walk import Inertial, Signal, Walk

Array = NDArray[np.float64]

RATE_HZ = 50.0
"""Inertial streams are brought to this common rate."""


@dataclass(frozen=True)
class Track:
    """A walk's planar path in its own frame: x east, y north by its own compass, starting at (0, 0).

    Attributes:
        walk: what it was made from.
        time_s: (n,).  poses: (n, 3).
        distance_m: (n,) walked so far.
        translation_variance: (n,) m², heading_variance: (n,) rad²; both grow along the walk, so that the
            difference between two times is the variance of the motion between them.
        log_scale_sigma: standard deviation of the logarithm of the scale that all of the walk's steps share.
    """

    walk: Walk
    time_s: Array
    poses: Array
    distance_m: Array
    translation_variance: Array
    heading_variance: Array
    log_scale_sigma: float

    def at(self, time_s: Array) -> Array:
        """Poses (m, 3) at the given times (m,)."""
        return planar.interpolate(self.time_s, self.poses, time_s)

    def distance_at(self, time_s: Array) -> Array:
        """Metres walked until the given times (m,)."""
        return np.interp(time_s, self.time_s, self.distance_m)

    def motion_sigmas(self, time_s: Array) -> tuple[Array, Array]:
        """Standard deviations (m - 1,) of translation (m) and heading (rad) between consecutive times (m,)."""
        columns = (self.translation_variance, self.heading_variance)
        translation, heading = (np.diff(np.interp(time_s, self.time_s, c)) for c in columns)
        return np.sqrt(translation + 0.05**2), np.sqrt(heading + 0.005**2)


def estimate_odometry(walks: Iterable[Walk], config: OdometryConfig) -> list[Track]:
    """One track per walk: the given odometry where there is one, dead reckoning otherwise."""
    return [estimate_track(walk, config) for walk in walks]


def estimate_track(walk: Walk, config: OdometryConfig) -> Track:
    """The track of one walk.

    Raises:
        LogError: neither odometry nor sensors that give steps and heading.
    """
    if walk.odometry is not None:
        return _tracker(walk, walk.odometry, config)
    if walk.inertial is None:
        raise LogError(walk.path or walk.name, "odometry or inertial sensors", "neither")
    return _dead_reckoning(walk, walk.inertial, config)


def _tracker(walk: Walk, odometry: Signal, config: OdometryConfig) -> Track:
    poses = odometry.values - np.append(odometry.values[0, :2], 0.0)
    distance = planar.path_length(poses[:, :2])
    return Track(
        walk,
        odometry.time_s,
        poses,
        distance,
        distance * config.tracker_translation_sigma**2,
        distance * config.tracker_heading_sigma_rad**2,
        config.tracker_scale_sigma,
    )


def _dead_reckoning(walk: Walk, inertial: Inertial, config: OdometryConfig) -> Track:
    time_s = _common_clock(inertial.accelerometer)
    norm = np.linalg.norm(_resample(inertial.accelerometer, time_s), axis=1)
    steps = detect_steps(norm, config)
    length = step_lengths(norm, steps, config)
    heading = phone_heading(walk, inertial, time_s, config)
    middle = np.interp(time_s[steps] - np.diff(time_s[steps], prepend=time_s[0]) / 2, time_s, heading)
    moves = length[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    at_steps = np.vstack([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    clock = np.concatenate([time_s[:1], time_s[steps], time_s[-1:]])
    positions = np.vstack([at_steps, at_steps[-1:]])
    poses = np.column_stack([positions, planar.wrap(np.interp(clock, time_s, heading))])
    count = np.concatenate([np.arange(len(steps) + 1.0), [len(steps)]])
    spread = np.cumsum(np.concatenate([[0.0], (config.step_length_sigma * length) ** 2, [0.0]]))
    turning = count * config.step_heading_sigma_rad**2
    return Track(walk, clock, poses, planar.path_length(positions), spread, turning, config.step_scale_sigma)


def detect_steps(norm_mps2: Array, config: OdometryConfig) -> NDArray[np.int64]:
    """Sample indices (n_steps,) of the steps: peaks of the band-passed acceleration norm (n,) at ``RATE_HZ``."""
    if len(norm_mps2) < 2 * RATE_HZ:
        return np.zeros(0, np.int64)
    sections = butter(2, config.step_band_hz, "bandpass", fs=RATE_HZ, output="sos")
    smooth = sosfiltfilt(sections, norm_mps2)
    apart = max(1, round(config.step_interval_s * RATE_HZ))
    return find_peaks(smooth, height=config.step_peak_mps2, distance=apart)[0].astype(np.int64)


def step_lengths(norm_mps2: Array, steps: NDArray[np.int64], config: OdometryConfig) -> Array:
    """Length (n_steps,) in metres of each step.

    Weinberg (2002): k · (a_max - a_min)^(1/4) with the extremes of the acceleration norm since the step before.
    """
    if config.step_length == "constant" or not len(steps):
        return np.full(len(steps), config.typical_step_m)
    longest = round(RATE_HZ)
    begin = np.maximum(np.concatenate([[0], steps[:-1]]), steps - longest)
    edges = np.column_stack([begin, steps]).ravel()
    bounce = (np.maximum.reduceat(norm_mps2, edges) - np.minimum.reduceat(norm_mps2, edges))[::2] ** 0.25
    if config.step_length == "relative":
        return config.typical_step_m * bounce / np.median(bounce)
    return config.weinberg_constant * bounce


def phone_heading(walk: Walk, inertial: Inertial, time_s: Array, config: OdometryConfig) -> Array:
    """Heading (n,) in rad, continuous, counter-clockwise from east, of the phone's forward axis.

    Forward is the y axis (top edge) of a phone held flat and the back of one held upright, whichever is nearer the
    horizontal over the walk.

    Raises:
        LogError: no rotation vector and nothing to make it from.
    """
    attitude = _attitude(walk, inertial, time_s)
    candidates = [attitude.apply([0.0, 1.0, 0.0]), attitude.apply([0.0, 0.0, -1.0])]
    forward = max(candidates, key=lambda axis: float(np.hypot(*axis.T[:2]).mean()))
    compass = np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))
    if config.heading == "rotation_vector" or inertial.gyroscope is None:
        return compass
    rate = attitude.apply(_resample(inertial.gyroscope, time_s))[:, 2]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s))])
    window = 2 * round(config.heading_correction_s * RATE_HZ) + 1
    return turned + _moving_average(compass - turned, window)


def _moving_average(values: Array, window: int) -> Array:
    """Centred mean (n,), over what there is of the window at the ends."""
    kernel = {"size": window, "mode": "constant"}
    return uniform_filter1d(values, **kernel) / uniform_filter1d(np.ones_like(values), **kernel)


def _attitude(walk: Walk, inertial: Inertial, time_s: Array) -> Rotation:
    """Rotations (n,) from phone to world (east, north, up)."""
    if inertial.rotation_vector is not None:
        quaternions = inertial.rotation_vector.values
        nearest = np.searchsorted(inertial.rotation_vector.time_s, time_s).clip(0, len(quaternions) - 1)
        return Rotation.from_quat(quaternions[nearest])
    if inertial.gyroscope is None:
        raise LogError(
            walk.path or walk.name,
            "a rotation vector or a gyroscope for the heading",
            "neither",
            "record one of them",
        )
    return _filtered_attitude(inertial, inertial.gyroscope, time_s)


def _filtered_attitude(inertial: Inertial, gyroscope: Signal, time_s: Array) -> Rotation:
    """Madgwick's filter as kept in imufusion, where the log has no rotation vector."""
    import imufusion

    ahrs, settings = imufusion.Ahrs(), imufusion.AhrsSettings()
    settings.convention, settings.sample_rate = imufusion.CONVENTION_ENU, RATE_HZ
    ahrs.set_settings(settings)
    rate_dps = np.degrees(_resample(gyroscope, time_s))
    gravity_g = _resample(inertial.accelerometer, time_s) / 9.80665
    magnetic = None if inertial.magnetometer is None else _resample(inertial.magnetometer, time_s)
    quaternions = np.empty((len(time_s), 4))
    for k in range(len(time_s)):
        if magnetic is None:
            ahrs.update_no_magnetometer(rate_dps[k], gravity_g[k])
        else:
            ahrs.update(rate_dps[k], gravity_g[k], magnetic[k])
        quaternions[k] = ahrs.get_quaternion()
    return Rotation.from_quat(quaternions, scalar_first=True)


def _common_clock(signal: Signal) -> Array:
    return np.arange(signal.time_s[0], signal.time_s[-1], 1 / RATE_HZ)


def _resample(signal: Signal, time_s: Array) -> Array:
    return np.column_stack([np.interp(time_s, signal.time_s, column) for column in signal.values.T])
