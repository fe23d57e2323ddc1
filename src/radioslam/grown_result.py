"""A growing map as a ``SlamResult``: all that a batch run tells, as it stands now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import Config
from radioslam.fingerprints import Fingerprints, represent
from radioslam.loops import Loops
from radioslam.mapped_walk import MappedWalk, Ties, joined
from radioslam.merging import MergedTracks, merge_tracks, standing_at
from radioslam.pose_graph import PoseGraph
from radioslam.radio_map import RadioMap
from radioslam.results import FOUND_STARTS, SlamResult, SolverStatus
from radioslam.settling import Knowledge
from radioslam.similarity import Pairs
from radioslam.slam import build_pose_graph

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def as_result(
    walks: Sequence[MappedWalk], ties: Ties, knowledge: Knowledge, status: SolverStatus, config: Config
) -> SlamResult:
    """The result of walks in the order of their names; ``status`` is that of the last full optimization."""
    fingerprints = joined([one.fingerprints for one in walks])
    known = config.merging.model_copy(update={"starts": "known"})
    strengths = represent(fingerprints.rss_dbm, config.fingerprints)
    merged = merge_tracks([one.held() for one in walks], fingerprints, strengths, knowledge.uncertainty, known)
    loops = _loops(walks, ties)
    found = config.merging.starts in FOUND_STARTS or any(one.reason for one in walks)
    return SlamResult(
        config=config,
        radio_map=_radio_map(walks, fingerprints),
        odometry_poses=_wrapped(merged.poses[merged.node_of_fingerprint]),
        distance_m=fingerprints.distance_m,
        references=tuple(one.track.walk.reference for one in walks),
        loops=loops,
        uncertainty=knowledge.uncertainty,
        graph=_graph(walks, merged, loops, knowledge, config),
        solver=status,
        devices=tuple(one.track.walk.device for one in walks),
        placed_sigma_m=tuple(_placed_sigma_m(one) for one in walks) if found else (),
        untied_reason=tuple(one.reason for one in walks) if found else (),
    )


def _placed_sigma_m(walk: MappedWalk) -> float:
    return np.nan if walk.fix is None or walk.fix.sigma_m is None else walk.fix.sigma_m


def _radio_map(walks: Sequence[MappedWalk], fingerprints: Fingerprints) -> RadioMap:
    tied = np.array([one.tied for one in walks])
    number = np.where(tied, 0, np.cumsum(~tied) - (0 if tied.any() else 1))
    return RadioMap(
        walks=tuple(one.name for one in walks),
        walk=fingerprints.walk,
        time_s=fingerprints.time_s,
        poses=_wrapped(np.concatenate([one.poses for one in walks])),
        sigma_m=np.concatenate([one.sigma_m for one in walks]),
        map=number[fingerprints.walk],
        rss_dbm=fingerprints.rss_dbm,
        transmitters=fingerprints.transmitters,
    )


def _loops(walks: Sequence[MappedWalk], ties: Ties) -> Loops:
    """The ties as pairs of scans i < j in the order of the walks."""
    first = np.concatenate([[0], np.cumsum([len(one.fingerprints) for one in walks])])
    offset = np.zeros(max(one.number for one in walks) + 1, np.int64)
    offset[[one.number for one in walks]] = first[:-1]
    one, other = offset[ties.walk_i] + ties.scan_i, offset[ties.walk_j] + ties.scan_j
    i, j = np.minimum(one, other), np.maximum(one, other)
    order = np.lexsort((j, i))
    return Loops(Pairs(i[order], j[order], ties.similarity[order]), ties.reason[order])


def _graph(
    walks: Sequence[MappedWalk], merged: MergedTracks, loops: Loops, knowledge: Knowledge, config: Config
) -> PoseGraph:
    """The graph of all walks at the poses they have; loops are parted by the radio's lag as the map knows it."""
    standing = standing_at(merged, np.concatenate([one.poses for one in walks]))
    graph = build_pose_graph(standing, loops, knowledge.uncertainty, config)
    if graph.loop_velocity is None or knowledge.radio_lag_s is None:
        return graph
    parted = planar.rotate(-graph.poses[graph.loops.i, 2], knowledge.radio_lag_s * graph.loop_velocity)
    return replace(graph, loops=replace(graph.loops, measurement=np.column_stack([parted, np.zeros(len(parted))])))


def _wrapped(poses: Array) -> Array:
    return np.column_stack([poses[:, :2], planar.wrap(poses[:, 2])])
