"""Odometry of an imperfect tracker: true motion with a drifting heading and a wrong scale.

After s metres the heading errs by  b s + q W(s)  with a bias b ~ N(0, bias²) per walk and a random walk W,
and every distance is too long by a factor 1 + e with e ~ N(0, scale²) per walk.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.planar import wrap
from radioslam.simulator.streams import random_stream
from radioslam.walk import Signal, Walk

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackerDrift:
    """How far a tracker drifts; the defaults are the protocol for the WiFine recordings.

    Attributes:
        heading_bias_deg_per_m: standard deviation over walks of the steady turn.
        heading_walk_deg_per_sqrt_m: random walk of the heading.
        scale_sd: relative standard deviation over walks of the distance.
    """

    heading_bias_deg_per_m: float = 0.10
    heading_walk_deg_per_sqrt_m: float = 1.2
    scale_sd: float = 0.02


WIFINE_DRIFT = TrackerDrift()


def with_tracker_drift(
    walk: Walk, rng_or_seed: int | np.random.Generator = 0, drift: TrackerDrift = WIFINE_DRIFT
) -> Walk:
    """The walk with simulated odometry along its reference positions.

    Poses stand at the reference's own times and at 1 s steps in between; the first is (0, 0) with the true
    heading. With a seed the generator is derived from the seed and the walk's name, so that neither the order
    of walks nor the presence of others matters.

    Raises:
        LogError: the walk has fewer than two reference positions.
    """
    reference = walk.reference
    if reference is None or len(reference) < 2:
        found = "none" if reference is None or not len(reference) else "one"
        raise LogError(
            walk.path or walk.name, "reference positions along the walk", found, "tracker drift needs a path"
        )
    rng = rng_or_seed
    if not isinstance(rng, np.random.Generator):
        rng = random_stream(rng_or_seed, "tracker", walk.name)
    time_s = pose_times(reference.time_s)
    return replace(walk, odometry=Signal(time_s, drifted_poses(reference.at(time_s), drift, rng)))


def pose_times(reference_s: Array) -> Array:
    """The reference's times (n,) and, in gaps beyond 1 s, every full second after the fix before."""
    gaps = np.diff(reference_s)
    extra = np.maximum(np.ceil(gaps - 1e-9).astype(int) - 1, 0)
    base = np.repeat(reference_s[:-1], extra)
    count = np.arange(extra.sum()) - np.repeat(np.cumsum(extra) - extra, extra) + 1
    return np.unique(np.concatenate([reference_s, base + count]))


def drifted_poses(positions_xy: Array, drift: TrackerDrift, rng: np.random.Generator) -> Array:
    """Poses (n, 3) that a drifting tracker reports for true positions (n, 2)."""
    bias = np.deg2rad(drift.heading_bias_deg_per_m) * rng.standard_normal()
    scale = 1.0 + drift.scale_sd * rng.standard_normal()
    steps = np.diff(positions_xy, axis=0)
    length = np.hypot(*steps.T)
    walk = np.deg2rad(drift.heading_walk_deg_per_sqrt_m) * np.sqrt(length) * rng.standard_normal(len(length))
    # A step is seen with the error at its middle; the pose after it has the error at its end.
    error_after = np.cumsum(bias * length + walk)
    error_during = error_after - (bias * length + walk) / 2
    true_heading = travel_headings(steps)
    seen = true_heading + error_during
    moves = scale * length[:, None] * np.stack([np.cos(seen), np.sin(seen)], axis=1)
    xy = np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    heading = np.concatenate([true_heading[:1], true_heading + error_after])
    return np.column_stack([xy, wrap(heading)])


def travel_headings(steps_xy: Array) -> Array:
    """Direction (n,) of each step (n, 2); standing still keeps the last one (at first: the one to come)."""
    moving = np.hypot(*steps_xy.T) > 1e-6
    if not moving.any():
        return np.zeros(len(steps_xy))
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moving)), -1))
    last[last < 0] = np.argmax(moving)
    return np.arctan2(steps_xy[last, 1], steps_xy[last, 0])
