"""Simultaneous localization and radio mapping: the method on one page.

The steps stand in the order and the words of arXiv:1904.11712, section III; each is a file of its own.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import Config, load_config
from radioslam.directions import straight_legs
from radioslam.engine import Engine, OneMachine
from radioslam.errors import MappingError
from radioslam.factors import Layout
from radioslam.fingerprints import Fingerprints, collect_fingerprints, represent
from radioslam.loops import Loops, find_candidates, screen_candidates
from radioslam.merging import MergedTracks, merge_tracks
from radioslam.odometry import Track, estimate_odometry
from radioslam.optimizer import Solution
from radioslam.placement import place_walks
from radioslam.pose_graph import Edges, PoseGraph, diagonal_information
from radioslam.radio_map import RadioMap
from radioslam.results import FOUND_STARTS, SlamResult, SolverStatus
from radioslam.similarity import Pairs
from radioslam.turns import turn_walks
from radioslam.uncertainty import UncertaintyModel, learn_uncertainty
from radioslam.walk import Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def map_walks(
    walks: Sequence[Walk],
    config: Config | None = None,
    progress: Callable[[str], None] | None = None,
    engine: Engine | None = None,
) -> SlamResult:
    """Turn walks into their true paths.

    Args:
        walks: any number, in any order.
        config: default preset if not given.
        progress: called with the name of each step as it begins.
        engine: what joins and optimizes; this process if not given.

    Raises:
        MappingError: no walks, two walks of one name, walks of several floors, nothing to learn from or to tie, or
            neither starts nor headings known.
    """
    config = config or load_config()
    if config.merging.heading == "unknown" and config.merging.starts in FOUND_STARTS:
        raise MappingError(
            f"expected known or common starts where headings are unknown, found {config.merging.starts}; "
            "each walk is turned about its start"
        )
    clock = Stopwatch(progress)
    with clock("odometry"):
        tracks = estimate_odometry(_in_order(walks), config.odometry)
    return map_tracks(tracks, config, clock, engine)


def map_tracks(
    tracks: Sequence[Track], config: Config, clock: Stopwatch | None = None, engine: Engine | None = None
) -> SlamResult:
    """The same for walks whose odometry is known, in the order of their names; errors as in ``map_walks``."""
    clock, engine = clock or Stopwatch(), engine or OneMachine()
    with clock("fingerprints"):
        fingerprints = collect_fingerprints(tracks, config.fingerprints)
        strengths = represent(fingerprints.rss_dbm, config.fingerprints)
    with clock("uncertainty model"):
        uncertainty = learn_uncertainty(fingerprints, strengths, config.uncertainty)
    placement = None
    if config.merging.starts in FOUND_STARTS:
        with clock("placement"):
            placement = place_walks(tracks, config)
    with clock("merging"):
        merged = merge_tracks(tracks, fingerprints, strengths, uncertainty, config.merging, placement)
    if config.merging.heading == "unknown":
        with clock("turning"):
            similar = Pairs.collect(engine.join(strengths, config.loops.similarity_threshold))
            merged = turn_walks(merged, similar, fingerprints, uncertainty, config)
    estimate = merged
    # Walks that have been placed lie together already: one narrow look, and no axes that their turns could mistake.
    gates_m = config.loops.gates_m if placement is None else config.loops.gates_m[-1:]
    for k, gate_m in enumerate(gates_m):
        with clock("loop candidates"):
            candidates = find_candidates(strengths, estimate, fingerprints, gate_m, config.loops, engine.join)
        with clock("screening"):
            loops = screen_candidates(
                candidates, fingerprints, estimate.poses[estimate.node_of_fingerprint, :2], config.screening
            )
        with clock("optimization"):
            graph = build_pose_graph(estimate, loops, uncertainty, config)
            if k > 0:  # the axes show once the loops have laid the walks together
                graph = replace(graph, legs=straight_legs(estimate, config.directions))
            solution = engine.optimize(graph, config.optimizer, last=k == len(gates_m) - 1)
            estimate = merged.at(solution.x)
    nodes = merged.node_of_fingerprint
    return SlamResult(
        config=config,
        radio_map=annotate(estimate, fingerprints, solution, _number_maps(graph, merged)),
        odometry_poses=_wrapped(merged.poses[nodes]),
        distance_m=fingerprints.distance_m,
        references=tuple(track.walk.reference for track in tracks),
        loops=loops,
        uncertainty=uncertainty,
        graph=solved_graph(graph, estimate, solution),
        solver=solver_status(graph, solution),
        devices=tuple(track.walk.device for track in tracks),
        seconds=clock.seconds,
        placed_sigma_m=() if placement is None else tuple(placement.sigma_m.tolist()),
        untied_reason=() if placement is None else placement.reason,
    )


def build_pose_graph(merged: MergedTracks, loops: Loops, uncertainty: UncertaintyModel, config: Config) -> PoseGraph:
    """Odometry between consecutive nodes of a walk; loops with zero transform, var(s) in x and y, 1000 in θ."""
    kept, node = loops.kept, merged.node_of_fingerprint
    sigma = uncertainty.sigma(kept.similarity)
    turn_sigma = np.full(len(kept), config.loops.heading_variance**0.5)
    scales = np.array([track.log_scale_sigma for track in merged.tracks])
    velocity = merged.velocities()
    return PoseGraph(
        poses=merged.poses,
        odometry=odometry_edges(merged),
        loops=Edges(
            node[kept.i],
            node[kept.j],
            np.zeros((len(kept), 3)),
            diagonal_information(sigma, sigma, turn_sigma),
        ),
        links=merged.links,
        priors=merged.priors,
        walk=merged.walk,
        log_scale_sigma=scales if config.merging.walk_scales else None,
        loop_velocity=velocity[node[kept.j]] - velocity[node[kept.i]] if config.loops.lag_sigma_s else None,
        lag_sigma_s=config.loops.lag_sigma_s,
    ).check()


def odometry_edges(merged: MergedTracks) -> Edges:
    """The motion between consecutive nodes of every walk, as odometry has it."""
    i = np.flatnonzero(np.diff(merged.walk) == 0)
    parts = []
    for k, track in enumerate(merged.tracks):
        time_s = merged.time_s[merged.walk == k]
        poses = track.at(time_s)
        parts.append((planar.between(poses[:-1], poses[1:]), *track.motion_sigmas(time_s)))
    motion, translation, heading = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Edges(i, i + 1, motion, diagonal_information(translation, translation, heading))


def solved_graph(graph: PoseGraph, estimate: MergedTracks, solution: Solution) -> PoseGraph:
    """The graph at its optimum: poses, odometry stretched by each walk's scale, loops parted by the radio's lag."""
    layout, odometry, loops = Layout.of(graph), graph.odometry, graph.loops
    if layout.scales is not None:
        scale = np.exp(solution.x[layout.scales + estimate.walk[odometry.i]])
        moved = np.column_stack([odometry.measurement[:, :2] * scale[:, None], odometry.measurement[:, 2]])
        odometry = replace(odometry, measurement=moved)
    if layout.lag is not None and graph.loop_velocity is not None:
        parted = planar.rotate(-estimate.poses[loops.i, 2], solution.x[layout.lag] * graph.loop_velocity)
        loops = replace(loops, measurement=np.column_stack([parted, loops.measurement[:, 2]]))
    return replace(graph, poses=estimate.poses, odometry=odometry, loops=loops)


def solver_status(graph: PoseGraph, solution: Solution) -> SolverStatus:
    """How the optimization went, with the unknowns that the whole graph shares."""
    layout = Layout.of(graph)
    lag_s, axis_rad = (None if k is None else float(solution.x[k]) for k in (layout.lag, layout.axis))
    return SolverStatus(
        solution.converged,
        solution.iterations,
        solution.cost_before,
        solution.cost_after,
        solution.seconds,
        lag_s,
        None if axis_rad is None else axis_rad % (np.pi / 2),
    )


def annotate(merged: MergedTracks, fingerprints: Fingerprints, solution: Solution, map_of_walk: Integers) -> RadioMap:
    """The optimized track annotated with its fingerprints."""
    nodes = merged.node_of_fingerprint
    return RadioMap(
        walks=merged.names,
        walk=fingerprints.walk,
        time_s=fingerprints.time_s,
        poses=_wrapped(merged.poses[nodes]),
        sigma_m=_position_sigma(solution, len(merged.poses))[nodes],
        map=map_of_walk[fingerprints.walk],
        rss_dbm=fingerprints.rss_dbm,
        transmitters=fingerprints.transmitters,
    )


def _in_order(walks: Sequence[Walk]) -> list[Walk]:
    """By name, so that the order in which logs came cannot change the map."""
    if not walks:
        raise MappingError("expected at least one walk, found none")
    walks = sorted(walks, key=lambda walk: walk.name)
    for before, after in itertools.pairwise(walks):
        if before.name == after.name:
            raise MappingError(f"expected different names, found two walks called {after.name!r}; rename one log")
    floors = sorted({walk.floor for walk in walks if walk.floor})
    if len(floors) > 1:
        raise MappingError(f"expected walks of one floor, found floors {', '.join(floors)}; map each on its own")
    return walks


def _number_maps(graph: PoseGraph, merged: MergedTracks) -> Integers:
    """(n_walks,) parts of the crowd that are tied by loops, links or known starts, the largest first.

    The main part of a placement comes before all others.
    """
    component = graph.components()
    first = np.searchsorted(merged.walk, np.arange(len(merged.tracks)))
    of_walk = np.unique(component[first], return_inverse=True)[1]
    # Walks of one frame stand at known places of one building even where no loop ties them.
    of_walk = np.array([of_walk[np.flatnonzero(merged.frame == frame)[0]] for frame in merged.frame])
    sizes = np.bincount(of_walk)
    if merged.placement is not None:
        sizes[of_walk[merged.frame == 0]] += len(of_walk)
    rank = np.empty(len(sizes), np.int64)
    rank[np.argsort(-sizes, kind="stable")] = np.arange(len(sizes))
    return np.unique(rank[of_walk], return_inverse=True)[1].astype(np.int64)


def _position_sigma(solution: Solution, nodes: int) -> Array:
    if solution.inverse_diagonal is None:
        return np.full(nodes, np.nan)
    variance = solution.inverse_diagonal[: 3 * nodes].reshape(-1, 3)[:, :2]
    return np.sqrt(variance.mean(axis=1))


def _wrapped(poses: Array) -> Array:
    return np.column_stack([poses[:, :2], planar.wrap(poses[:, 2])])


class Stopwatch:
    """Seconds per step, told as they begin."""

    def __init__(self, progress: Callable[[str], None] | None = None) -> None:
        self.progress, self.seconds = progress, dict[str, float]()

    @contextmanager
    def __call__(self, step: str) -> Iterator[None]:
        """Time a step."""
        if self.progress:
            self.progress(step)
        started = time.perf_counter()
        yield
        self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - started
