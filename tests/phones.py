"""Inertial streams of a phone that is carried along."""

import numpy as np
from scipy.spatial.transform import Rotation

from radioslam.steps import RATE_HZ
from radioslam.walk import Inertial, Signal, Walk

from .builders import scans_at

GRAVITY = 9.81
STEP_HZ = 1.8
EARTH_FIELD_UT = np.array([0.0, 20.0, -44.0])


def clock(duration_s):
    return np.arange(0, duration_s, 1 / RATE_HZ)


def bouncing(time_s, bounce=2.0):
    """Norm of the acceleration of somebody who makes STEP_HZ steps per second."""
    return GRAVITY + bounce * np.sin(2 * np.pi * STEP_HZ * time_s)


def attitude(heading, upright=False):
    """Phone to world: flat with the top edge forward, or upright with its back forward."""
    turn = Rotation.from_rotvec((np.asarray(heading) - np.pi / 2)[:, None] * np.array([0.0, 0.0, 1.0]))
    return turn * Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]) if upright else turn


def phone(
    heading, time_s, bounce=2.0, compass=None, drift_radps=0.0, upright=False, rotation_vector=True, magnet=False
):
    """Inertial streams of a walk with the given true heading (n,); the compass shows the same unless told."""
    true = attitude(heading, upright)
    gravity = true.inv().apply(np.array([0.0, 0.0, 1.0]))
    rate = np.gradient(heading, time_s) + drift_radps
    turning = true.inv().apply(np.array([0.0, 0.0, 1.0])) * rate[:, None]
    shown = attitude(heading if compass is None else compass, upright)
    return Inertial(
        Signal(time_s, gravity * bouncing(time_s, bounce)[:, None]),
        Signal(time_s, turning),
        Signal(time_s, true.inv().apply(EARTH_FIELD_UT)) if magnet else None,
        Signal(time_s, shown.as_quat()) if rotation_vector else None,
    )


def inertial_walk(inertial):
    return Walk("phone", scans_at([1.0]), inertial=inertial)
