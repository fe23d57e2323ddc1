"""First places of walks whose starts nobody knows, from their scans alone.

    fingerprints -> loops between walks -> parts that loops tie -> offsets -> a crowd of rigid walks -> confidence

Each walk is rigid here: four unknowns, a place, a turn and a scale. Loops pull, dissimilar scans push, compasses and
step lengths are right on average. Positions that somebody knows (``mixed``) are points of one more walk that does not
move, the building. What comes out is a place for the pose graph to begin with, and how well it is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from radioslam.config import Config, FingerprintConfig, OptimizerConfig, PlacementConfig, ScreeningConfig
from radioslam.errors import MappingError
from radioslam.factors import ZeroBlock
from radioslam.fingerprints import Fingerprints, represent
from radioslam.first_offsets import first_offsets
from radioslam.looks import Part, average_looks, collect_parts
from radioslam.loops import Loops, screen_candidates
from radioslam.normal_equations import Block, NormalEquations
from radioslam.odometry import Track
from radioslam.optimizer import minimize
from radioslam.repulsion import ApartBlock, LeastDistance, find_dissimilar, learn_least_distance
from radioslam.rigid_walks import MeanBlock, Placement, RigidWalks, SamePlaceBlock, TurnBlock
from radioslam.similarity import similar_pairs
from radioslam.smoothing import smooth_fingerprints
from radioslam.uncertainty import learn_uncertainty

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

FIRM = 1e-4
"""Metres and radians; holds what does not move."""


@dataclass(frozen=True)
class _Crowd:
    """Points of walks, (n,), (n, 2) and m/s (n, 2), the fingerprints first; loops i, j, σ (m,) between them.

    With known positions the last walk is the building, and the loops that tie walks to it are ``sure`` (m,).
    """

    walk: Integers
    positions_xy: Array
    velocity: Array
    i: Integers
    j: Integers
    sigma_m: Array
    walks: int
    building: bool = False

    @property
    def sure(self) -> NDArray[np.bool_]:
        return (self.walk[self.j] == self.walks - 1) & self.building


def place_walks(tracks: Sequence[Track], config: Config) -> Placement:
    """Place all walks by ``config.merging.starts``: ``unknown``, or ``mixed`` with first reference positions.

    Raises:
        MappingError: too few pairs of scans to learn from, or ``mixed`` without any reference.
    """
    settings = config.placement
    fixed = np.array([config.merging.starts == "mixed" and track.walk.reference is not None for track in tracks])
    if config.merging.starts == "mixed" and not fixed.any():
        raise MappingError("expected a reference position in at least one walk, found none; use --starts unknown")
    parts = _place_parts(tracks, fixed, config)
    lag_s = parts[0].lag_s if parts else 0.0
    phases_s = settings.period_s * np.arange(settings.looks) / settings.looks
    looks = [_place_parts(tracks, fixed, config, lag_s, float(phase_s)) for phase_s in phases_s]
    return average_looks([collect_parts(look, fixed, settings.max_sigma_m) for look in looks], settings.max_sigma_m)


def _place_parts(
    tracks: Sequence[Track], fixed: NDArray[np.bool_], config: Config, lag_s: float = 0.0, phase_s: float = 0.0
) -> list[Part]:
    """All parts that loops tie, by fingerprints of a clock's phase and readings ``lag_s`` older than the phone says."""
    settings = config.placement
    fingerprints = smooth_fingerprints(tracks, settings, lag_s, phase_s)
    strengths = represent(fingerprints.rss_dbm, FingerprintConfig(representation="exponential"))
    least = learn_least_distance(fingerprints, strengths, settings)
    sigma = learn_uncertainty(fingerprints, strengths, config.uncertainty).sigma
    kept = tie_walks(fingerprints, strengths, settings).kept
    velocity = np.concatenate([t.velocity(fingerprints.time_s[fingerprints.walk == k]) for k, t in enumerate(tracks)])
    points = fingerprints.walk, fingerprints.poses[:, :2], velocity
    crowd = _Crowd(*points, kept.i, kept.j, sigma(kept.similarity), len(tracks))
    if fixed.any():
        crowd = _with_building(crowd, tracks, np.flatnonzero(fixed), config.merging.start_sigma_m)
    return [_place_part(crowd, walks, strengths, least, settings) for walks in _parts(crowd) if len(walks) > 1]


