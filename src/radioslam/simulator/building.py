"""A floor of a building: walls that weaken radio, and convex areas where people walk.

The frame has x to the east and y to the north; all lengths are metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CONCRETE = "concrete"
PARTITION = "partition"
GLASS = "glass"

WALL_LOSS_DB = {
    CONCRETE: 10.0,  # 15-20 cm reinforced concrete near 2.4 GHz; surveys find 8-15 dB
    PARTITION: 3.0,  # plasterboard on studs; COST 231 has 3.4 dB for a light wall
    GLASS: 2.0,  # one pane without metal coating
}


@dataclass(frozen=True)
class Wall:
    """A straight piece of wall from ``start_xy`` to ``end_xy``, without openings."""

    start_xy: tuple[float, float]
    end_xy: tuple[float, float]
    kind: str = CONCRETE

    @property
    def loss_db(self) -> float:
        """Attenuation of one crossing at 2.4 GHz."""
        return WALL_LOSS_DB[self.kind]


@dataclass(frozen=True)
class Area:
    """A rectangle in which every straight line can be walked: a room, a corridor, a hall."""

    name: str
    west_m: float
    south_m: float
    east_m: float
    north_m: float
    is_room: bool = False

    @property
    def centre_xy(self) -> tuple[float, float]:
        """The middle."""
        return (self.west_m + self.east_m) / 2, (self.south_m + self.north_m) / 2

    def contains(self, points_xy: ArrayLike, margin_m: float = 0.0) -> NDArray[np.bool_]:
        """Which of the points (n, 2) lie inside, at least ``margin_m`` from the rim."""
        x, y = np.asarray(points_xy, dtype=float).T
        inside_x = (x >= self.west_m + margin_m) & (x <= self.east_m - margin_m)
        return np.asarray(inside_x & (y >= self.south_m + margin_m) & (y <= self.north_m - margin_m))

    def clip(self, points_xy: ArrayLike, margin_m: float) -> Array:
        """The points (n, 2) moved inside, ``margin_m`` from the rim (or to the middle of a narrow area)."""
        margin = np.minimum(margin_m, [(self.east_m - self.west_m) / 2, (self.north_m - self.south_m) / 2])
        low = np.array([self.west_m, self.south_m]) + margin
        return np.clip(points_xy, low, np.array([self.east_m, self.north_m]) - margin)

    def overlap(self, other: Area) -> Area | None:
        """The common rectangle, or None where they do not overlap."""
        west, east = max(self.west_m, other.west_m), min(self.east_m, other.east_m)
        south, north = max(self.south_m, other.south_m), min(self.north_m, other.north_m)
        if west >= east or south >= north:
            return None
        return Area(f"{self.name}/{other.name}", west, south, east, north)


@dataclass(frozen=True)
class Door:
    """A way through a wall, walked along the straight line between a point in each of two areas."""

    area_a: str
    point_a_xy: tuple[float, float]
    area_b: str
    point_b_xy: tuple[float, float]


@dataclass(frozen=True)
class Building:
    """One storey, repeated for every floor.

    Attributes:
        width_m, depth_m: extent along x and y, from the frame's zero.
        walls: without their openings.  areas: overlapping areas are open to each other.
        doors: ways between areas that a wall separates.  start_xy: where every walk begins.
        storey_height_m: from floor to floor.
    """

    width_m: float
    depth_m: float
    walls: tuple[Wall, ...]
    areas: tuple[Area, ...]
    doors: tuple[Door, ...]
    start_xy: tuple[float, float]
    storey_height_m: float

    def wall_ends(self, kind: str | None = None) -> Array:
        """Walls as rows (x0, y0, x1, y1), all of them or those of one kind."""
        chosen = [wall for wall in self.walls if kind in (None, wall.kind)]
        return np.array([(*wall.start_xy, *wall.end_xy) for wall in chosen]).reshape(-1, 4)

    def wall_loss_db(self, from_xy: Array, to_xy: Array) -> Array:
        """Summed loss (n, m) of the walls between points (n, 2) and (m, 2) at 2.4 GHz."""
        return crossing_sum(from_xy, to_xy, self.wall_ends(), np.array([w.loss_db for w in self.walls]))

    def walkable(self, points_xy: Array) -> NDArray[np.bool_]:
        """Which of the points (n, 2) lie in an area or on the way through a door."""
        inside = [area.contains(points_xy, -1e-9) for area in self.areas]
        through = [_near_segment(points_xy, d.point_a_xy, d.point_b_xy, 0.5) for d in self.doors]
        return np.any(inside + through, axis=0)


def crossing_sum(from_xy: Array, to_xy: Array, wall_ends: Array, weight: Array) -> Array:
    """Sum of the weights (w,) of the walls (w, 4) that cross the lines from (n, 2) to (m, 2), shape (n, m).

    A wall is crossed when the two points lie on different sides of it and its ends on different sides of the
    line between them. The second test needs cross(a - p, w - p) = a×w - a×p - p×w, whose terms are outer
    products, so that the work per wall is a few passes over an (n, m) array.
    """
    total = np.zeros((len(from_xy), len(to_xy)))
    line = _cross(to_xy[None, :], from_xy[:, None])
    for x0, y0, x1, y1, value in np.column_stack([wall_ends, weight]):
        start, end = np.array([x0, y0]), np.array([x1, y1])
        side_from = _cross(end - start, from_xy - start) > 0
        side_to = _cross(end - start, to_xy - start) > 0
        left = _cross(to_xy, start)[None, :] - _cross(from_xy, start)[:, None] > line
        right = _cross(to_xy, end)[None, :] - _cross(from_xy, end)[:, None] > line
        total += value * ((side_from[:, None] != side_to[None, :]) & (left != right))
    return total


def segments_crossed(path_xy: Array, wall_ends: Array) -> Array:
    """How many walls (w, 4) each of the pieces of a path (n, 2) crosses, shape (n - 1,)."""
    a, b = path_xy[:-1, None], path_xy[1:, None]
    start, end = wall_ends[None, :, :2], wall_ends[None, :, 2:]
    apart = (_cross(end - start, a - start) > 0) != (_cross(end - start, b - start) > 0)
    across = (_cross(b - a, start - a) > 0) != (_cross(b - a, end - a) > 0)
    return np.sum(apart & across, axis=1).astype(float)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _near_segment(points_xy: Array, a: ArrayLike, b: ArrayLike, reach_m: float) -> NDArray[np.bool_]:
    start, along = np.asarray(a, dtype=float), np.subtract(b, a)
    share = np.clip((points_xy - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points_xy - start - share[:, None] * along, axis=1) <= reach_m)
