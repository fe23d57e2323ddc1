"""Walk -> track: planar poses with a known uncertainty, from a tracker or by pedestrian dead reckoning.

Dead reckoning counts steps, gives each a length (``steps``) and lays it along the heading of the phone (``heading``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import OdometryConfig
from radioslam.errors import LogError
from radioslam.heading import phone_heading
from radioslam.steps import Steps, common_clock, find_steps, metres_per_shape, step_lengths
from radioslam.walk import Inertial, Signal, Walk

Array = NDArray[np.float64]


VELOCITY_S = 1.5


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
        step_shapes: (k,) what the length of each step is in proportion to, where the factor is the phone model's and
            was learned from walks; else empty.
    """

    walk: Walk
    time_s: Array
    poses: Array
    distance_m: Array
    translation_variance: Array
    heading_variance: Array
    log_scale_sigma: float
    step_shapes: Array = field(default_factory=lambda: np.zeros(0))

    def at(self, time_s: Array) -> Array:
        """Poses (m, 3) at the given times (m,)."""
        return planar.interpolate(self.time_s, self.poses, time_s)

    def velocity(self, time_s: Array) -> Array:
        """m/s (m, 2) in the track's own frame at the given times (m,), over ``VELOCITY_S`` to either side."""
        before, after = self.at(time_s - VELOCITY_S), self.at(time_s + VELOCITY_S)
        return (after[:, :2] - before[:, :2]) / (2 * VELOCITY_S)

    def distance_at(self, time_s: Array) -> Array:
        """Metres walked until the given times (m,)."""
        return np.interp(time_s, self.time_s, self.distance_m)

    def motion_sigmas(self, time_s: Array) -> tuple[Array, Array]:
        """Standard deviations (m - 1,) of translation (m) and heading (rad) between consecutive times (m,)."""
        columns = (self.translation_variance, self.heading_variance)
        translation, heading = (np.diff(np.interp(time_s, self.time_s, c)) for c in columns)
        return np.sqrt(translation + 0.05**2), np.sqrt(heading + 0.005**2)


def estimate_odometry(walks: Sequence[Walk], config: OdometryConfig) -> list[Track]:
    """One track per walk: the given odometry where there is one, dead reckoning otherwise.

    Raises:
        LogError: neither odometry nor sensors that give steps and heading.
    """
    return [*_tracks(walks, config)]


def estimate_track(walk: Walk, config: OdometryConfig) -> Track:
    """The track of one walk by itself: its own steps alone say what its phone makes of a step.

    Raises:
        LogError: neither odometry nor sensors that give steps and heading.
    """
    return estimate_odometry([walk], config)[0]


def pooled(tracks: Sequence[Track], config: OdometryConfig) -> list[Track]:
    """Tracks whose steps all walks of a phone model scale together, as if they had been estimated at once."""
    shapes, devices = [track.step_shapes for track in tracks], [track.walk.device for track in tracks]
    factor = metres_per_shape(shapes, devices, config)
    return [_stretched(track, factor[track.walk.device]) for track in tracks]


def scaled_like(track: Track, others: Sequence[Track], config: OdometryConfig) -> Track:
    """A track with the step factor that it and others of the same phone model share."""
    shapes = [one.step_shapes for one in (*others, track)]
    device = track.walk.device
    return _stretched(track, metres_per_shape(shapes, [device] * len(shapes), config)[device])


def _stretched(track: Track, metres_per_shape: float) -> Track:
    if not track.step_shapes.any():
        return track
    ratio = metres_per_shape * track.step_shapes.sum() / track.distance_m[-1]
    return replace(
        track,
        poses=track.poses * np.array([ratio, ratio, 1.0]),
        distance_m=track.distance_m * ratio,
        translation_variance=track.translation_variance * ratio**2,
    )


def _tracks(walks: Sequence[Walk], config: OdometryConfig) -> Iterator[Track]:
    reckoned = [walk for walk in walks if walk.odometry is None]
    steps = [find_steps(_inertial(walk), config) for walk in reckoned]
    lengths = step_lengths(steps, [walk.device for walk in reckoned], config)
    of_walk = iter(zip(steps, lengths, strict=True))
    for walk in walks:
        if walk.odometry is not None:
            yield _tracker(walk, walk.odometry, config)
        else:
            yield _dead_reckoning(walk, *next(of_walk), config)


def _inertial(walk: Walk) -> Inertial:
    if walk.inertial is None:
        raise LogError(walk.path or walk.name, "odometry or inertial sensors", "neither")
    return walk.inertial


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


def _dead_reckoning(walk: Walk, steps: Steps, length_m: Array, config: OdometryConfig) -> Track:
    inertial = _inertial(walk)
    time_s = common_clock(inertial.accelerometer)
    heading = phone_heading(walk, inertial, time_s, config)
    middle = np.interp(steps.time_s - np.diff(steps.time_s, prepend=time_s[0]) / 2, time_s, heading)
    moves = length_m[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    at_steps = np.vstack([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    clock = np.concatenate([time_s[:1], steps.time_s, time_s[-1:]])
    positions = np.vstack([at_steps, at_steps[-1:]])
    poses = np.column_stack([positions, planar.wrap(np.interp(clock, time_s, heading))])
    count = np.concatenate([np.arange(len(steps) + 1.0), [len(steps)]])
    spread = np.cumsum(np.concatenate([[0.0], (config.step_length_sigma * length_m) ** 2, [0.0]]))
    turning = count * config.step_heading_sigma_rad**2
    shapes = steps.shapes if config.step_length == "pendulum" else np.zeros(0)
    return Track(walk, clock, poses, planar.path_length(positions), spread, turning, config.step_scale_sigma, shapes)