def tie_walks(fingerprints: Fingerprints, strengths: sparse.csr_array, config: PlacementConfig) -> Loops:
    """Loops between different walks: each scan in one, the most similar first, two walks once per ``stretch_m``."""
    similar = similar_pairs(strengths, config.similarity_threshold)
    similar = similar.select(fingerprints.walk[similar.i] != fingerprints.walk[similar.j])
    rule = ScreeningConfig(rule="single", window_m=config.stretch_m)
    return screen_candidates(similar, fingerprints, fingerprints.poses[:, :2], rule)


def _with_building(crowd: _Crowd, tracks: Sequence[Track], fixed: Integers, sigma_m: float) -> _Crowd:
    """The crowd and one more walk, of the known positions; a loop ties each to the same moment of its own walk."""
    references = [track.walk.reference for track in (tracks[k] for k in fixed)]
    known = np.array([reference.positions_xy[0] for reference in references if reference is not None])
    times = [reference.time_s[:1] for reference in references if reference is not None]
    inside = np.concatenate([tracks[k].at(time_s)[:, :2] for k, time_s in zip(fixed, times, strict=True)])
    n, m = len(crowd.walk), len(fixed)
    return _Crowd(
        walk=np.concatenate([crowd.walk, fixed, np.full(m, crowd.walks)]),
        positions_xy=np.concatenate([crowd.positions_xy, inside, known]),
        velocity=np.concatenate([crowd.velocity, np.zeros((2 * m, 2))]),
        i=np.concatenate([crowd.i, n + np.arange(m)]),
        j=np.concatenate([crowd.j, n + m + np.arange(m)]),
        sigma_m=np.concatenate([crowd.sigma_m, np.full(m, sigma_m)]),
        walks=crowd.walks + 1,
        building=True,
    )


def _parts(crowd: _Crowd) -> list[Integers]:
    """Walks that loops tie, as lists, the main part first: that of the building, else the largest."""
    ties = (np.ones(len(crowd.i)), (crowd.walk[crowd.i], crowd.walk[crowd.j]))
    label = connected_components(sparse.coo_array(ties, shape=(crowd.walks, crowd.walks)), directed=False)[1]
    parts = [np.flatnonzero(label == k) for k in range(label.max() + 1)]
    main = label[-1] if crowd.building else -1
    return sorted(parts, key=lambda walks: (label[walks[0]] != main, -len(walks), walks[0]))


def _place_part(
    crowd: _Crowd, walks: Integers, strengths: sparse.csr_array, least: LeastDistance, config: PlacementConfig
) -> Part:
    """Solve one part: offsets, then rounds of the rigid crowd, each with the pairs that stand too near by then."""
    part, points = _restricted(crowd, walks)
    heard = strengths[points[points < strengths.shape[0]]]
    rigid = RigidWalks.of(part.walk, part.positions_xy, part.velocity, part.walks)
    held = [*_ties(part, rigid), *_beliefs(rigid, part.building, config)]
    origin, x = _first(part, rigid)
    n, settings = heard.shape[0], OptimizerConfig(max_iterations=config.iterations, tolerance=1e-4)
    for _ in range(config.rounds):
        pairs = find_dissimilar(part.walk[:n], rigid.positions(x)[:n], heard, least, config)
        x = minimize([*held, ApartBlock(rigid, pairs)], x, settings).x
    place = rigid.places(x) + np.append(origin, [0.0, 0.0])
    return Part(walks, rigid.centre, place, centre_sigma(held, x, rigid, part.building), float(x[rigid.lag]))


