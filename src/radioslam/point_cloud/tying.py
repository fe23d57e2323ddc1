"""Bringing walks into one frame: the motion between two walks that most registrations agree on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import ReferenceConfig
from radioslam.point_cloud.spatial_graph import SpatialEdges

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]


def tie_walks(
    walk: Integers, T_walk_body: Array, loops: SpatialEdges, config: ReferenceConfig
) -> tuple[Array, Integers, Mask]:
    """Lay walks over each other by the loops between them.

    Each loop says T_a_b = x_i z_ij x_j⁻¹ of its two walks. Drift makes good loops differ a little and wrong ones a lot:
    the motion stands that most loops agree with within ``tie_distance_m`` and ``tie_angle_rad``, if there are
    ``least_ties`` of them. Pairs of walks are joined in the order of that number, as in a spanning tree.

    Args:
        walk: (n,) walk of each node.  T_walk_body: (n, 4, 4) poses in each walk's frame.
        loops: registrations that were accepted; those within one walk are left alone.
        config: the limits above.

    Returns:
        Poses (n, 4, 4), the part (n,) of each node (walks of one part share a frame), and the loops (m,) that hold.
    """
    a, b = walk[loops.i], walk[loops.j]
    T_a_b = T_walk_body[loops.i] @ loops.T_i_j @ rigid.inverse(T_walk_body[loops.j])
    holds = a == b
    ties = []
    for pair in sorted({(int(p), int(q)) for p, q in zip(a, b, strict=True) if p != q}):
        here = np.flatnonzero((a == pair[0]) & (b == pair[1]))
        best, agree = _consensus(T_a_b[here], T_walk_body[loops.j[here]], config)
        if len(agree) >= config.least_ties:
            holds[here[agree]] = True
            ties.append((len(agree), pair, T_a_b[here[best]]))
    T_part_walk, part_of_walk = _span(int(walk.max()) + 1, ties)
    return T_part_walk[walk] @ T_walk_body, part_of_walk[walk], holds


def _consensus(T_a_b: Array, T_b_body: Array, config: ReferenceConfig) -> tuple[int, Integers]:
    """The loop whose motion most of the loops agree with, where they were made, and which those are."""
    placed = T_a_b[:, None] @ T_b_body[None, :]
    own = T_a_b[np.arange(len(T_a_b))] @ T_b_body
    metres, radians = rigid.apart(placed, own[None, :])
    agrees = (metres <= config.tie_distance_m) & (radians <= config.tie_angle_rad)
    best = int(agrees.sum(axis=1).argmax())
    return best, np.flatnonzero(agrees[best])


def _span(walks: int, ties: list[tuple[int, tuple[int, int], Array]]) -> tuple[Array, Integers]:
    """T_part_walk (walks, 4, 4) and the part of each walk, joining by the strongest ties first."""
    T = np.tile(np.eye(4), (walks, 1, 1))
    part = np.arange(walks)
    for _, (a, b), T_a_b in sorted(ties, key=lambda tie: (-tie[0], tie[1])):
        if part[a] == part[b]:
            continue
        moved = np.flatnonzero(part == part[b])
        T[moved] = T[a] @ T_a_b @ rigid.inverse(T[b]) @ T[moved]
        part[moved] = part[a]
    return T, part
