"""Walks laid into a map that stands: the graph of these walks alone, tied to places of the map.

    F(x) = ½ Σ_odometry + ½ Σ_legs ρ + ½ Σ_loops ρ(‖e‖² / var(s)) + ½ Σ_places (p - p_map)² / σ_map² + priors

It is the graph of the whole map with the other walks marginalised: all they say is where their scans stand and how
surely, one independent of the other. The radio's lag and the building's axis stay as the map knows them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.config import Config
from radioslam.directions import find_legs
from radioslam.factors import Layout, ZeroBlock, first_guess, graph_blocks
from radioslam.fingerprints import Fingerprints
from radioslam.loops import ALONE, KEPT, Loops, screen_candidates
from radioslam.merging import MergedTracks
from radioslam.normal_equations import Block
from radioslam.optimizer import minimize
from radioslam.places import Samples, similar_to
from radioslam.pose_graph import Edges, Legs, PoseGraph, Priors, diagonal_information
from radioslam.similarity import Pairs, similar_pairs
from radioslam.slam import odometry_edges
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

HEADING_SIGMA_RAD = 0.5
"""Of places; their heading takes no part in a loop."""
FIRM = 1e-3
"""Seconds and radians; holds what the map knows."""


@dataclass(frozen=True)
class Knowledge:
    """What a map knows as a whole: similarity -> variance, the radio's lag and the building's axis, None if unknown."""

    uncertainty: UncertaintyModel
    radio_lag_s: float | None = None
    axis_rad: float | None = None


@dataclass(frozen=True)
class Settled:
    """A walk in the map: ``poses`` (n, 3) and ``sigma_m`` (n,) of its scans, and its loops.

    ``loops`` number the ``places`` first, then the scans.
    """

    poses: Array
    sigma_m: Array
    places: Samples
    loops: Loops


def settle(merged: MergedTracks, own: Samples, places: Samples, knowledge: Knowledge, config: Config) -> Settled:
    """Find the loops of a walk, ``merged`` as if it were alone, to ``places`` and optimize it; ``own`` are its n scans.

    Rounds and rules are those of the batch.
    """
    places = places.select(_near(places, merged.poses, config.loops.gates_m[0]))
    places, similar = _only_used(places, _similar(places, own, config.loops.similarity_threshold))
    joint = _joined(places, own)
    estimate, loops, sigma_m = merged, Loops(similar, np.full(len(similar), KEPT, "<U32")), np.zeros(0)
    for k, gate_m in enumerate(config.loops.gates_m):
        positions = np.concatenate([places.poses[:, :2], estimate.poses[estimate.node_of_fingerprint, :2]])
        loops = _screened(similar, joint, positions, gate_m, len(places), config)
        graph = _graph(estimate, places, loops.kept, knowledge, config, legs=k > 0)
        x, sigma_m = _solve(graph, knowledge, config, last=k == len(config.loops.gates_m) - 1)
        estimate = merged.at(x)
    nodes = merged.node_of_fingerprint
    return Settled(estimate.poses[nodes], _with_common_error(sigma_m[nodes], places, loops.kept), places, loops)


def polish(merged: MergedTracks, kept: Pairs, others: Samples, knowledge: Knowledge, config: Config) -> Array:
    """Optimize walks that stand in the map together; poses (n, 3) of their scans.

    The loops that are ``kept`` number scans of the ``others``, which stay, before those of the walks.
    """
    graph = _graph(merged, others, kept, knowledge, config, legs=True)
    x, _ = _solve(graph, knowledge, config, last=False)
    return merged.at(x).poses[merged.node_of_fingerprint]


def _near(places: Samples, poses: Array, reach_m: float) -> NDArray[np.bool_]:
    low, high = poses[:, :2].min(axis=0) - reach_m, poses[:, :2].max(axis=0) + reach_m
    return np.all((places.poses[:, :2] >= low) & (places.poses[:, :2] <= high), axis=1)


def _similar(places: Samples, own: Samples, threshold: float) -> Pairs:
    """Pairs of places and scans, and of the scans among themselves, numbered places first."""
    outer, inner = similar_to(places, own.strengths, threshold), similar_pairs(own.strengths, threshold)
    n = len(places)
    return Pairs(
        np.concatenate([outer.i, inner.i + n]),
        np.concatenate([outer.j + n, inner.j + n]),
        np.concatenate([outer.similarity, inner.similarity]),
    )


def _only_used(places: Samples, similar: Pairs) -> tuple[Samples, Pairs]:
    """Places that are similar to anything, and the pairs in their numbering."""
    n = len(places)
    used = np.unique(similar.i[similar.i < n])
    number = np.concatenate([np.zeros(n, np.int64), len(used) + np.arange(similar.j.max(initial=n - 1) + 1 - n)])
    number[used] = np.arange(len(used))
    return places.select(used), Pairs(number[similar.i], number[similar.j], similar.similarity)


def _joined(places: Samples, own: Samples) -> Fingerprints:
    """Places and scans as the screening wants them."""
    both = Samples.concatenate([places, own])
    times, nothing = np.zeros(len(both)), both.strengths
    return Fingerprints(both.walk, both.scan, times, both.poses, both.distance_m, nothing, ())


def _screened(
    similar: Pairs, joint: Fingerprints, positions_xy: Array, gate_m: float, places: int, config: Config
) -> Loops:
    """Loops by the rule of the batch; a walk with too few of them has none."""
    away = np.hypot(*(positions_xy[similar.j] - positions_xy[similar.i]).T)
    rule = config.screening.model_copy(update={"min_loops_per_walk": 1})
    loops = screen_candidates(similar.select(away <= gate_m), joint, positions_xy, rule)
    if len(loops.kept) < config.screening.min_loops_per_walk:
        return Loops(loops.pairs, np.where(loops.reason == KEPT, ALONE, loops.reason))
    return loops


def _graph(
    merged: MergedTracks, places: Samples, kept: Pairs, knowledge: Knowledge, config: Config, legs: bool
) -> PoseGraph:
    """The graph of the walks, their nodes first, then the places that they are tied to."""
    tied = np.unique(kept.i[kept.i < len(places)])
    n, own = len(merged.poses), merged.node_of_fingerprint
    node = np.concatenate([np.zeros(len(places), np.int64), own])
    node[tied] = n + np.arange(len(tied))
    i, j = node[kept.i], node[kept.j]
    velocity = np.concatenate([merged.velocities(), places.velocity[tied]])
    sigma, turn = knowledge.uncertainty.sigma(kept.similarity), np.full(len(kept), config.loops.heading_variance**0.5)
    held = diagonal_information(places.sigma_m[tied], places.sigma_m[tied], np.full(len(tied), HEADING_SIGMA_RAD))
    scales = np.array([track.log_scale_sigma for track in merged.tracks])
    return PoseGraph(
        poses=np.concatenate([merged.poses, places.poses[tied]]),
        odometry=odometry_edges(merged),
        loops=Edges(i, j, np.zeros((len(kept), 3)), diagonal_information(sigma, sigma, turn)),
        priors=Priors.concatenate([merged.priors, Priors(n + np.arange(len(tied)), places.poses[tied], held)]),
        walk=np.concatenate([merged.walk, np.zeros(len(tied), np.int64)]),
        log_scale_sigma=scales if config.merging.walk_scales else None,
        loop_velocity=velocity[j] - velocity[i] if knowledge.radio_lag_s is not None else None,
        lag_sigma_s=config.loops.lag_sigma_s,
        legs=_legs(merged, knowledge.axis_rad, config) if legs else None,
    ).check()


def _legs(merged: MergedTracks, axis_rad: float | None, config: Config) -> Legs | None:
    begin, end, length_m = find_legs(merged, config.directions)
    if axis_rad is None or not len(begin):
        return None
    return Legs(
        begin, end, np.hypot(config.directions.sigma_rad, config.directions.lateral_sigma_m / length_m), axis_rad
    )


def _solve(graph: PoseGraph, knowledge: Knowledge, config: Config, last: bool) -> tuple[Array, Array]:
    """Unknowns (n,) and, of the last graph, σ of each node."""
    layout, x = Layout.of(graph), first_guess(graph)
    held: list[Block] = []
    for place, value in ((layout.lag, knowledge.radio_lag_s), (layout.axis, knowledge.axis_rad)):
        if place is not None and value is not None:
            held.append(ZeroBlock(np.array([place]), FIRM, value))
            x[place] = value
    solution = minimize([*graph_blocks(graph, config.optimizer), *held], x, config.optimizer, variances=last)
    nodes = graph.poses.size
    if solution.inverse_diagonal is None:
        return solution.x[:nodes], np.zeros(0)
    return solution.x[:nodes], np.sqrt(solution.inverse_diagonal[:nodes].reshape(-1, 3)[:, :2].mean(axis=1))


def _with_common_error(sigma_m: Array, places: Samples, kept: Pairs) -> Array:
    """What the map errs at neighbouring places it errs together, so no number of loops averages it out."""
    tied = np.unique(kept.i[kept.i < len(places)])
    common = np.mean(places.sigma_m[tied] ** 2) if len(tied) else 0.0
    return np.sqrt(sigma_m**2 + common)
