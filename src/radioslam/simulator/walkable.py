"""Where people can go: a graph whose edges are straight lines inside one convex area, or through one door."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from radioslam.simulator.building import Area, Building

Array = NDArray[np.float64]

PLACE_SPACING_M = 8.0
"""Destinations inside an area stand this far apart, so that large halls are crossed in many ways."""
WALL_CLEARANCE_M = 0.5


@dataclass(frozen=True)
class WalkableGraph:
    """Places and the straight ways between them.

    Attributes:
        places_xy: (n, 2).  destinations: indices of places worth going to.  in_room: (n,) bool.
        edges: (m, 2) pairs of places.  edge_area: (m,) index of the area that holds the edge, -1 for a door.
    """

    places_xy: Array
    destinations: NDArray[np.int64]
    in_room: NDArray[np.bool_]
    edges: NDArray[np.int64]
    edge_area: NDArray[np.int64]

    def route(self, source: int, target: int, cost_factor: Array) -> list[int]:
        """The cheapest way from place to place, edge lengths multiplied by ``cost_factor`` (m,)."""
        a, b = self.edges.T
        cost = np.linalg.norm(self.places_xy[a] - self.places_xy[b], axis=1) * cost_factor + 1e-6
        count = len(self.places_xy)
        graph = coo_array((cost, (a, b)), shape=(count, count)).tocsr()
        _, before = dijkstra(graph, directed=False, indices=source, return_predecessors=True)
        path = [target]
        while path[-1] != source:
            path.append(int(before[path[-1]]))
        return path[::-1]

    def area_of_edges(self) -> dict[tuple[int, int], int]:
        """Area index of every edge, in both directions."""
        pairs = zip(self.edges.tolist(), self.edge_area.tolist(), strict=True)
        return {key: area for (a, b), area in pairs for key in ((a, b), (b, a))}


def walkable_graph(building: Building) -> WalkableGraph:
    """Places at doors, where areas overlap and on a lattice inside each area; place 0 is the start."""
    maker = _Maker(building)
    maker.add_place(building.start_xy, _areas_at(building, building.start_xy), destination=True)
    for door in building.doors:
        maker.add_door(door.area_a, door.point_a_xy, door.area_b, door.point_b_xy)
    for (i, first), (j, second) in combinations(enumerate(building.areas), 2):
        common = first.overlap(second)
        if common is not None:
            maker.add_place(common.centre_xy, [i, j], destination=False)
    for index, area in enumerate(building.areas):
        for place in _lattice(area):
            maker.add_place(place, [index], destination=True)
    return maker.graph()


class _Maker:
    def __init__(self, building: Building) -> None:
        self.building = building
        self.index = {area.name: i for i, area in enumerate(building.areas)}
        self.places: list[tuple[float, float]] = []
        self.members: list[list[int]] = [[] for _ in building.areas]
        self.destinations: list[int] = []
        self.doors: list[tuple[int, int]] = []

    def add_place(self, at: tuple[float, float], areas: list[int], destination: bool) -> int:
        self.places.append(at)
        number = len(self.places) - 1
        for area in areas:
            self.members[area].append(number)
        if destination:
            self.destinations.append(number)
        return number

    def add_door(self, area_a: str, a: tuple[float, float], area_b: str, b: tuple[float, float]) -> None:
        first = self.add_place(a, [self.index[area_a]], destination=False)
        second = self.add_place(b, [self.index[area_b]], destination=False)
        self.doors.append((first, second))

    def graph(self) -> WalkableGraph:
        inside = {pair: area for area, members in enumerate(self.members) for pair in combinations(members, 2)}
        edges = inside | dict.fromkeys(self.doors, -1)
        in_room = np.zeros(len(self.places), dtype=bool)
        for area, members in zip(self.building.areas, self.members, strict=True):
            in_room[members] |= area.is_room
        return WalkableGraph(
            np.array(self.places),
            np.array(self.destinations),
            in_room,
            np.array(list(edges), dtype=np.int64),
            np.array(list(edges.values()), dtype=np.int64),
        )


def _areas_at(building: Building, point_xy: tuple[float, float]) -> list[int]:
    return [i for i, area in enumerate(building.areas) if area.contains([point_xy])[0]]


def _lattice(area: Area) -> list[tuple[float, float]]:
    columns = _spread(area.west_m, area.east_m)
    rows = _spread(area.south_m, area.north_m)
    return [(float(x), float(y)) for x in columns for y in rows]


def _spread(low_m: float, high_m: float) -> Array:
    count = max(1, round((high_m - low_m) / PLACE_SPACING_M))
    return low_m + (np.arange(count) + 0.5) * (high_m - low_m) / count
