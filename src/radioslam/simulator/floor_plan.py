"""Drawing a floor: corridors, rows of rooms with doors, and walls with openings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from radioslam.simulator.building import CONCRETE, PARTITION, Area, Building, Door, Wall

DOOR_WIDTH_M = 1.2
DOOR_APPROACH_M = 0.6
"""People pass a door straight: from this far before the wall to as far behind it."""

Point = tuple[float, float]


class FloorPlan:
    """Collects walls, areas and doors; ``build()`` makes the immutable ``Building``."""

    def __init__(self, width_m: float, depth_m: float) -> None:
        self.width_m, self.depth_m = width_m, depth_m
        self._walls: list[Wall] = []
        self._areas: list[Area] = []
        self._doors: list[Door] = []
        corners = [(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m), (0.0, 0.0)]
        for a, b in pairwise(corners):
            self.wall(a, b)

    def area(self, name: str, bounds: tuple[float, float, float, float], is_room: bool = False) -> str:
        """An area from (west, south, east, north); returns its name."""
        self._areas.append(Area(name, *bounds, is_room=is_room))
        return name

    def wall(self, a: Point, b: Point, kind: str = CONCRETE, openings: Sequence[float] = ()) -> None:
        """A wall parallel to an axis; ``openings`` are the middles of door-wide gaps (x or y along it)."""
        along = 0 if a[1] == b[1] else 1
        low, high = sorted((a[along], b[along]))
        half = DOOR_WIDTH_M / 2
        edges = [low, *sorted(e for o in openings for e in (o - half, o + half)), high]
        across = a[1 - along]
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            ends = [(start, across), (end, across)] if along == 0 else [(across, start), (across, end)]
            self._walls.append(Wall(ends[0], ends[1], kind))

    def door(self, area_a: str, area_b: str, at: Point, towards_b: Point) -> None:
        """A door at a point of a wall; ``towards_b`` is the unit vector from area a into area b."""
        step = np.multiply(towards_b, DOOR_APPROACH_M)
        x, y = at
        self._doors.append(Door(area_a, (x - step[0], y - step[1]), area_b, (x + step[0], y + step[1])))

    def rooms_in_row(
        self,
        name: str,
        edges_m: Sequence[float],
        front_m: float,
        back_m: float,
        corridor: str,
        along: int = 0,
        front: str = CONCRETE,
        sides: str = PARTITION,
    ) -> None:
        """Rooms side by side between ``edges_m`` along x (``along=0``) or y, doors in the front wall.

        The front wall at ``front_m`` faces the corridor, the rooms reach to ``back_m``.
        """

        def point(a: float, b: float) -> Point:
            return (a, b) if along == 0 else (b, a)

        inward = point(0.0, float(np.sign(back_m - front_m)))
        middles = [(a + b) / 2 for a, b in pairwise(edges_m)]
        self.wall(point(edges_m[0], front_m), point(edges_m[-1], front_m), front, middles)
        for edge in edges_m[1:-1]:
            self.wall(point(edge, front_m), point(edge, back_m), sides)
        for number, (a, b) in enumerate(pairwise(edges_m)):
            low, high = sorted((front_m, back_m))
            bounds = (a, low, b, high) if along == 0 else (low, a, high, b)
            room = self.area(f"{name}{number + 1}", bounds, is_room=True)
            self.door(corridor, room, point(middles[number], front_m), inward)

    def build(self, start_xy: Point, storey_height_m: float = 3.6) -> Building:
        """The finished floor, with the place where all walks begin."""
        return Building(
            self.width_m,
            self.depth_m,
            tuple(self._walls),
            tuple(self._areas),
            tuple(self._doors),
            start_xy,
            storey_height_m,
        )
