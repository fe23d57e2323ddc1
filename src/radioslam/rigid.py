"""Rigid motions in space, SE(3), as 4 × 4 matrices.

``T_a_b`` brings a point of frame b into frame a: p_a = R p_b + t. Every function broadcasts over leading axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def motion(rotation: Array, translation: Array) -> Array:
    """(..., 4, 4) from rotations (..., 3, 3) and translations (..., 3)."""
    T = np.zeros((*np.shape(translation)[:-1], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotation, translation, 1.0
    return T


def inverse(T: Array) -> Array:
    """T⁻¹ by transposing the rotation."""
    back = np.swapaxes(T[..., :3, :3], -1, -2)
    return motion(back, -np.einsum("...ij,...j->...i", back, T[..., :3, 3]))


def transform(T: Array, points: Array) -> Array:
    """Points (n, 3) under motions (..., 4, 4), shape (..., n, 3)."""
    moved: Array = points @ np.swapaxes(T[..., :3, :3], -1, -2) + T[..., None, :3, 3]
    return moved


def angle(T: Array) -> Array:
    """Angle of rotation (...,) in radians: the sine from the antisymmetric part, the cosine from the trace."""
    R = T[..., :3, :3]
    axis = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    turned: Array = np.arctan2(np.linalg.norm(axis, axis=-1), np.trace(R, axis1=-2, axis2=-1) - 1.0)
    return turned


def apart(T_a: Array, T_b: Array) -> tuple[Array, Array]:
    """How far two motions differ: metres between their origins and radians between their axes, each (...,)."""
    metres: Array = np.linalg.norm(T_a[..., :3, 3] - T_b[..., :3, 3], axis=-1)
    return metres, angle(inverse(T_a) @ T_b)


def fit(source: Array, target: Array) -> Array:
    """The motions (..., 4, 4) that bring points (..., n, 3) nearest to their partners, by SVD.

    With A = Σ (target - mean)(source - mean)ᵀ = U S Vᵀ the rotation is U diag(1, 1, det U Vᵀ) Vᵀ (Arun et al. 1987,
    Umeyama 1991).
    """
    source_mean, target_mean = source.mean(axis=-2), target.mean(axis=-2)
    A = np.swapaxes(target - target_mean[..., None, :], -1, -2) @ (source - source_mean[..., None, :])
    U, _, Vt = np.linalg.svd(A)
    U[..., :, 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    R = U @ Vt
    return motion(R, target_mean - np.einsum("...ij,...j->...i", R, source_mean))


def from_quaternions(translation: Array, quaternions: Array) -> Array:
    """(n, 4, 4) from (n, 3) metres and quaternions x, y, z, w (n, 4) of any length."""
    return motion(Rotation.from_quat(quaternions).as_matrix(), translation)


def quaternions(T: Array) -> Array:
    """Unit quaternions x, y, z, w (n, 4) of motions (n, 4, 4), with w ≥ 0."""
    return np.asarray(Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True))


def proper(T: Array) -> Array:
    """The motion (4, 4) with its rotation made exact: long chains of products lose that."""
    return from_quaternions(T[None, :3, 3], quaternions(T[None]))[0]


def to_vector(T: Array) -> Array:
    """Small motions as (..., 6): the rotation vector (rad) before the translation (m)."""
    turn = Rotation.from_matrix(T[..., :3, :3]).as_rotvec()
    return np.concatenate([turn, T[..., :3, 3]], axis=-1)


def from_vector(vector: Array) -> Array:
    """The motions (..., 4, 4) of ``to_vector``."""
    return motion(Rotation.from_rotvec(vector[..., :3]).as_matrix(), vector[..., 3:])


def from_planar(poses: Array) -> Array:
    """(n, 4, 4) from planar poses x, y, θ (n, 3): in the plane z = 0, turned about z."""
    n = len(poses)
    R = Rotation.from_euler("z", poses[:, 2:3]).as_matrix()
    return motion(R, np.column_stack([poses[:, :2], np.zeros(n)]))


def to_planar(T: Array) -> Array:
    """Planar poses (..., 3): x, y and the heading of the x axis, as a TUM file is read elsewhere in this package."""
    return np.stack([T[..., 0, 3], T[..., 1, 3], np.arctan2(T[..., 1, 0], T[..., 0, 0])], axis=-1)


def interpolate(time_s: Array, T: Array, at_s: Array) -> Array:
    """Motions (m, 4, 4) at times within ``time_s`` (n,): linear in position, the shortest arc in rotation."""
    after = np.searchsorted(time_s, at_s).clip(1, max(len(time_s) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(time_s) - 1)
    span = time_s[after] - time_s[before]
    share = np.divide(at_s - time_s[before], span, out=np.zeros(len(at_s)), where=span > 0)
    return blend(T[before], T[after], share)


def blend(start: Array, end: Array, share: Array) -> Array:
    """Motions (n, 4, 4) that lie a share (n,) of the way from start to end."""
    turn = Rotation.from_matrix(np.swapaxes(start[:, :3, :3], 1, 2) @ end[:, :3, :3]).as_rotvec() * share[:, None]
    R = start[:, :3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return motion(R, start[:, :3, 3] + share[:, None] * (end[:, :3, 3] - start[:, :3, 3]))


def bent(time_s: Array, T: Array, at_s: Array, T_at: Array) -> Array:
    """A path (n, 4, 4) at ``time_s`` (n,), moved so that it passes through ``T_at`` (k, 4, 4) at times ``at_s`` (k,).

    Between two of those the correction goes over from one to the other; before and after all of them it stays.
    """
    correction = T_at @ inverse(interpolate(time_s, T, at_s))
    inside = np.clip(time_s, at_s[0], at_s[-1])
    # What is blended are poses, not corrections: those turn about a far origin.
    after = np.searchsorted(at_s, inside).clip(1, max(len(at_s) - 1, 1))
    before, after = after - 1, np.minimum(after, len(at_s) - 1)
    span = at_s[after] - at_s[before]
    share = np.divide(inside - at_s[before], span, out=np.zeros(len(inside)), where=span > 0)
    return blend(correction[before] @ T, correction[after] @ T, share)
