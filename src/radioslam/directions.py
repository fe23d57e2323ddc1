"""The directions a building runs in, learned from how its visitors walk.

Most buildings are laid out along two perpendicular axes, and people walk along them. The straight legs of all walks
show whether that is so here, and where the axes lie; then each leg that runs nearly along one says what the walk's
compass does not know. In pedestrian dead reckoning this is heuristic drift elimination (Borenstein and Ojeda 2010);
here the axis is an unknown of the graph, and legs that run otherwise are outliers of a robust loss.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import DirectionsConfig
from radioslam.factors import off_axis
from radioslam.merging import MergedTracks
from radioslam.pose_graph import Legs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SHORTEST_EDGE_M = 0.7
"""A shorter move between two nodes is standing: its direction means nothing."""
STRAIGHTNESS = 0.985
"""Least chord over path of a leg."""
NEAR_RAD = np.radians(10.0)
"""A leg within so much of an axis runs along it. By chance 22 % of all legs do."""


def straight_legs(merged: MergedTracks, config: DirectionsConfig) -> Legs | None:
    """The straight legs of all walks with the axis they share; None where they are few or share none.

    The axis is sought under the current estimate, the legs in each walk's odometry.
    """
    begin, end, length_m = find_legs(merged, config)
    if not config.use or len(begin) < config.min_legs:
        return None
    chord = merged.poses[end, :2] - merged.poses[begin, :2]
    axis_rad, share = shared_axis(np.arctan2(chord[:, 1], chord[:, 0]), length_m)
    if share < config.min_share:
        return None
    return Legs(begin, end, np.hypot(config.sigma_rad, config.lateral_sigma_m / length_m), axis_rad)


def find_legs(merged: MergedTracks, config: DirectionsConfig) -> tuple[Integers, Integers, Array]:
    """First and last node (m,) and length (m,) of every straight leg of at least ``min_leg_m``.

    A leg is a run of moves between nodes of one walk, each within ``max_turn_rad`` of the one before.
    """
    positions = np.concatenate(
        [track.at(merged.time_s[merged.walk == k])[:, :2] for k, track in enumerate(merged.tracks)]
    )
    move = np.diff(positions, axis=0)
    length = np.hypot(*move.T)
    edge = np.flatnonzero((np.diff(merged.walk) == 0) & (length > SHORTEST_EDGE_M))
    if not len(edge):
        return edge, edge, np.zeros(0)
    direction = np.arctan2(move[edge, 1], move[edge, 0])
    turns = np.abs(planar.wrap(np.diff(direction))) > config.max_turn_rad
    first = np.flatnonzero(np.append(True, turns | (np.diff(merged.walk[edge]) != 0)))
    begin, end = edge[first], edge[np.append(first[1:], len(edge)) - 1] + 1
    path, chord = np.add.reduceat(length[edge], first), np.hypot(*(positions[end] - positions[begin]).T)
    straight = (chord >= config.min_leg_m) & (chord >= STRAIGHTNESS * path)
    return begin[straight], end[straight], chord[straight]


def shared_axis(direction_rad: Array, length_m: Array) -> tuple[float, float]:
    """The axis in [0, π/2) that most metres of the legs (m,) run along or across, and the share of them that do."""
    grid = np.radians(np.arange(0.0, 90.0, 0.5))
    off = off_axis(direction_rad[:, None] - grid)
    best = int(np.argmax(length_m @ np.exp(-0.5 * (off / (0.6 * NEAR_RAD)) ** 2)))
    return float(grid[best]), float(length_m @ (np.abs(off[:, best]) < NEAR_RAD) / length_m.sum())
