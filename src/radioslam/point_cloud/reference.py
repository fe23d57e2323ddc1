"""Reference paths from point clouds, the paper's second SLAM system, on one page.

track = odometry, each step corrected by the cloud against those before it (where that is asked for)
nodes = clouds at the track's poses, each described by its key points
loops = registrations of neighbours along the walks, of walks that heard the same radio, of neighbours in the map
paths = the track, moved along with the optimized nodes
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import Config, ReferenceConfig
from radioslam.point_cloud.candidates import alike_by_radio, along_walks, near_in_estimate
from radioslam.point_cloud.cloud_odometry import follow_clouds
from radioslam.point_cloud.graph_solvers import solve
from radioslam.point_cloud.nodes import Nodes, collect_nodes
from radioslam.point_cloud.odometry_edges import odometry_edges
from radioslam.point_cloud.recordings import Recording
from radioslam.point_cloud.registration import ACCEPTED, SLIDES, Registration, register
from radioslam.point_cloud.spatial_graph import SpatialEdges, SpatialGraph, moved
from radioslam.point_cloud.tying import tie_walks
from radioslam.progress import Tell

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ALONG, RADIO, NEAR = "along the walk", "alike by radio", "near in the estimate"
TILTED = "the floor would tilt"
CONTRADICTED = "other loops between these walks contradict it"
LARGEST_TILT_RAD = 0.1


@dataclass(frozen=True)
class Attempt:
    """A pair of nodes that was tried: why, and what came of it; ``reason`` is the verdict in the end."""

    i: int
    j: int
    kind: str
    T_i_j: Array
    covariance: Array
    matched: float
    reason: str


@dataclass(frozen=True)
class ReferenceResult:
    """Reference paths and what they rest on.

    Attributes:
        recordings: the walks.  followed: the same with odometry as clouds corrected it.  nodes: their clouds.
        attempts: every pair that was tried.
        graph: with optimized poses.  planar: whether it was optimized in the plane.
        part: (n,) part of the map of each node; parts are not tied to each other.
        paths: per walk poses (m, 4, 4) at the odometry's times.
        converged: whether the last optimization did.  seconds: per stage.
    """

    recordings: tuple[Recording, ...]
    followed: tuple[Recording, ...]
    nodes: Nodes
    attempts: tuple[Attempt, ...]
    graph: SpatialGraph
    planar: bool
    part: Integers
    paths: tuple[Array, ...]
    converged: bool
    seconds: dict[str, float]


def make_reference(
    recordings: Sequence[Recording],
    config: Config,
    planar: bool | None = None,
    metres_per_unit: float = 1.0,
    tell: Tell = lambda text, done, total: None,
) -> ReferenceResult:
    """Close loops between the clouds of walks and optimize.

    Args:
        recordings: walks with clouds.
        config: groups ``registration`` and ``reference``; radio likeness by ``fingerprints``.
        planar: keep heights, optimize x, y and heading only; None: where odometry is planar.
        metres_per_unit: of the clouds' coordinates.
        tell: is told what is being done.

    Raises:
        LogError: a cloud cannot be read.  MappingError: fewer than two can be registered.
        ConfigError: an optional library is missing.
    """
    settings, clock = config.reference, [time.perf_counter()]
    seconds: dict[str, float] = {}
    flat = all(recording.is_planar for recording in recordings) if planar is None else planar
    followed = [
        follow_clouds(recording, config, flat, metres_per_unit, tell) if settings.local_map_m else recording
        for recording in recordings
    ]
    _lap(seconds, clock, "following clouds")
    nodes = collect_nodes(followed, config.registration, settings, metres_per_unit, tell)
    _lap(seconds, clock, "describing")
    trial = _Trial(nodes, config, flat, tell)
    odometry, poses = odometry_edges(nodes, followed, settings), nodes.T_odom_body
    trial.run(along_walks(nodes, settings.chain), ALONG, poses)
    graph, part, converged = _solved(nodes, odometry, trial, poses, flat, settings)
    trial.run(alike_by_radio(nodes, recordings, config), RADIO, None)
    graph, part, converged = _solved(nodes, odometry, trial, graph.T_map_body, flat, settings)
    for gate_m in settings.gates_m:
        pairs = near_in_estimate(nodes, graph.T_map_body, part, gate_m, trial.tried, settings)
        trial.run(pairs, NEAR, graph.T_map_body)
        graph, part, converged = _solved(nodes, odometry, trial, graph.T_map_body, flat, settings)
    _lap(seconds, clock, "registering and optimizing")
    paths = tuple(
        corrected_path(raw, walk, nodes, graph.T_map_body, k)
        for k, (raw, walk) in enumerate(zip(recordings, followed, strict=True))
    )
    return ReferenceResult(
        tuple(recordings), tuple(followed), nodes, tuple(trial.attempts), graph, flat, part, paths, converged, seconds
    )


def _lap(seconds: dict[str, float], clock: list[float], stage: str) -> None:
    clock.append(time.perf_counter())
    seconds[stage] = clock[-1] - clock[-2]


class _Trial:
    """Registers pairs of nodes and keeps the attempts."""

    def __init__(self, nodes: Nodes, config: Config, planar: bool, tell: Tell) -> None:
        self.nodes, self.config, self.planar, self.tell = nodes, config, planar, tell
        self.attempts: list[Attempt] = []
        self.tried: set[tuple[int, int]] = set()

    def run(self, pairs: Integers, kind: str, T_map_body: Array | None) -> None:
        """Try pairs (m, 2), with the estimate (n, 4, 4) as first guess if there is one."""
        for done, (i, j) in enumerate(pairs.tolist()):
            self.tell(f"registering: {kind}", done, len(pairs))
            if (i, j) not in self.tried:
                self.tried.add((i, j))
                self.attempts.append(self._attempt(i, j, kind, T_map_body))

    def _attempt(self, i: int, j: int, kind: str, T_map_body: Array | None) -> Attempt:
        mounts = self.nodes.T_body_sensor
        guess = None
        if T_map_body is not None:
            guess = rigid.inverse(T_map_body[i] @ mounts[i]) @ T_map_body[j] @ mounts[j]
        found = register(
            self.nodes.features[i], self.nodes.features[j], self.config.registration, guess, self._reach(i, j, kind)
        )
        T = mounts[i] @ found.T_target_source @ rigid.inverse(mounts[j])
        return Attempt(i, j, kind, T, moved(found.covariance, mounts[j]), found.matched, self._verdict(found, T, kind))

    def _reach(self, i: int, j: int, kind: str) -> tuple[float, float]:
        """How far (m, rad) a registration may be from the estimate: three standard deviations of the odometry between
        neighbours; between others the gate and ``max_drift_rad``."""
        settings = self.config.reference
        if kind != ALONG:
            return max(settings.gates_m), settings.max_drift_rad
        root_m = 3.0 * max(abs(self.nodes.distance_m[j] - self.nodes.distance_m[i]), 1.0) ** 0.5
        return root_m * settings.odometry_translation_sigma_m, root_m * settings.odometry_rotation_sigma_rad

    def _verdict(self, found: Registration, T_i_j: Array, kind: str) -> str:
        """The registration's own, but neighbours may slide: odometry holds them where the covariance says nothing."""
        if not (found.accepted or (kind == ALONG and found.reason == SLIDES)):
            return found.reason
        tilted = self.planar and np.arccos(np.clip(T_i_j[2, 2], -1, 1)) > LARGEST_TILT_RAD
        return TILTED if tilted else ACCEPTED

    def accepted(self) -> tuple[Integers, SpatialEdges]:
        """Numbers of the attempts that hold so far, and their edges."""
        rows = [k for k, attempt in enumerate(self.attempts) if attempt.reason in (ACCEPTED, CONTRADICTED)]
        chosen = [self.attempts[k] for k in rows]
        edges = SpatialEdges(
            np.array([attempt.i for attempt in chosen], dtype=np.int64),
            np.array([attempt.j for attempt in chosen], dtype=np.int64),
            np.array([attempt.T_i_j for attempt in chosen]).reshape(-1, 4, 4),
            np.array([attempt.covariance for attempt in chosen]).reshape(-1, 6, 6),
        )
        return np.array(rows, dtype=np.int64), edges

    def mark(self, rows: Integers, holds: NDArray[np.bool_]) -> None:
        """Say of accepted attempts whether the others contradict them."""
        for row, hold in zip(rows.tolist(), holds.tolist(), strict=True):
            attempt = self.attempts[row]
            self.attempts[row] = Attempt(**{**vars(attempt), "reason": ACCEPTED if hold else CONTRADICTED})


