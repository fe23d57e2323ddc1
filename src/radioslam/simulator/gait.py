"""How a body moves when it walks: steps whose rate, length and bounce hang together.

With speed v a person takes f = f0 sqrt(v / v0) steps a second, each of length L = v / f: faster walking is made in
equal parts of longer and of more frequent steps (Grieve and Gear, 1966). The vertical acceleration swings from
peak to peak by R = (L / K)^4, which is Weinberg's rule L = K (a_max - a_min)^(1/4) (Analog Devices AN-602) read
backwards, so that a pedometer which knows K finds the length of every step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.simulator.walkers import TruePath

Array = NDArray[np.float64]

RATE_HZ = 50.0
"""Samples per second of all inertial streams, the rate of Android's "game" delay."""
TURN_M = 0.3
"""The body faces along the chord from this far behind to this far ahead."""
SETTLING_S = 0.8
"""Width of the window over which starts, stops and turns are spread: about one step."""

_CYCLE = np.linspace(0.0, 2 * np.pi, 3600, endpoint=False)


@dataclass(frozen=True)
class Gait:
    """A person's way of walking.

    Attributes:
        cadence_hz: steps per second at ``cadence_speed_mps``; adults take 1.7-2.0 at 1.3 m/s.
        weinberg_k: K in metres per (m/s²)^(1/4); 0.4-0.55 in published fits.
        second_harmonic: strength of the heel strike's second harmonic in the bounce.
        surge, sway: fore-and-aft (once per step) and sideways (once per two steps) swing over the bounce.
    """

    cadence_hz: float = 1.8
    cadence_speed_mps: float = 1.3
    weinberg_k: float = 0.43
    second_harmonic: float = 0.25
    surge: float = 0.25
    sway: float = 0.12

    def step_rate_hz(self, speed_mps: Array) -> Array:
        """Steps per second (n,) at the speeds (n,)."""
        return np.asarray(self.cadence_hz * np.sqrt(speed_mps / self.cadence_speed_mps))

    def step_length_m(self, speed_mps: Array) -> Array:
        """Length of a step (n,) at the speeds (n,), 0 when standing."""
        rate = self.step_rate_hz(speed_mps)
        return np.divide(speed_mps, rate, out=np.zeros_like(rate), where=rate > 0)

    def bounce_range_mps2(self, speed_mps: Array) -> Array:
        """Vertical acceleration from trough to peak (n,)."""
        return np.asarray((self.step_length_m(speed_mps) / self.weinberg_k) ** 4)

    def bounce(self, phase_rad: Array) -> Array:
        """The vertical acceleration's shape (n,) over the step, of range 1."""
        return self._shape(phase_rad) / float(np.ptp(self._shape(_CYCLE)))

    def _shape(self, phase_rad: Array) -> Array:
        return np.asarray(np.cos(phase_rad) + self.second_harmonic * np.cos(2 * phase_rad + 0.6))


@dataclass(frozen=True)
class BodyMotion:
    """A walking body, sampled at ``RATE_HZ``.

    Attributes:
        time_s: (n,) since the walk's start.  positions_xy: (n, 2).  speed_mps: (n,).
        heading_rad: (n,) unwrapped, counter-clockwise from east.
        step_phase_rad: (n,) 2π per step, from 0.  acceleration_mps2: (n, 3) in the world, without gravity.
    """

    time_s: Array
    positions_xy: Array
    speed_mps: Array
    heading_rad: Array
    step_phase_rad: Array
    acceleration_mps2: Array

    @property
    def step_count(self) -> int:
        """Whole steps taken."""
        return int(self.step_phase_rad[-1] / (2 * np.pi))


def body_motion(path: TruePath, gait: Gait) -> BodyMotion:
    """The body that walks a path: smooth speed and heading, and the swing of its steps."""
    time_s = np.arange(int(path.duration_s * RATE_HZ) + 1) / RATE_HZ
    speed = np.maximum(smooth(np.gradient(path.distance_at(time_s), time_s)), 0.0)
    speed[speed < 1e-3] = 0.0
    heading = body_heading(path, time_s)
    phase = 2 * np.pi * np.cumsum(gait.step_rate_hz(speed)) / RATE_HZ
    swing = gait.bounce_range_mps2(speed)
    forward = np.gradient(speed, time_s) + gait.surge * swing * np.sin(phase)
    # Walking a bend pulls sideways by v dθ/dt; the hips add their sway once in two steps.
    leftward = speed * np.gradient(heading, time_s) + gait.sway * swing * np.sin(phase / 2)
    cos, sin = np.cos(heading), np.sin(heading)
    acceleration = [forward * cos - leftward * sin, forward * sin + leftward * cos, swing * gait.bounce(phase)]
    return BodyMotion(time_s, path.at(time_s), speed, heading, phase, np.stack(acceleration, axis=1))


def body_heading(path: TruePath, time_s: Array) -> Array:
    """Where the body faces (n,), unwrapped; it keeps its direction while standing."""
    along = path.route.distance_m
    walked = path.distance_at(time_s)

    def point(distance_m: Array) -> Array:
        return np.stack([np.interp(distance_m, along, column) for column in path.route.points_xy.T], axis=-1)

    chord = point(walked + TURN_M) - point(walked - TURN_M)
    return smooth(np.unwrap(np.arctan2(chord[:, 1], chord[:, 0])))


def smooth(values: Array) -> Array:
    """Weighted mean (n,) over ``SETTLING_S``; the ends are held."""
    half = int(SETTLING_S * RATE_HZ / 2)
    window = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, window / window.sum(), mode="valid")
