"""Planar rigid motions, SE(2), on arrays.

A pose is (x, y, θ): metres, metres, radians counter-clockwise from the x axis (east), so that the point p of
the pose's own frame lies at R(θ) p + (x, y). Every function takes poses of shape (..., 3) and broadcasts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def wrap(angle: ArrayLike) -> Array:
    """Bring angles (rad, any shape) into [-π, π)."""
    wrapped = (np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(np.where(wrapped >= np.pi, -np.pi, wrapped))  # the remainder may round up to 2π


def rotate(theta: ArrayLike, points_xy: ArrayLike) -> Array:
    """R(θ) p for points (..., 2) and angles (...,)."""
    c, s = np.cos(theta), np.sin(theta)
    p = np.asarray(points_xy, dtype=float)
    return np.stack([c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]], axis=-1)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """a ∘ b: the pose b, given in the frame of a, seen from outside. Shapes (..., 3)."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    xy = a[..., :2] + rotate(a[..., 2], b[..., :2])
    return np.concatenate([xy, wrap(a[..., 2:] + b[..., 2:])], axis=-1)


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """a⁻¹ ∘ b: the pose b seen from a. Shapes (..., 3)."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    xy = rotate(-a[..., 2], b[..., :2] - a[..., :2])
    return np.concatenate([xy, wrap(b[..., 2:] - a[..., 2:])], axis=-1)


def inverse(a: ArrayLike) -> Array:
    """a⁻¹, shape (..., 3)."""
    a = np.asarray(a, dtype=float)
    return between(a, np.zeros_like(a))


def interpolate(time_s: Array, poses: Array, at_s: Array) -> Array:
    """Poses (m, 3) at the times ``at_s`` (m,), linear in x, y and along the shorter arc in θ.

    ``time_s`` (n,) must not decrease; outside of it the first or last pose holds.
    """
    heading = np.unwrap(poses[:, 2])
    columns = [np.interp(at_s, time_s, column) for column in (poses[:, 0], poses[:, 1], heading)]
    return np.stack([columns[0], columns[1], wrap(columns[2])], axis=-1)


def path_length(positions_xy: Array) -> Array:
    """Distance walked up to each point, (n,), starting at 0, for a path (n, 2)."""
    steps = np.hypot(*np.diff(positions_xy, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def align_rigid(source_xy: Array, target_xy: Array) -> Array:
    """The pose T_target_source (3,) that brings points (n, 2) nearest to their partners; no scale.

    Least squares over SE(2) in closed form (Umeyama 1991 without scale). Fewer than two distinct points leave
    the rotation at zero.
    """
    source_mean, target_mean = source_xy.mean(axis=0), target_xy.mean(axis=0)
    a, b = source_xy - source_mean, target_xy - target_mean
    theta = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    return np.concatenate([target_mean - rotate(theta, source_mean), [theta]])


def transform(pose: Any, points_xy: Array) -> Array:
    """Points (n, 2) of the pose's frame, seen from outside."""
    pose = np.asarray(pose, dtype=float)
    return rotate(pose[2], points_xy) + pose[:2]
