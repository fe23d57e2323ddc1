"""People on errands: routes through the walkable graph, walked with changing speed and pauses."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from radioslam.planar import path_length
from radioslam.simulator.building import Area, Building
from radioslam.simulator.walkable import WALL_CLEARANCE_M, WalkableGraph

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

NOWHERE: Integers = np.zeros(0, dtype=np.int64)

PIECE_M = 4.0
"""A straight way is bent a little about every so often: nobody walks on a ruler."""
SMOOTHING_M = 0.5
"""Corners are rounded over this much path on each side; less than DOOR_APPROACH_M, for doors are straight."""
LOITER_M = 0.4
"""Nobody stands twice on exactly the same spot; doors alone are passed in their middle."""
SAMPLING_M = 0.125


@dataclass(frozen=True)
class WalkerHabits:
    """How people walk in a building.

    Attributes:
        speed_mps: mean walking speed.  speed_sd: relative standard deviation along the way.
        sway_m: standard deviation of the sideways deviation from the straight line between places.
        room_share: share of errands that lead into a room instead of a corridor or hall.
        pause_s: mean length of a pause at a destination.  pause_share: share of destinations with one.
        detour: spread of the factor on edge lengths by which routes between two places differ.
        favourites: number of places that draw most people (doors, lifts, canteen), the same for all walkers of
            a survey.  favourite_share: share of errands that lead to one of them.
    """

    speed_mps: float = 1.2
    speed_sd: float = 0.12
    sway_m: float = 0.3
    room_share: float = 0.35
    pause_s: float = 8.0
    pause_share: float = 0.5
    detour: float = 0.4
    favourites: int = 0
    favourite_share: float = 0.0


@dataclass(frozen=True)
class Route:
    """Where somebody walks: points (n, 2) every ``SAMPLING_M`` or less, and the arc lengths of the stops."""

    points_xy: Array
    stops_m: Array

    @property
    def distance_m(self) -> Array:
        """Arc length at each point, (n,)."""
        return path_length(self.points_xy)


@dataclass(frozen=True)
class TruePath:
    """Position as a function of time.

    Attributes:
        route: where.  knot_s, knot_m: (k,) times and the distance walked until then, linear in between.
    """

    route: Route
    knot_s: Array
    knot_m: Array

    @property
    def duration_s(self) -> float:
        """Seconds from start to end."""
        return float(self.knot_s[-1])

    def distance_at(self, time_s: Array) -> Array:
        """Distance walked (n,) at the times (n,) since the start."""
        return np.asarray(np.interp(time_s, self.knot_s, self.knot_m))

    def at(self, time_s: Array) -> Array:
        """Positions (n, 2) at the times (n,) since the start."""
        walked, along = self.distance_at(time_s), self.route.distance_m
        return np.stack([np.interp(walked, along, column) for column in self.route.points_xy.T], axis=-1)


def plan_route(
    building: Building,
    graph: WalkableGraph,
    length_m: float,
    habits: WalkerHabits,
    rng: np.random.Generator,
    favourites: Integers = NOWHERE,
) -> Route:
    """Errand after errand from the common start until ``length_m`` metres are walked."""
    corners, stops = [np.array([building.start_xy])], []
    place, walked, spare_m = 0, 0.0, 10.0
    area_of_edge = graph.area_of_edges()
    doors = set(graph.edges[graph.edge_area < 0].ravel().tolist())
    while walked < length_m * 1.05 + spare_m:
        factor = np.exp(habits.detour * rng.standard_normal(len(graph.edges)))
        route = graph.route(place, _next_place(graph, place, favourites, habits, rng), factor)
        for a, b in pairwise(route):
            area = building.areas[area_of_edge[a, b]] if area_of_edge[a, b] >= 0 else None
            end = graph.places_xy[b] + (0.0 if b in doors else rng.uniform(-LOITER_M, LOITER_M, 2))
            corners.append(_bent_leg(corners[-1][-1], end, area, habits, rng))
        place = route[-1]
        walked = float(path_length(np.concatenate(corners))[-1])
        stops.append(walked)
    return _finish(np.concatenate(corners), np.array(stops), length_m)


def favourite_places(graph: WalkableGraph, habits: WalkerHabits, rng: np.random.Generator) -> Integers:
    """The places (k,) to which most errands of a survey lead: the start, and others spread over the floor."""
    public = graph.destinations[~graph.in_room[graph.destinations]]
    chosen = [0]
    while len(chosen) < min(habits.favourites, len(public)):
        gaps = graph.places_xy[public][:, None] - graph.places_xy[chosen][None, :]
        apart = np.linalg.norm(gaps, axis=2).min(axis=1) * rng.uniform(0.5, 1.0, len(public))
        chosen.append(int(public[apart.argmax()]))
    return np.array(chosen[: habits.favourites], dtype=np.int64)


def _next_place(
    graph: WalkableGraph, place: int, favourites: Integers, habits: WalkerHabits, rng: np.random.Generator
) -> int:
    to_favourite = len(favourites) > 0 and rng.random() < habits.favourite_share
    into_room = rng.random() < habits.room_share
    anywhere = graph.destinations[graph.in_room[graph.destinations] == into_room]
    choice = favourites if to_favourite else anywhere
    return int(rng.choice(choice[choice != place]))


def _bent_leg(start: Array, end: Array, area: Area | None, habits: WalkerHabits, rng: np.random.Generator) -> Array:
    """Points after ``start`` up to ``end``, swaying inside the area; straight through a door (no area)."""
    if area is None:
        return np.array([end])
    count = max(1, round(float(np.linalg.norm(end - start)) / PIECE_M))
    points = start + np.linspace(0, 1, count + 1)[1:, None] * (end - start)
    sway = habits.sway_m * rng.standard_normal((count - 1, 2))
    points[:-1] = area.clip(points[:-1] + sway, WALL_CLEARANCE_M)
    return points


def _finish(corners_xy: Array, stops_m: Array, length_m: float) -> Route:
    """Round the corners and cut the path at the wanted length."""
    sharp_m = path_length(corners_xy)
    grid_m = np.arange(0.0, sharp_m[-1], SAMPLING_M)
    dense = np.stack([np.interp(grid_m, sharp_m, column) for column in corners_xy.T], axis=-1)
    half = round(SMOOTHING_M / SAMPLING_M)
    padded = np.concatenate([np.repeat(dense[:1], half, 0), dense, np.repeat(dense[-1:], half, 0)])
    sums = np.cumsum(np.concatenate([np.zeros((1, 2)), padded]), axis=0)
    smooth = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    smooth[0] = corners_xy[0]
    along = path_length(smooth)
    stops = np.interp(stops_m, grid_m, along)
    kept = np.append(smooth[along < length_m], [_point_at(smooth, along, length_m)], axis=0)
    return Route(kept, stops[stops < length_m])


def _point_at(points_xy: Array, along_m: Array, distance_m: float) -> Array:
    return np.array([np.interp(distance_m, along_m, column) for column in points_xy.T])


def walk_route(
    route: Route, habits: WalkerHabits, rng: np.random.Generator, duration_s: float | None = None
) -> TruePath:
    """Give the route a clock: speed that wanders about its mean, and pauses at some stops.

    With ``duration_s`` the pauses and then, if need be, the speed are stretched so that the walk takes
    exactly that long.
    """
    length = float(route.distance_m[-1])
    marks = np.unique(np.concatenate([np.arange(0.0, length, 5.0), route.stops_m, [length]]))
    speed = habits.speed_mps * np.exp(habits.speed_sd * rng.standard_normal(len(marks) - 1))
    moving_s = np.diff(marks) / speed
    pausing = rng.random(len(route.stops_m)) < habits.pause_share
    pause_s = np.where(pausing, rng.exponential(habits.pause_s, len(route.stops_m)), 0.0)
    if duration_s is not None:
        moving_s, pause_s = _stretch(moving_s, pause_s, duration_s)
    waits = np.zeros(len(marks))
    waits[np.searchsorted(marks, route.stops_m)] = pause_s
    arrive = np.concatenate([[0.0], np.cumsum(moving_s + waits[:-1])])
    times = np.stack([arrive, arrive + waits], axis=1).ravel()[:-1]
    return TruePath(route, times, np.repeat(marks, 2)[:-1])


def _stretch(moving_s: Array, pause_s: Array, duration_s: float) -> tuple[Array, Array]:
    spare = duration_s - moving_s.sum()
    if spare > 0 and pause_s.sum() > 0:
        return moving_s, pause_s * spare / pause_s.sum()
    factor = duration_s / (moving_s.sum() + pause_s.sum())
    return moving_s * factor, pause_s * factor
