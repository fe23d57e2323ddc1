"""Where a phone heads: the gyroscope's turns, held to the compass by a slow robust average.

The integral of the gyroscope's rate about the vertical is smooth but drifts and has no north; the compass is right on
average but bends near steel, by tens of degrees over tens of metres. Their difference is averaged over a window long
enough for the bends to cancel and short enough for the drift, with weights that leave aside what is far from the rest,
as while somebody shakes the phone to calibrate it.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation

from radioslam.config import OdometryConfig
from radioslam.errors import LogError
from radioslam.steps import RATE_HZ, resample
from radioslam.walk import Inertial, Signal, Walk

Array = NDArray[np.float64]

GRID_S = 0.5
"""The difference between compass and gyroscope is averaged at this spacing."""
OUTLIER_RAD = np.radians(30.0)
"""Scale of the Cauchy weights of that average."""
SMOOTHING_S = 5.0
"""Width over which its remaining steps are smoothed."""


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
    rate = attitude.apply(resample(inertial.gyroscope, time_s))[:, 2]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s))])
    return turned + slow_average(compass - turned, config.heading_correction_s)


def slow_average(difference: Array, half_width_s: float) -> Array:
    """Robust average (n,) of angles (n,) at ``RATE_HZ`` within so many seconds to either side.

    On a coarse grid: the median of the window, three times reweighted by 1 / (1 + (e / ``OUTLIER_RAD``)²).
    """
    step, half = round(GRID_S * RATE_HZ), round(half_width_s / GRID_S)
    coarse = difference[::step]
    half = min(half, len(coarse))
    windows = sliding_window_view(np.pad(coarse, half, constant_values=np.nan), 2 * half + 1)
    centre = np.nanmedian(windows, axis=1)
    inside = np.isfinite(windows)
    for _ in range(3):
        weight = inside / (1.0 + np.where(inside, windows - centre[:, None], 0.0) ** 2 / OUTLIER_RAD**2)
        centre = np.sum(np.where(inside, windows, 0.0) * weight, axis=1) / weight.sum(axis=1)
    centre = uniform_filter1d(centre, 2 * round(SMOOTHING_S / 2 / GRID_S) + 1, mode="nearest")
    return np.interp(np.arange(len(difference)), step * np.arange(len(coarse)), centre)


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
    rate_dps = np.degrees(resample(gyroscope, time_s))
    gravity_g = resample(inertial.accelerometer, time_s) / 9.80665
    magnetic = None if inertial.magnetometer is None else resample(inertial.magnetometer, time_s)
    quaternions = np.empty((len(time_s), 4))
    for k in range(len(time_s)):
        if magnetic is None:
            ahrs.update_no_magnetometer(rate_dps[k], gravity_g[k])
        else:
            ahrs.update(rate_dps[k], gravity_g[k], magnetic[k])
        quaternions[k] = ahrs.get_quaternion()
    return Rotation.from_quat(quaternions, scalar_first=True)
