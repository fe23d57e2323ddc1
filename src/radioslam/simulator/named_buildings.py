"""The floors of the named buildings."""

from __future__ import annotations

import numpy as np

from radioslam.simulator.building import CONCRETE, GLASS, PARTITION, Building
from radioslam.simulator.floor_plan import FloorPlan


def office_building() -> Building:
    """40 m x 20 m: rooms to the north and south of a ring corridor, and a core of rooms inside it."""
    plan = FloorPlan(40.0, 20.0)
    south = plan.area("south corridor", (0.0, 5.0, 40.0, 7.0))
    north = plan.area("north corridor", (0.0, 13.0, 40.0, 15.0))
    plan.area("west corridor", (0.0, 5.0, 2.0, 15.0))
    plan.area("east corridor", (38.0, 5.0, 40.0, 15.0))
    plan.area("passage", (19.0, 5.0, 21.0, 15.0))
    plan.rooms_in_row("S", np.linspace(0, 40, 9).tolist(), 5.0, 0.0, south)
    plan.rooms_in_row("N", np.linspace(0, 40, 9).tolist(), 15.0, 20.0, north)
    for name, west, east in (("CW", 2.0, 19.0), ("CE", 21.0, 38.0)):
        plan.rooms_in_row(name, np.linspace(west, east, 4).tolist(), 7.0, 13.0, south, front=PARTITION)
        plan.wall((west, 13.0), (east, 13.0))
        plan.wall((west, 7.0), (west, 13.0))
        plan.wall((east, 7.0), (east, 13.0))
    return plan.build((1.0, 6.0))


def campus_building() -> Building:
    """130 m x 70 m: concrete wings of rooms along corridors, an open hall, offices behind soft partitions."""
    plan = FloorPlan(130.0, 70.0)
    south = plan.area("south corridor", (0.0, 10.0, 130.0, 13.0))
    north = plan.area("north corridor", (0.0, 57.0, 130.0, 60.0))
    west = plan.area("west corridor", (0.0, 10.0, 3.0, 60.0))
    first = plan.area("first cross corridor", (42.0, 10.0, 45.0, 60.0))
    second = plan.area("second cross corridor", (85.0, 10.0, 88.0, 60.0))
    east = plan.area("east corridor", (127.0, 10.0, 130.0, 60.0))
    plan.rooms_in_row("S", np.linspace(0, 130, 14).tolist(), 10.0, 0.0, south)
    plan.rooms_in_row("N", np.linspace(0, 130, 14).tolist(), 60.0, 70.0, north)
    bays = np.linspace(13, 57, 6).tolist()
    plan.rooms_in_row("W", bays, 3.0, 22.5, west, along=1)
    plan.rooms_in_row("M", bays, 42.0, 22.5, first, along=1)
    plan.wall((22.5, 13.0), (22.5, 57.0))
    for x0, x1 in ((3.0, 42.0), (88.0, 127.0)):
        plan.wall((x0, 13.0), (x1, 13.0))
        plan.wall((x0, 57.0), (x1, 57.0))
    # The hall reaches into both cross corridors: no wall stands between them, only glass to north and south.
    plan.area("hall", (42.0, 13.0, 88.0, 57.0))
    plan.wall((45.0, 13.0), (85.0, 13.0), GLASS, (55.0, 65.0, 75.0))
    plan.wall((45.0, 57.0), (85.0, 57.0), GLASS, (55.0, 65.0, 75.0))
    for x in (55.0, 65.0, 75.0):
        plan.door(south, "hall", (x, 13.0), (0.0, 1.0))
        plan.door(north, "hall", (x, 57.0), (0.0, -1.0))
    thirds = np.linspace(13, 57, 4).tolist()
    plan.rooms_in_row("P", thirds, 88.0, 107.5, second, along=1, front=PARTITION)
    plan.rooms_in_row("Q", thirds, 127.0, 107.5, east, along=1, front=PARTITION)
    plan.wall((107.5, 13.0), (107.5, 57.0), CONCRETE)
    return plan.build((1.5, 11.5), storey_height_m=5.0)


def tower_building() -> Building:
    """40 m x 40 m: a closed concrete core with lifts, a ring corridor around it, offices along the facade."""
    plan = FloorPlan(40.0, 40.0)
    core_low, core_high, ring_low, ring_high = 13.0, 27.0, 10.5, 29.5
    south = plan.area("south corridor", (ring_low, ring_low, ring_high, core_low))
    north = plan.area("north corridor", (ring_low, core_high, ring_high, ring_high))
    west = plan.area("west corridor", (ring_low, ring_low, core_low, ring_high))
    east = plan.area("east corridor", (core_high, ring_low, ring_high, ring_high))
    corners = [(core_low, core_low), (core_high, core_low), (core_high, core_high), (core_low, core_high)]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        plan.wall(a, b)
    plan.wall((core_low, 20.0), (core_high, 20.0))
    plan.wall((20.0, core_low), (20.0, core_high))
    sides = [ring_low, *np.linspace(ring_low, ring_high, 4)[1:-1].tolist(), ring_high]
    plan.rooms_in_row("S", sides, ring_low, 0.0, south, front=PARTITION)
    plan.rooms_in_row("N", sides, ring_high, 40.0, north, front=PARTITION)
    plan.rooms_in_row("W", sides, ring_low, 0.0, west, along=1, front=GLASS)
    plan.rooms_in_row("E", sides, ring_high, 40.0, east, along=1, front=GLASS)
    for corner in (ring_low, ring_high):
        for edge in (0.0, 40.0):
            end = ring_low if edge == 0.0 else ring_high
            plan.wall((corner, edge), (corner, end), PARTITION)
            plan.wall((edge, corner), (end, corner), PARTITION)
    return plan.build((20.0, 11.75))
