"""What a depth camera sees of a building: walls, lintels over doors, floor, ceiling, pillars and furniture.

Everything is made of upright and level rectangles. Furniture stands flat against walls, where nobody walks, and in the
open, clear of the paths that are walked: people go round it. It is the same for all walks of a survey.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from radioslam.simulator.building import Building
from radioslam.simulator.floor_plan import DOOR_WIDTH_M
from radioslam.simulator.streams import random_stream
from radioslam.simulator.walkable import WALL_CLEARANCE_M

Array = NDArray[np.float64]

DOOR_HEIGHT_M = 2.1
WALL_PIECE_M = 1.6
"""Mean distance between pieces along a wall: radiators, cupboards, notice boards, pilasters."""
OPEN_PIECE_M2 = 5.0
"""Floor per piece in the open: pillars, tables, cupboards, counters."""
WAY_CLEARANCE_M = 0.7
"""Pieces in the open keep this distance from where people walk, given once per second."""


@dataclass(frozen=True)
class Scene:
    """Rectangles: ``upright`` rows (x0, y0, x1, y1, z_low, z_high), ``level`` rows (west, south, east, north, z)."""

    upright: Array
    level: Array


def furnish(building: Building, paths_xy: Array, seed: int) -> Scene:
    """The scene of one storey, clear of the paths (n, 2) of its walkers; the same seed gives the same furniture."""
    rng = random_stream(seed, "furniture")
    height = building.storey_height_m
    walls = building.wall_ends()
    upright = [np.column_stack([walls, np.zeros(len(walls)), np.full(len(walls), height)]), _lintels(building)]
    plan = [0.0, 0.0, building.width_m, building.depth_m]
    level = [np.array([[*plan, 0.0], [*plan, height]])]
    boxes = np.concatenate([_along_walls(building, rng), _in_the_open(building, paths_xy, rng)])
    upright.append(_sides(boxes))
    level.append(boxes[:, [0, 1, 2, 3, 5]])
    level.append(boxes[boxes[:, 4] > 0][:, [0, 1, 2, 3, 4]])  # what hangs has an underside
    return Scene(np.concatenate(upright), np.concatenate(level))


def _lintels(building: Building) -> Array:
    """The wall above each door, across the way through it."""
    rows = []
    for door in building.doors:
        middle = np.add(door.point_a_xy, door.point_b_xy) / 2
        way = np.subtract(door.point_b_xy, door.point_a_xy)
        half = np.array([-way[1], way[0]]) / np.linalg.norm(way) * DOOR_WIDTH_M / 2
        rows.append([*(middle - half), *(middle + half), DOOR_HEIGHT_M, building.storey_height_m])
    return np.array(rows).reshape(-1, 6)


def _along_walls(building: Building, rng: np.random.Generator) -> Array:
    """Boxes (west, south, east, north, low, high) that stand out from walls by less than walkers keep away."""
    boxes = []
    for x0, y0, x1, y1 in building.wall_ends():
        length = float(np.hypot(x1 - x0, y1 - y0))
        along = 0 if y0 == y1 else 1
        at = float(rng.uniform(0.2, WALL_PIECE_M))
        while at < length - 0.3:
            width = min(float(rng.uniform(0.15, 1.2)), length - 0.1 - at)
            low, high = _heights(rng)
            reach = float(rng.uniform(0.08, WALL_CLEARANCE_M - 0.1)) * (1 if rng.random() < 0.5 else -1)
            start = min(x0, x1) + at if along == 0 else min(y0, y1) + at
            span, depth = (start, start + width), sorted((0.0, reach))
            if along == 0:
                boxes.append([span[0], y0 + depth[0], span[1], y0 + depth[1], low, high])
            else:
                boxes.append([x0 + depth[0], span[0], x0 + depth[1], span[1], low, high])
            at += width + float(rng.exponential(WALL_PIECE_M / 2)) + 0.2
    return np.array(boxes).reshape(-1, 6)


def _heights(rng: np.random.Generator) -> tuple[float, float]:
    """Standing on the floor, or hung up."""
    low = 0.0 if rng.random() < 0.6 else float(rng.uniform(0.6, 1.6))
    return low, low + float(rng.uniform(0.3, 1.8))


def _in_the_open(building: Building, paths_xy: Array, rng: np.random.Generator) -> Array:
    """Boxes on the floor of rooms, corridors and halls, clear of the paths (n, 2)."""
    ways = KDTree(paths_xy)
    boxes = []
    for area in building.areas:
        size = np.array([area.east_m - area.west_m, area.north_m - area.south_m])
        for _ in range(int(size.prod() / OPEN_PIECE_M2)):
            half = rng.uniform(0.15, 0.6, 2)
            centre = np.array([area.west_m, area.south_m]) + half + rng.random(2) * (size - 2 * half)
            high = float(building.storey_height_m if rng.random() < 0.2 else rng.uniform(0.4, 2.0))
            if ways.query(centre)[0] > WAY_CLEARANCE_M + np.hypot(*half):
                boxes.append([*(centre - half), *(centre + half), 0.0, high])
    return np.array(boxes).reshape(-1, 6)


def _sides(boxes: Array) -> Array:
    """The four upright sides of each box."""
    west, south, east, north, low, high = boxes.T
    corners = [(west, south), (east, south), (east, north), (west, north)]
    sides = [(*corners[k], *corners[(k + 1) % 4], low, high) for k in range(4)]
    return np.concatenate([np.column_stack(side) for side in sides])
