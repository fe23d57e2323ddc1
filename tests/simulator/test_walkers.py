import numpy as np
import pytest

from radioslam.simulator import SCENARIOS
from radioslam.simulator.building import segments_crossed
from radioslam.simulator.streams import random_stream
from radioslam.simulator.survey import true_path
from radioslam.simulator.walkable import walkable_graph
from radioslam.simulator.walkers import WalkerHabits, plan_route, walk_route


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_place_can_be_reached_without_crossing_a_wall(name):
    building = SCENARIOS[name].make_building()
    graph = walkable_graph(building)
    ends = graph.places_xy[graph.edges]
    crossings = [segments_crossed(pair, building.wall_ends()).sum() for pair in ends]
    assert sum(crossings) == 0
    factor = np.ones(len(graph.edges))
    for place in graph.destinations[::7]:
        assert graph.route(0, int(place), factor)[0] == 0
    assert building.walkable(graph.places_xy).all()


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("seed", [1, 2])
def test_paths_stay_where_people_can_walk(name, seed):
    scenario = SCENARIOS[name]
    building = scenario.make_building()
    for number in range(scenario.walks):
        path_xy = true_path(scenario, building, seed, number).route.points_xy
        assert segments_crossed(path_xy, building.wall_ends()).sum() == 0
        assert building.walkable(path_xy).all()
        np.testing.assert_allclose(path_xy[0], building.start_xy)


def test_a_walk_has_the_length_and_duration_asked_for():
    building = SCENARIOS["office"].make_building()
    habits = WalkerHabits()
    rng = random_stream(3, "test")
    route = plan_route(building, walkable_graph(building), 80.0, habits, rng)
    assert route.distance_m[-1] == pytest.approx(80.0)
    path = walk_route(route, habits, rng, duration_s=200.0)
    assert path.duration_s == pytest.approx(200.0)
    assert path.distance_at(np.array([0.0, 200.0])) == pytest.approx([0.0, 80.0])


def test_a_walk_shorter_than_its_pace_is_hurried():
    building = SCENARIOS["office"].make_building()
    habits = WalkerHabits()
    rng = random_stream(4, "test")
    route = plan_route(building, walkable_graph(building), 80.0, habits, rng)
    assert walk_route(route, habits, rng, duration_s=40.0).duration_s == pytest.approx(40.0)


def test_people_walk_at_their_speed_and_pause():
    building = SCENARIOS["office"].make_building()
    habits = WalkerHabits(pause_share=1.0, pause_s=10.0)
    rng = random_stream(5, "test")
    path = walk_route(plan_route(building, walkable_graph(building), 500.0, habits, rng), habits, rng)
    time_s = np.arange(0.0, path.duration_s, 0.5)
    speed = np.gradient(path.distance_at(time_s), time_s)
    assert np.median(speed[speed > 0.2]) == pytest.approx(habits.speed_mps, rel=0.1)
    assert np.mean(speed < 0.01) > 0.05
    assert speed.max() < 2.2
