"""Registration of two point clouds, from no initial guess or from a given one; the paper's section IV-B on one page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import RegistrationConfig
from radioslam.point_cloud.harris import find_key_points
from radioslam.point_cloud.matching import find_motions, match
from radioslam.point_cloud.shot import LENGTH, describe
from radioslam.point_cloud.surface import Surface, make_surface, nearest, refine

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ACCEPTED = "accepted"
NO_MOTION = "no motion brings the clouds together"
LITTLE_MATCHED = "too few points matched"
SLIDES = "clouds slide along each other"

UNKNOWN = 100.0 * np.eye(6)
"""Covariance of a motion of which nothing is known."""
UNKNOWN_M2 = 100.0
PROBES = 300
"""Points that tell whether ICP is worth a start."""


@dataclass(frozen=True)
class Features:
    """What registration needs of one cloud; made once per cloud.

    Attributes:
        surface: down-sampled points with normals.
        key_points: (k, 3).  descriptors: (k, 352), SHOT of each.
    """

    surface: Surface
    key_points: Array
    descriptors: NDArray[np.float32]


@dataclass(frozen=True)
class Registration:
    """The motion between two clouds.

    Attributes:
        T_target_source: (4, 4).
        covariance: (6, 6) of a small motion of the source in its own axes, rotation (rad) before translation (m).
        matched: the lesser of the two clouds' parts of matched points.
        reason: ``ACCEPTED``, or why not.
    """

    T_target_source: Array
    covariance: Array
    matched: float
    reason: str

    @property
    def accepted(self) -> bool:
        """Whether to believe it."""
        return self.reason == ACCEPTED


def within_range(points: Array, max_range_m: float) -> Array:
    """The points (n, 3) no farther from the sensor than that."""
    return points[np.linalg.norm(points, axis=1) <= max_range_m]


def make_features(points: Array, config: RegistrationConfig) -> Features:
    """Down-sample a checked cloud (n, 3) in its sensor's frame, and describe its key points."""
    near = within_range(points, config.max_range_m)
    surface = make_surface(near, config.voxel_m, config.normal_neighbours)
    if not len(surface) or not config.key_points:
        return Features(surface, np.zeros((0, 3)), np.zeros((0, LENGTH), np.float32))
    separation = config.key_point_separation_m
    keys = find_key_points(
        surface.points, surface.normals, config.harris_radius_m, separation, config.least_response, config.key_points
    )
    descriptors, known = describe(surface.points, surface.normals, keys, config.shot_radius_m)
    return Features(surface, surface.points[keys[known]], descriptors[known].astype(np.float32))


def register(
    target: Features,
    source: Features,
    config: RegistrationConfig,
    guess: Array | None = None,
    reach: tuple[float, float] = (np.inf, np.inf),
) -> Registration:
    """Find the motion that lays the source over the target.

    Args:
        target, source: the clouds.
        config: every limit.
        guess: T_target_source (4, 4) from which ICP starts first; where that is not accepted, or without a guess, it
            starts from the motions that matched key points agree on.
        reach: how far (m, rad) from the guess the motion may be: what lies farther is not believed, for corridors look
            alike forwards and backwards.
    """
    best = Registration(np.eye(4), UNKNOWN, 0.0, NO_MOTION)
    for T in _guesses(target, source, config, guess):
        if not _promising(target.surface, source.surface, T, config):
            continue
        found = _refined(target.surface, source.surface, T, config)
        if guess is not None and not _within(guess, found.T_target_source, reach):
            continue
        if found.accepted:
            return found
        best = max(best, found, key=lambda registration: registration.matched)
    return best


def _within(guess: Array, T: Array, reach: tuple[float, float]) -> bool:
    moved_m, turned_rad = rigid.apart(guess, T)
    return bool(moved_m <= reach[0] and turned_rad <= reach[1])


def _promising(target: Surface, source: Surface, T: Array, config: RegistrationConfig) -> bool:
    """Whether ICP could get there: of a few hundred points, enough lie within twice its reach."""
    few = source.points[:: 1 + len(source) // PROBES]
    if not len(few) or not len(target):
        return False
    distance = nearest(target, rigid.transform(T, few))[1]
    return bool((distance <= 2 * config.icp_reach_m).mean() > config.least_matched)


def _guesses(target: Features, source: Features, config: RegistrationConfig, guess: Array | None) -> Iterator[Array]:
    """The given guess, and, if that will not do, the motions that matched key points agree on."""
    if guess is not None:
        yield guess
    i, j = match(target.descriptors, source.descriptors, config.match_ratio)
    a, b = target.key_points[i], source.key_points[j]
    rng = np.random.default_rng(config.seed)
    for T, _ in find_motions(a, b, config.ransac_tolerance_m, config.ransac_trials, config.hypotheses, rng):
        yield T


def _refined(target: Surface, source: Surface, guess: Array, config: RegistrationConfig) -> Registration:
    T = refine(target, source, guess, config.icp_reach_m, config.icp_points, config.icp_iterations)
    here, index = matched_points(target, source, T, config)
    there, _ = matched_points(source, target, rigid.inverse(T), config)
    matched = min(float(here.mean()), float(there.mean()))
    free = _free_directions(target, source, T, config) if matched > config.least_matched else np.zeros((3, 3))
    covariance = icp_covariance(target, source, T, index, here, config)
    covariance[3:, 3:] += UNKNOWN_M2 * free
    reason = ACCEPTED
    if matched <= config.least_matched:
        reason = LITTLE_MATCHED
    elif free.any() or np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[-1]) > config.max_sigma_m:
        reason = SLIDES
    return Registration(T, covariance, matched, reason)