def _solved(
    nodes: Nodes, odometry: SpatialEdges, trial: _Trial, poses: Array, planar: bool, config: ReferenceConfig
) -> tuple[SpatialGraph, Integers, bool]:
    """Tie walks by what was accepted, leave out what contradicts the ties, and optimize."""
    rows, loops = trial.accepted()
    first = np.array([np.argmax(nodes.walk == k) for k in nodes.walk])
    T_walk_body = nodes.T_odom_body[first] @ rigid.inverse(poses[first]) @ poses
    tied, part, holds = tie_walks(nodes.walk, T_walk_body, loops, config)
    trial.mark(rows, holds)
    anchors = np.array([np.argmax(part == p) for p in np.unique(part)], dtype=np.int64)
    graph = SpatialGraph(tied, odometry, loops.select(holds), anchors, nodes.walk, nodes.measured)
    graph, converged = solve(graph, planar, config)
    return graph, part, converged


def corrected_path(raw: Recording, followed: Recording, nodes: Nodes, T_map_body: Array, walk: int) -> Array:
    """Poses (m, 4, 4) at the raw odometry's times: the followed path, moved along with its nodes."""
    mine = np.flatnonzero(nodes.walk == walk)
    path = followed.T_odom_body
    if len(mine):
        path = rigid.bent(followed.time_s, path, nodes.time_s[mine], T_map_body[mine])
    return rigid.interpolate(followed.time_s, path, raw.time_s)
