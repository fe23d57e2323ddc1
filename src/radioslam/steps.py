"""Steps and their lengths from the norm of the acceleration.

A step is a peak of the band-passed norm. Its length follows the inverted pendulum (Zijlstra and Hof 1997): the hip
rises and falls by h on a leg of length l, so a step is L = 2 √(2 l h) long; a rise and fall once per step interval T
with an acceleration of a_pp peak to peak has h = a_pp (T / 2π)², hence

    L = (T / π) √(2 l a_pp)  ∝  T √a_pp.

A hand damps the bounce by a factor that belongs to the phone and how it is held, so only the proportion is taken from
the pendulum; the factor makes the median step of all walks with one phone model as long as people's steps are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, find_peaks, sosfiltfilt

from radioslam.config import OdometryConfig
from radioslam.walk import Inertial, Signal

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

RATE_HZ = 50.0
"""Inertial streams are brought to this common rate."""
LONGEST_INTERVAL_S = 0.8
"""A longer time between two steps is a pause."""
TUMBLING_S = 4.0
"""A phone is tumbled about when it turns fast for so long, which no corner makes it do."""


@dataclass(frozen=True)
class Steps:
    """The steps of one walk.

    Attributes:
        time_s: (n,) when each was made.
        bounce: (n,) m/s² peak to peak of the band-passed norm since the step before.
        interval_s: (n,) time since the step before; after a pause the walk's median.
    """

    time_s: Array
    bounce: Array
    interval_s: Array

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def shapes(self) -> Array:
        """(n,) T √a_pp, to which the lengths of one phone model's steps are in proportion."""
        return self.interval_s * np.sqrt(self.bounce)


def common_clock(signal: Signal) -> Array:
    """Times (n,) at ``RATE_HZ`` over a signal."""
    return np.arange(signal.time_s[0], signal.time_s[-1], 1 / RATE_HZ)


def resample(signal: Signal, time_s: Array) -> Array:
    """Values (n, k) of a signal at the times (n,), linear between its samples."""
    return np.column_stack([np.interp(time_s, signal.time_s, column) for column in signal.values.T])


def find_steps(inertial: Inertial, config: OdometryConfig) -> Steps:
    """The steps of one walk from its accelerometer, (n, 3) m/s², while its phone is not tumbled about."""
    time_s = common_clock(inertial.accelerometer)
    norm = np.linalg.norm(resample(inertial.accelerometer, time_s), axis=1)
    if len(norm) < 2 * RATE_HZ:
        return Steps(np.zeros(0), np.zeros(0), np.zeros(0))
    smooth = sosfiltfilt(butter(2, config.step_band_hz, "bandpass", fs=RATE_HZ, output="sos"), norm)
    apart = max(1, round(config.step_interval_s * RATE_HZ))
    peaks = find_peaks(smooth, height=config.step_peak_mps2, distance=apart)[0]
    peaks = peaks[~_tumbling(inertial, time_s, config.tumbling_radps)[peaks]]
    return Steps(time_s[peaks], *_bounce_and_interval(smooth, peaks))


def _tumbling(inertial: Inertial, time_s: Array, limit_radps: float) -> NDArray[np.bool_]:
    """When (n,) the phone turns faster than a walker turns it, by the root mean square over ``TUMBLING_S``.

    Whoever calibrates a compass by waving the phone in eights stands while it counts steps.
    """
    if inertial.gyroscope is None:
        return np.zeros(len(time_s), dtype=np.bool_)
    rate_squared = np.sum(resample(inertial.gyroscope, time_s) ** 2, axis=1)
    return uniform_filter1d(rate_squared, round(TUMBLING_S * RATE_HZ), mode="nearest") > limit_radps**2


def _bounce_and_interval(smooth: Array, peaks: Integers) -> tuple[Array, Array]:
    if not len(peaks):
        return np.zeros(0), np.zeros(0)
    begin = np.maximum(np.append(0, peaks[:-1]), peaks - round(RATE_HZ))
    edges = np.column_stack([begin, peaks]).ravel()
    bounce = (np.maximum.reduceat(smooth, edges) - np.minimum.reduceat(smooth, edges))[::2]
    interval = np.diff(peaks, prepend=-len(smooth)) / RATE_HZ
    steady = interval <= LONGEST_INTERVAL_S
    usual = float(np.median(interval[steady])) if steady.any() else LONGEST_INTERVAL_S
    return bounce, np.where(steady, interval, usual)


def step_lengths(walks: Sequence[Steps], devices: Sequence[str], config: OdometryConfig) -> list[Array]:
    """Length in metres of every step (n,) of every walk; ``devices`` are the walks' phone models.

    ``pendulum``: in proportion to T √a_pp, the median over each model's walks being ``typical_step_m``;
    ``weinberg``: k · a_pp^(1/4) (Weinberg 2002);  ``constant``: ``typical_step_m``.
    """
    if config.step_length == "constant":
        return [np.full(len(steps), config.typical_step_m) for steps in walks]
    if config.step_length == "weinberg":
        return [config.weinberg_constant * steps.bounce**0.25 for steps in walks]
    factor = metres_per_shape([steps.shapes for steps in walks], devices, config)
    return [factor[name] * steps.shapes for steps, name in zip(walks, devices, strict=True)]


def metres_per_shape(shapes: Sequence[Array], devices: Sequence[str], config: OdometryConfig) -> dict[str, float]:
    """The factor of each phone model: the median step (n,) over its walks is ``typical_step_m``."""
    return {name: config.typical_step_m / _median_of(shapes, devices, name) for name in set(devices)}


def _median_of(shapes: Sequence[Array], devices: Sequence[str], name: str) -> float:
    of_device = np.concatenate([shape for shape, device in zip(shapes, devices, strict=True) if device == name])
    return float(np.median(of_device)) if len(of_device) else 1.0