def matched_points(
    target: Surface, source: Surface, T: Array, config: RegistrationConfig
) -> tuple[Mask, NDArray[np.int64]]:
    """Mask of the source's matched points, and the target's nearest point to each of all."""
    index, distance = nearest(target, rigid.transform(T, source.points))
    cosine = np.einsum("nj,nj->n", source.normals @ T[:3, :3].T, target.normals[index])
    return (distance <= config.match_distance_m) & (cosine >= np.cos(config.match_angle_rad)), index


def _free_directions(target: Surface, source: Surface, T: Array, config: RegistrationConfig) -> Array:
    """Projector (3, 3) on the directions, in the source's axes, along which the clouds slide.

    In a corridor two clouds match by more than half however far one is slid, for both walls match, and noise that moves
    with the sensor makes them match best where it did not move at all. So the source is slid by ``slide_m`` both ways
    along each principal direction of its normals: where that costs less than ``least_loss`` of the matched points,
    nothing says that the clouds belong so.
    """
    _, axes = np.linalg.eigh(source.normals.T @ source.normals)
    every = 1 + len(source) // (3 * PROBES)
    few = Surface(source.points[::every], source.normals[::every], source.normal_neighbours)
    kept = matched_points(target, few, T, config)[0].sum()
    free = np.zeros((3, 3))
    for axis in axes.T:
        for way in (-config.slide_m, config.slide_m):
            slid = T @ rigid.motion(np.eye(3), way * axis)
            if matched_points(target, few, slid, config)[0].sum() > (1.0 - config.least_loss) * kept:
                free += np.outer(axis, axis)
                break
    return free


def icp_covariance(
    target: Surface,
    source: Surface,
    T: Array,
    index: NDArray[np.int64],
    matched: Mask,
    config: RegistrationConfig,
) -> Array:
    """Covariance (6, 6) of the motion, from the residuals of ICP: rotation before translation, in the source's axes.

    The residual of a matched point p with the target's point q and normal n is r = n · (T p - q); a small motion
    (ω, v) of the source changes it by n · R G (ω, v) with G = (-[p]×, I). Least squares give Σ = s² H⁻¹ with
    s² = Σ r² / (m - 6) and H = Σ Gᵀ n nᵀ G. Normals err too, and would make a bare wall seem to hold in all directions:
    with ν the variance of a normal in each axis, by what the normals of matched points differ, H = Σ Gᵀ (n nᵀ - ν I) G.
    Where both clouds are sampled alike their normals err alike, and ν is at least ``normal_sigma_rad``².
    Neighbouring residuals err alike, so H counts as that of ``effective_points``; what no residual shows is added.
    """
    points, j = source.points[matched], index[matched]
    normals = target.normals[j] @ T[:3, :3]
    residual = np.einsum("nj,nj->n", rigid.transform(T, points) - target.points[j], target.normals[j])
    systematic = np.diag(np.repeat([config.systematic_sigma_rad, config.systematic_sigma_m], 3) ** 2)
    count = len(points)
    if count < 7:
        return UNKNOWN + systematic
    variance = max(float(residual @ residual) / (count - 6), 1e-8)
    normal_variance = float(np.mean(1.0 - np.einsum("nj,nj->n", normals, source.normals[matched]))) / 2
    normal_variance = max(normal_variance, config.normal_sigma_rad**2)
    J = np.hstack([np.cross(points, normals), normals])
    G = _small_motions(points)
    H = J.T @ J - normal_variance * np.einsum("nai,naj->ij", G, G)
    values, vectors = np.linalg.eigh(H * min(1.0, config.effective_points / count) / variance)
    # A direction that nothing holds has ten metres, not infinity.
    return np.asarray((vectors / np.maximum(values, 0.01)) @ vectors.T + systematic)


def _small_motions(points: Array) -> Array:
    """G (n, 3, 6): how points move under (ω, v), ω × p + v."""
    G = np.zeros((len(points), 3, 6))
    x, y, z = points.T
    G[:, 0, 1], G[:, 0, 2], G[:, 1, 0] = z, -y, -z
    G[:, 1, 2], G[:, 2, 0], G[:, 2, 1] = x, y, -x
    G[:, :, 3:] = np.eye(3)
    return G
