"""Which clouds may show the same place: neighbours along a walk, neighbours in the estimate, and radio likeness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from radioslam import rigid
from radioslam.config import Config, ReferenceConfig
from radioslam.fingerprints import collect_fingerprints, represent
from radioslam.odometry import estimate_odometry
from radioslam.point_cloud.nodes import Nodes
from radioslam.point_cloud.recordings import Recording
from radioslam.similarity import similar_pairs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def along_walks(nodes: Nodes, ahead: int) -> Integers:
    """Pairs (m, 2) of each node with the next ones of its walk, up to ``ahead`` of them."""
    k = np.arange(len(nodes))
    pairs = [np.column_stack([k[:-step], k[step:]]) for step in range(1, min(ahead, len(nodes) - 1) + 1)]
    joined = np.concatenate([np.zeros((0, 2), np.int64), *pairs])
    return joined[nodes.walk[joined[:, 0]] == nodes.walk[joined[:, 1]]]


def near_in_estimate(
    nodes: Nodes, T_map_body: Array, part: Integers, gate_m: float, tried: set[tuple[int, int]], config: ReferenceConfig
) -> Integers:
    """Pairs (m, 2), nearest first, whose clouds' middles lie within the gate under the estimate (n, 4, 4).

    Sensors must look the same way within ``max_turn_rad``, nodes of one walk be ``least_walked_m`` apart along it, and
    both belong to one part (n,) of the map. Between two stretches of path only the nearest pair is a candidate, and
    each stretch is tried with ``loops_per_stretch`` others.
    """
    sensor = T_map_body @ nodes.T_body_sensor
    middle = rigid.transform(sensor, nodes.middle[:, None, :])[:, 0]
    pairs = KDTree(middle).query_pairs(gate_m, output_type="ndarray").astype(np.int64).reshape(-1, 2)
    i, j = pairs.T
    near_in_time = (nodes.walk[i] == nodes.walk[j]) & (
        np.abs(nodes.distance_m[i] - nodes.distance_m[j]) < config.least_walked_m
    )
    turned = rigid.apart(sensor[i], sensor[j])[1]
    i, j = pairs[~near_in_time & (part[i] == part[j]) & (turned <= config.max_turn_rad)].T
    order = np.argsort(np.linalg.norm(middle[i] - middle[j], axis=1), kind="stable")
    return _spread(nodes, np.column_stack([i[order], j[order]]), tried, config)


def _spread(nodes: Nodes, pairs: Integers, tried: set[tuple[int, int]], config: ReferenceConfig) -> Integers:
    """Of pairs in order of preference: one per two stretches, few per stretch, none that was tried before."""
    number = np.floor(nodes.distance_m / config.stretch_m).astype(np.int64)
    stretch = nodes.walk * (int(number.max(initial=0)) + 1) + number
    count: dict[int, int] = {}
    seen: set[tuple[int, int]] = set()
    kept = []
    for i, j in pairs.tolist():
        a, b = int(stretch[i]), int(stretch[j])
        key = (min(a, b), max(a, b))
        full = max(count.get(a, 0), count.get(b, 0)) >= config.loops_per_stretch
        if key in seen or full or (i, j) in tried:
            continue
        seen.add(key)
        count[a], count[b] = count.get(a, 0) + 1, count.get(b, 0) + 1
        kept.append((i, j))
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


def alike_by_radio(nodes: Nodes, recordings: Sequence[Recording], config: Config) -> Integers:
    """Pairs (m, 2) of nodes of different walks at whose times the phones heard much the same.

    Each scan is paired with the ``radio_candidates`` scans of every other walk that are most similar to it, at least
    ``similarity_threshold``; the nodes are those next in time to the scans. Walks without scans have no pairs.
    """
    heard = [k for k, recording in enumerate(recordings) if recording.walk is not None and len(recording.walk.wifi)]
    if len(heard) < 2:
        return np.zeros((0, 2), np.int64)
    walks = [walk for k in heard if (walk := recordings[k].walk) is not None]
    prints = collect_fingerprints(estimate_odometry(walks, config.odometry), config.fingerprints)
    strengths = represent(prints.rss_dbm, config.fingerprints)
    similar = similar_pairs(strengths, config.reference.similarity_threshold)
    similar = similar.select(prints.walk[similar.i] != prints.walk[similar.j])
    similar = similar.select(np.argsort(-similar.similarity, kind="stable"))
    recording_of = np.array(heard)[prints.walk]
    node = np.array([_node_at(nodes, int(k), t) for k, t in zip(recording_of, prints.time_s, strict=True)])
    taken: dict[tuple[int, int], int] = {}
    kept: dict[tuple[int, int], None] = {}
    for a, b in zip(similar.i.tolist(), similar.j.tolist(), strict=True):
        claims = [(a, int(prints.walk[b])), (b, int(prints.walk[a]))]
        if max(taken.get(claim, 0) for claim in claims) >= config.reference.radio_candidates:
            continue
        for claim in claims:
            taken[claim] = taken.get(claim, 0) + 1
        if min(node[a], node[b]) >= 0:
            kept[int(min(node[a], node[b])), int(max(node[a], node[b]))] = None
    return np.array(list(kept), dtype=np.int64).reshape(-1, 2)


def _node_at(nodes: Nodes, walk: int, time_s: float) -> int:
    """The node of a walk next in time, -1 where it has none."""
    mine = np.flatnonzero(nodes.walk == walk)
    return int(mine[np.abs(nodes.time_s[mine] - time_s).argmin()]) if len(mine) else -1
