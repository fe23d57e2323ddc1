"""A phone in a walking hand: its accelerometer, gyroscope, magnetometer and rotation vector.

World axes are east, north, up. The phone's are Android's: x to the right, y to the top edge, z out of the screen;
people hold it in front of them with the top edge forward and raised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from radioslam.simulator.gait import RATE_HZ, BodyMotion, Gait, body_motion
from radioslam.simulator.shadowing import ShadowFields, shadow_fields
from radioslam.simulator.walkers import TruePath
from radioslam.walk import Inertial, Signal

Array = NDArray[np.float64]

GRAVITY_MPS2 = 9.81
EARTH_FIELD_UT = np.array([0.0, 20.0, -44.0])
"""East, north, up: horizontal strength and dip of the mid northern latitudes."""


@dataclass(frozen=True)
class PhoneSensors:
    """Errors of a mid-range phone's sensors; standard deviations, white noise per 50 Hz sample.

    Attributes:
        accelerometer_noise_mps2, accelerometer_bias_mps2: tremor of the hand included in the noise.
        gyroscope_noise_radps, gyroscope_bias_radps: bias left after Android's calibration.
        magnetometer_noise_ut, magnetometer_bias_ut: bias is hard iron left after calibration.
        steel_ut: disturbance of each horizontal component by the building; a few µT beside reinforced concrete.
        steel_correlation_m: distance over which its correlation falls to 1/e.
        fusion_s: time constant with which the rotation vector follows the (disturbed) magnetic north.
        heading_bias_deg: what remains of magnetic declination and calibration, per walk.
        heading_noise_deg: white noise of the rotation vector's heading.
        hold_yaw_deg, hold_pitch_deg, hold_sd_deg: the top edge's yaw from the walking direction (spread), how
            high it is raised (mean), and the spread of pitch and roll.
        wobble_deg: amplitude with which steps turn the phone.
    """

    accelerometer_noise_mps2: float = 0.08
    accelerometer_bias_mps2: float = 0.05
    gyroscope_noise_radps: float = 0.005
    gyroscope_bias_radps: float = 0.001
    magnetometer_noise_ut: float = 0.4
    magnetometer_bias_ut: float = 0.7
    steel_ut: float = 2.0
    steel_correlation_m: float = 3.0
    fusion_s: float = 8.0
    heading_bias_deg: float = 2.0
    heading_noise_deg: float = 0.3
    hold_yaw_deg: float = 3.0
    hold_pitch_deg: float = 35.0
    hold_sd_deg: float = 5.0
    wobble_deg: float = 2.0


def steel_fields(sensors: PhoneSensors, rng: np.random.Generator) -> ShadowFields:
    """The two horizontal components of a floor's magnetic disturbance, as fields of unit variance."""
    return shadow_fields(np.arange(2), sensors.steel_correlation_m, 0.0, rng)


def inertial_streams(
    path: TruePath, start_s: float, steel: ShadowFields, sensors: PhoneSensors, rng: np.random.Generator
) -> Inertial:
    """Sensor streams at 50 Hz of a person who walks the path with a gait of her own."""
    gait = Gait(cadence_hz=1.8 + 0.05 * rng.standard_normal(), weinberg_k=0.43 + 0.015 * rng.standard_normal())
    motion = body_motion(path, gait)
    attitude = hand_attitude(motion, sensors, rng)
    field = EARTH_FIELD_UT + np.pad(
        sensors.steel_ut * steel.at(motion.positions_xy, np.ones((len(motion.time_s), 2), dtype=bool)),
        ((0, 0), (0, 1)),
    )
    force = motion.acceleration_mps2 + np.array([0.0, 0.0, GRAVITY_MPS2])
    turning = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * RATE_HZ
    clean = {
        "accelerometer": attitude.inv().apply(force),
        "gyroscope": np.concatenate([turning[:1], turning]),
        "magnetometer": attitude.inv().apply(field),
    }
    errors = {
        "accelerometer": (sensors.accelerometer_bias_mps2, sensors.accelerometer_noise_mps2),
        "gyroscope": (sensors.gyroscope_bias_radps, sensors.gyroscope_noise_radps),
        "magnetometer": (sensors.magnetometer_bias_ut, sensors.magnetometer_noise_ut),
    }
    clock = start_s + motion.time_s
    streams = {name: Signal(clock, _noisy(clean[name], *errors[name], rng)) for name in clean}
    rotation = reported_rotation(attitude, field, sensors, rng)
    return Inertial(rotation_vector=Signal(clock, rotation), **streams)


def hand_attitude(motion: BodyMotion, sensors: PhoneSensors, rng: np.random.Generator) -> Rotation:
    """Rotation from phone to world at every sample: the hand's constant hold, turned by the body and its steps."""
    yaw, pitch, roll = np.deg2rad(
        [sensors.hold_yaw_deg, sensors.hold_sd_deg, sensors.hold_sd_deg] * rng.standard_normal(3)
    )
    pitch += np.deg2rad(sensors.hold_pitch_deg)
    # The wobble fades with the speed: a standing person holds still.
    wobble = np.deg2rad(sensors.wobble_deg) * np.minimum(motion.speed_mps, 1.0)
    angles = [
        motion.heading_rad - np.pi / 2 + yaw + wobble * np.sin(motion.step_phase_rad / 2),
        pitch + 0.5 * wobble * np.sin(motion.step_phase_rad),
        np.full(len(motion.time_s), roll),
    ]
    return Rotation.from_euler("ZXY", np.stack(angles, axis=1))


def reported_rotation(attitude: Rotation, field_ut: Array, sensors: PhoneSensors, rng: np.random.Generator) -> Array:
    """Quaternions (n, 4) that a phone reports: the truth, turned by how far its magnetic north is off."""
    deviation = np.arctan2(field_ut[:, 0], field_ut[:, 1])
    share = 1.0 - np.exp(-1.0 / (RATE_HZ * sensors.fusion_s))
    # A filter in its steady state before the walk: it starts on the local deviation.
    followed, _ = lfilter([share], [1.0, share - 1.0], deviation, zi=[(1.0 - share) * deviation[0]])
    bias = sensors.heading_bias_deg * rng.standard_normal()
    noise = sensors.heading_noise_deg * rng.standard_normal(len(deviation))
    error = followed + np.deg2rad(bias + noise)
    return np.asarray((Rotation.from_euler("z", error[:, None]) * attitude).as_quat())


def _noisy(values: Array, bias_sd: float, noise_sd: float, rng: np.random.Generator) -> Array:
    bias = bias_sd * rng.standard_normal(3)
    return np.asarray(values + bias + noise_sd * rng.standard_normal(values.shape))
