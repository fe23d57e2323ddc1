import numpy as np
import pytest

from radioslam.simulator.building import CONCRETE, GLASS, PARTITION, WALL_LOSS_DB, Area, segments_crossed
from radioslam.simulator.floor_plan import DOOR_WIDTH_M, FloorPlan


@pytest.fixture
def two_rooms():
    """A 10 m x 4 m box, parted at x = 5 by plasterboard with a door in its middle (y = 2)."""
    plan = FloorPlan(10.0, 4.0)
    plan.area("left", (0.0, 0.0, 5.0, 4.0))
    plan.area("right", (5.0, 0.0, 10.0, 4.0))
    plan.wall((5.0, 0.0), (5.0, 4.0), PARTITION, openings=(2.0,))
    plan.door("left", "right", (5.0, 2.0), (1.0, 0.0))
    return plan.build((1.0, 1.0))


def loss(building, a, b):
    return building.wall_loss_db(np.array([a], dtype=float), np.array([b], dtype=float))[0, 0]


def test_walls_between_two_points_are_summed(two_rooms):
    partition, concrete = WALL_LOSS_DB[PARTITION], WALL_LOSS_DB[CONCRETE]
    assert loss(two_rooms, (1, 0.5), (4, 0.5)) == 0
    assert loss(two_rooms, (1, 0.5), (9, 0.5)) == partition
    assert loss(two_rooms, (9, 0.5), (1, 0.5)) == partition
    assert loss(two_rooms, (1, 0.5), (12, 0.5)) == partition + concrete
    assert loss(two_rooms, (-3, 0.5), (13, 0.7)) == partition + 2 * concrete


def test_an_open_door_costs_nothing(two_rooms):
    assert loss(two_rooms, (1, 2), (9, 2)) == 0
    edge = 2 + DOOR_WIDTH_M / 2
    assert loss(two_rooms, (1, edge - 0.01), (9, edge - 0.01)) == 0
    assert loss(two_rooms, (1, edge + 0.01), (9, edge + 0.01)) == WALL_LOSS_DB[PARTITION]


def test_slanting_lines_cross_where_they_should(two_rooms):
    # From (0.5, 0.5) to (9.5, 3.5) the wall at x = 5 is met at y = 2: in the door.
    assert loss(two_rooms, (0.5, 0.5), (9.5, 3.5)) == 0
    assert loss(two_rooms, (0.5, 0.5), (6.0, 3.5)) == WALL_LOSS_DB[PARTITION]


def test_loss_is_a_matrix_over_both_sets_of_points(two_rooms):
    a, b = np.random.default_rng(0).uniform(-5, 15, (2, 7, 2))
    b = b[:4]
    matrix = two_rooms.wall_loss_db(a, b)
    assert matrix.shape == (7, 4)
    for i in range(7):
        for j in range(4):
            path = np.array([a[i], b[j]])
            crossed = [
                w.loss_db * segments_crossed(path, np.array([[*w.start_xy, *w.end_xy]]))[0] for w in two_rooms.walls
            ]
            assert matrix[i, j] == pytest.approx(sum(crossed))


def test_kinds_differ():
    assert WALL_LOSS_DB[CONCRETE] > WALL_LOSS_DB[PARTITION] > WALL_LOSS_DB[GLASS] > 0


def test_walkable_is_inside_areas_and_on_the_way_through_doors(two_rooms):
    points = np.array([[1.0, 1.0], [5.0, 2.0], [11.0, 1.0], [9.0, 4.5]])
    assert two_rooms.walkable(points).tolist() == [True, True, False, False]


def test_areas_overlap_and_clip():
    a, b = Area("a", 0, 0, 10, 2), Area("b", 8, 0, 10, 20)
    common = a.overlap(b)
    assert (common.west_m, common.south_m, common.east_m, common.north_m) == (8, 0, 10, 2)
    assert a.overlap(Area("c", 10, 0, 12, 2)) is None
    np.testing.assert_allclose(a.clip(np.array([[-1.0, 5.0], [5.0, 1.0]]), 0.5), [[0.5, 1.5], [5.0, 1.0]])
    np.testing.assert_allclose(a.clip(np.array([[5.0, 0.0]]), 3.0), [[5.0, 1.0]])