def _restricted(crowd: _Crowd, walks: Integers) -> tuple[_Crowd, Integers]:
    """The part of a crowd that some of its walks make, numbered anew, and its points' numbers before."""
    number = np.full(crowd.walks, -1)
    number[walks] = np.arange(len(walks))
    points = np.flatnonzero(number[crowd.walk] >= 0)
    place = np.full(len(crowd.walk), -1)
    place[points] = np.arange(len(points))
    inside = place[crowd.i] >= 0
    building = crowd.building and bool(number[-1] >= 0)
    part = replace(
        crowd,
        walk=number[crowd.walk[points]],
        positions_xy=crowd.positions_xy[points],
        velocity=crowd.velocity[points],
        i=place[crowd.i[inside]],
        j=place[crowd.j[inside]],
        sigma_m=crowd.sigma_m[inside],
        walks=len(walks),
        building=building,
    )
    return part, points


def _first(part: _Crowd, rigid: RigidWalks) -> tuple[Array, Array]:
    """An origin (2,) in the part's frame, and the unknowns from there: offsets by least squares, no turn, no scale.

    The origin is the centre of the building, which then stands at zero, or else of all walks.
    """
    offsets = first_offsets(part.walk, part.positions_xy, part.i, part.j, part.sigma_m, part.walks, part.sure)
    centre = rigid.centre + offsets
    x = np.zeros(rigid.size)
    rigid.places(x)[:, :2] = centre - (centre[-1] if part.building else centre.mean(axis=0))
    return (rigid.centre[-1] if part.building else np.zeros(2)), x


def _ties(part: _Crowd, rigid: RigidWalks) -> list[Block]:
    """Loops, of which some are wrong, and known positions, which are not."""
    known = part.sure
    ends = [(part.i[mask], part.j[mask], part.sigma_m[mask]) for mask in (~known, known)]
    return [SamePlaceBlock(rigid, *ends[0]), SamePlaceBlock(rigid, *ends[1], loss="none")]


def _beliefs(rigid: RigidWalks, building: bool, config: PlacementConfig) -> list[Block]:
    """What is known without loops: priors of turns and scales, gauges, and that the building stands still."""
    turns, scales = rigid.unknowns(2), rigid.unknowns(3)
    common, lag = np.array([rigid.common_turn]), ZeroBlock(np.array([rigid.lag]), config.lag_sigma_s)
    shared: list[Block] = [MeanBlock(scales, config.mean_log_scale_sigma), lag]
    if building:
        still = np.array([rigid.unknowns(k)[-1] for k in range(4)])
        shared += [ZeroBlock(common, config.common_turn_sigma_rad), ZeroBlock(still, FIRM)]
        turns, scales = turns[:-1], scales[:-1]
    else:
        gauges = [MeanBlock(rigid.unknowns(k), 1.0) for k in range(2)]
        shared += [ZeroBlock(common, FIRM), MeanBlock(turns, config.mean_turn_sigma_rad), *gauges]
    return [
        TurnBlock(turns, rigid.common_turn, config.turn_sigma_rad),
        ZeroBlock(scales, config.log_scale_sigma),
        *shared,
    ]


def centre_sigma(blocks: Sequence[Block], x: Array, rigid: RigidWalks, building: bool) -> Array:
    """Standard deviation per axis (w,) in m of each walk's centre from the best known walk, or from the building.

    From the inverse of JᵀWJ of loops and priors. Repulsion is left out: it says where a walk is not.
    """
    system = NormalEquations([block for block in blocks if len(block.variables)], len(x))
    hessian = np.zeros((len(x), len(x)))
    hessian[system.rows, system.columns] = hessian[system.columns, system.rows] = system.assemble(x)[0]
    covariance = np.linalg.inv(hessian)
    places = [rigid.unknowns(k) for k in range(2)]
    joint = np.sum([covariance[np.ix_(place, place)] for place in places], axis=0)
    own = np.diag(joint)
    between = np.sqrt(np.maximum(own[:, None] + own[None, :] - 2 * joint, 0.0) / 2)
    best = len(own) - 1 if building else int(np.median(between, axis=1).argmin())
    return np.asarray(between[best])
