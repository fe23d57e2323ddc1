from dataclasses import replace

import numpy as np
import pytest

from radioslam.errors import GraphError
from radioslam.pose_graph import Edges, PoseGraph, Priors, diagonal_information

from .builders import random_graph


@pytest.fixture
def graph():
    return random_graph(np.random.default_rng(0), nodes=6, loops=4)


def edges(*pairs):
    i, j = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return Edges(i, j, np.zeros((len(i), 3)), np.tile(np.eye(3), (len(i), 1, 1)))


def priors(*nodes):
    return Priors(np.array(nodes, dtype=np.int64), np.zeros((len(nodes), 3)), np.tile(np.eye(3), (len(nodes), 1, 1)))


def test_a_good_graph_passes_the_check(graph):
    assert graph.check() is graph


@pytest.mark.parametrize("kind", ["odometry", "links", "loops"])
@pytest.mark.parametrize("pair", [(0, 6), (6, 0), (-1, 2)])
def test_an_edge_to_a_node_outside_of_the_graph_is_an_error(graph, kind, pair):
    with pytest.raises(GraphError, match=f"{kind}: expected nodes 0 to 5, found"):
        replace(graph, **{kind: edges(pair)}).check()


@pytest.mark.parametrize("node", [-1, 6])
def test_a_prior_on_a_node_outside_of_the_graph_is_an_error(graph, node):
    with pytest.raises(GraphError, match="priors: expected nodes 0 to 5"):
        replace(graph, priors=priors(0, node)).check()


def test_an_edge_from_a_node_to_itself_is_an_error(graph):
    with pytest.raises(GraphError, match="loops: expected two different nodes, found an edge from 3 to itself"):
        replace(graph, loops=edges((0, 2), (3, 3))).check()


@pytest.mark.parametrize("again", [(1, 4), (4, 1)])
def test_the_same_edge_twice_is_an_error_in_either_direction(graph, again):
    with pytest.raises(GraphError, match="loops: expected each edge once, found 1-4 again"):
        replace(graph, loops=edges((0, 2), (1, 4), again)).check()


def test_a_loop_may_stand_beside_an_odometry_edge_or_link(graph):
    replace(graph, loops=edges((0, 1)), links=edges((0, 1))).check()


BAD_INFORMATION = {
    "negative": np.diag([1.0, 1.0, -1.0]),
    "singular": np.diag([1.0, 1.0, 0.0]),
    "not symmetric": np.eye(3) + np.eye(3, k=1),
    "indefinite": np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
}


@pytest.mark.parametrize("matrix", BAD_INFORMATION.values(), ids=BAD_INFORMATION)
@pytest.mark.parametrize("kind", ["odometry", "links", "loops"])
def test_information_must_be_symmetric_positive_definite(graph, kind, matrix):
    bad = edges((0, 1), (2, 3))
    bad.information[1] = matrix
    with pytest.raises(GraphError, match=f"{kind}: expected symmetric positive definite"):
        replace(graph, **{kind: bad}).check()


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_information_must_be_finite(graph, number):
    bad = edges((0, 2))
    bad.information[0, 0, 0] = number
    with pytest.raises(GraphError, match="loops: expected finite information"):
        replace(graph, loops=bad).check()


def test_the_information_of_priors_is_checked_too(graph):
    bad = priors(0)
    bad.information[0] = -np.eye(3)
    with pytest.raises(GraphError, match="priors: expected symmetric positive definite"):
        replace(graph, priors=bad).check()


def test_a_graph_without_a_prior_is_an_error(graph):
    with pytest.raises(GraphError, match=r"none for 6 nodes \(first: 0\)"):
        replace(graph, priors=Priors.none()).check()


def test_every_connected_part_needs_a_prior():
    two_parts = PoseGraph(np.zeros((5, 3)), edges((0, 1), (2, 3), (3, 4)), priors=priors(1))
    with pytest.raises(GraphError, match=r"none for 3 nodes \(first: 2\)"):
        two_parts.check()
    replace(two_parts, priors=priors(1, 4)).check()
    replace(two_parts, loops=edges((0, 4))).check()
    replace(two_parts, links=edges((4, 0))).check()


def test_parts_are_connected_by_edges_of_any_kind():
    graph = PoseGraph(np.zeros((6, 3)), edges((0, 1)), loops=edges((5, 1)), links=edges((2, 3)))
    part = graph.components()
    assert part[0] == part[1] == part[5]
    assert part[2] == part[3]
    assert len({part[0], part[2], part[4]}) == 3


def test_priors_connect_nothing():
    part = PoseGraph(np.zeros((2, 3)), Edges.none(), priors=priors(0, 1)).components()
    assert part[0] != part[1]


def test_edges_are_joined_in_order_and_picked_by_mask():
    both = Edges.concatenate([edges((0, 1)), Edges.none(), edges((2, 3), (4, 5))])
    assert both.i.tolist() == [0, 2, 4]
    assert both.select(both.j > 2).j.tolist() == [3, 5]
    assert len(Edges.concatenate([])) == 0


def test_priors_are_joined_in_order():
    assert Priors.concatenate([priors(3), Priors.none(), priors(1, 2)]).node.tolist() == [3, 1, 2]


def test_diagonal_information_is_one_over_the_squares_and_broadcasts():
    information = diagonal_information(np.array([0.5, 2.0]), 1.0, 0.1)
    np.testing.assert_allclose(information, [np.diag([4.0, 1.0, 100.0]), np.diag([0.25, 1.0, 100.0])])
    assert diagonal_information(1.0, 1.0, 1.0).shape == (1, 3, 3)
    assert diagonal_information(np.zeros(0), np.zeros(0), np.zeros(0)).shape == (0, 3, 3)


@pytest.mark.parametrize("kind", ["odometry", "links", "loops"])
@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_measurements_must_be_finite(graph, kind, number):
    bad = edges((0, 2))
    bad.measurement[0, 1] = number
    with pytest.raises(GraphError, match=f"{kind}: expected finite"):
        replace(graph, **{kind: bad}).check()


def test_poses_and_priors_must_be_finite(graph):
    bad = priors(0)
    bad.measurement[0, 2] = np.nan
    with pytest.raises(GraphError, match="priors: expected finite"):
        replace(graph, priors=bad).check()
    with pytest.raises(GraphError, match="expected finite"):
        replace(graph, poses=np.full((6, 3), np.nan)).check()
