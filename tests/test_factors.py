from dataclasses import replace

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import OptimizerConfig
from radioslam.factors import (
    AlongAxisBlock,
    BetweenBlock,
    Layout,
    PlaceBlock,
    PriorBlock,
    SamePlaceBlock,
    ZeroBlock,
    first_guess,
    graph_blocks,
    off_axis,
    pose_variables,
)
from radioslam.optimizer import total_cost
from radioslam.pose_graph import Edges, Legs, Priors, diagonal_information

from .builders import edges_between, numeric_jacobian, random_graph, random_information

NODES = 5
SCALES = np.array([15, 15, 16, 16, 15])
"""The scales of two walks stand behind the poses, one of them for each of the edges below."""


@pytest.fixture
def rng():
    return np.random.default_rng(1)


@pytest.fixture
def x(rng):
    return np.concatenate([rng.normal(0, 2, 3 * NODES), rng.normal(0, 0.3, 2)])


@pytest.fixture
def edges(rng, x):
    poses = x[: 3 * NODES].reshape(-1, 3)
    return edges_between(rng, poses, [0, 1, 2, 4, 3], [1, 2, 0, 1, 0], noise=0.3)


@pytest.fixture
def priors(rng, x):
    nodes = np.array([0, 3, 3])
    return Priors(nodes, x[: 3 * NODES].reshape(-1, 3)[nodes] + rng.normal(0, 0.3, (3, 3)), random_information(rng, 3))


def blocks(edges, priors):
    return {
        "between": BetweenBlock(edges),
        "between with scales": BetweenBlock(edges, log_scale=SCALES),
        "prior": PriorBlock(priors),
        "place": PlaceBlock(np.array([1, 3]), np.array([[0.5, -1.0], [2.0, 0.3]]), np.array([0.4, 2.0]), "cauchy", 1.0),
        "zero": ZeroBlock(np.array([16, 2]), np.array([0.3, 0.1])),
        "same place": SamePlaceBlock(edges, np.linspace(-1, 1, 10).reshape(5, 2), 15, "none", 1.0),
        "along axis": AlongAxisBlock(Legs(edges.i, edges.j, np.linspace(0.05, 0.2, 5), 0.0), 16, "none", 1.0),
    }


KINDS = ["between", "between with scales", "prior", "place", "zero", "same place", "along axis"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_jacobian_equals_the_numeric_one(kind, edges, priors, x):
    block = blocks(edges, priors)[kind]
    jacobian = block.linearize(x)[1]
    numeric = numeric_jacobian(block.residuals, x)
    dense = np.zeros_like(numeric)
    for m, variables in enumerate(block.variables):
        dense[m][:, variables] = jacobian[m]
    np.testing.assert_allclose(dense, numeric, atol=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_linearizing_gives_the_same_residuals(kind, edges, priors, x):
    block = blocks(edges, priors)[kind]
    before = x.copy()
    np.testing.assert_array_equal(block.linearize(x)[0], block.residuals(x))
    np.testing.assert_array_equal(x, before)


@pytest.mark.parametrize("kind", KINDS)
def test_squared_residuals_do_not_change_when_an_unknown_turns_all_around(kind, edges, priors, x):
    block = blocks(edges, priors)[kind]
    turned = x.copy()
    turned[[2, 5, 11]] += [2 * np.pi, -4 * np.pi, 6 * np.pi]
    if kind != "zero":
        np.testing.assert_allclose(block.residuals(turned), block.residuals(x), atol=1e-9)


def test_an_edge_measures_the_motion_between_its_poses_in_the_measurements_frame(edges, x):
    poses = x[: 3 * NODES].reshape(-1, 3)
    error = planar.between(edges.measurement, planar.between(poses[edges.i], poses[edges.j]))
    expected = np.einsum("ma,mab,mb->m", error, edges.information, error)
    np.testing.assert_allclose(np.sum(BetweenBlock(edges).residuals(x) ** 2, axis=1), expected)


def test_the_scale_stretches_the_measured_translation_alone(edges, x):
    stretched = edges.measurement.copy()
    stretched[:, :2] *= np.exp(x[SCALES])[:, None]
    np.testing.assert_allclose(
        BetweenBlock(edges, log_scale=SCALES).residuals(x),
        BetweenBlock(Edges(edges.i, edges.j, stretched, edges.information)).residuals(x),
    )


def test_a_prior_measures_a_pose_in_its_own_frame(priors, x):
    error = planar.between(priors.measurement, x[: 3 * NODES].reshape(-1, 3)[priors.node])
    expected = np.einsum("ma,mab,mb->m", error, priors.information, error)
    np.testing.assert_allclose(np.sum(PriorBlock(priors).residuals(x) ** 2, axis=1), expected)


def test_no_edges_and_no_priors_make_empty_blocks(x):
    assert BetweenBlock(Edges.none()).residuals(x).shape == (0, 3)
    assert BetweenBlock(Edges.none(), log_scale=np.zeros(0, np.int64)).linearize(x)[1].shape == (0, 3, 7)
    assert PriorBlock(Priors.none()).residuals(x).shape == (0, 3)


def test_poses_stand_in_the_unknowns_one_after_the_other():
    np.testing.assert_array_equal(pose_variables(np.array([0, 2])), [[0, 1, 2], [6, 7, 8]])


# Whole graphs


@pytest.fixture
def graph(rng):
    return replace(random_graph(rng, nodes=10, loops=5), walk=np.repeat([0, 1], 5))


def test_a_graph_with_nothing_but_poses_has_three_unknowns_per_node(graph):
    assert Layout.of(graph) == Layout(30, None, None, None)


def test_a_scale_per_walk_stands_behind_the_poses(graph):
    assert Layout.of(replace(graph, log_scale_sigma=np.full(2, 0.1))) == Layout(32, 30, None, None)


def test_scales_at_zero_leave_the_cost_as_it_is(graph):
    plain = graph_blocks(graph, OptimizerConfig())
    more = graph_blocks(replace(graph, log_scale_sigma=np.full(2, 0.1)), OptimizerConfig())
    x = graph.poses.ravel() + np.random.default_rng(0).normal(0, 0.1, graph.poses.size)
    assert total_cost(more, np.append(x, np.zeros(2))) == pytest.approx(total_cost(plain, x), rel=1e-12)


def test_the_scale_of_a_walk_stretches_its_own_odometry():
    flat = random_graph(np.random.default_rng(2), nodes=6, loops=1, noise=0.0)
    graph = replace(flat, walk=np.array([0, 0, 0, 1, 1, 1]), log_scale_sigma=np.full(2, 0.5), loops=Edges.none())
    blocks = graph_blocks(graph, OptimizerConfig())
    x = first_guess(graph)
    x[-1] = 0.1
    stretched = next(block for block in blocks if getattr(block, "scaled", False))
    wrong = np.abs(stretched.residuals(x)).sum(axis=1) > 1e-9
    np.testing.assert_array_equal(wrong, graph.walk[graph.odometry.i] == 1)


def test_a_scale_far_from_one_costs_what_its_sigma_says(graph):
    scaled = replace(
        graph, log_scale_sigma=np.array([0.2, 0.1]), odometry=Edges.none(), loops=Edges.none(), priors=Priors.none()
    )
    blocks = graph_blocks(scaled, OptimizerConfig())
    x = np.zeros(Layout.of(scaled).size)
    x[-2:] = [0.2, -0.2]
    assert total_cost(blocks, x) == pytest.approx(0.5 * (1 + 4))


def test_loops_alone_are_robust(graph):
    blocks = graph_blocks(graph, OptimizerConfig(loop_loss="dcs", loss_scale=0.5))
    robust = [block for block in blocks if block.loss != "none"]
    assert [len(block.variables) for block in robust] == [len(graph.loops)]
    assert robust[0].loss_scale == 0.5


def test_links_are_factors_too(graph):
    linked = replace(graph, links=edges_between(np.random.default_rng(0), graph.poses, [0], [5], 0.1))
    x = graph.poses.ravel()
    more, less = (total_cost(graph_blocks(g, OptimizerConfig()), x) for g in (linked, graph))
    assert more - less == pytest.approx(total_cost([BetweenBlock(linked.links)], x))
    assert more > less


def test_a_position_only_loop_pulls_at_positions_and_hardly_at_headings():
    here = np.zeros((2, 3))
    here[1] = [3.0, 4.0, 2.0]
    loop = Edges(np.array([0]), np.array([1]), np.zeros((1, 3)), diagonal_information(0.5, 0.5, 1000**0.5))
    assert total_cost([BetweenBlock(loop)], here.ravel()) == pytest.approx(0.5 * (25 / 0.25 + 4 / 1000))


def test_a_radio_that_lags_parts_the_ends_of_a_loop_by_their_difference_in_speed():
    loop = Edges(np.array([0]), np.array([1]), np.zeros((1, 3)), diagonal_information(0.5, 0.5, 1.0))
    block = SamePlaceBlock(loop, np.array([[2.0, -1.0]]), 6, "none", 1.0)
    apart = np.array([1.0, 1.0, 0.0, 1.0 + 2.0 * 3.0, 1.0 - 3.0, 0.0, 3.0])
    np.testing.assert_allclose(block.residuals(apart), 0.0, atol=1e-12)
    together = np.array([1.0, 1.0, 0.0, 1.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(block.residuals(together), [[-12.0, 6.0]])


@pytest.mark.parametrize("quarter", range(4))
def test_a_leg_along_or_across_the_axis_costs_nothing(quarter):
    direction = 0.3 + quarter * np.pi / 2
    block = AlongAxisBlock(Legs(np.array([0]), np.array([1]), np.array([0.1]), 0.3), 6, "none", 1.0)
    x = np.array([1.0, 2.0, 0.0, 1.0 + 5 * np.cos(direction), 2.0 + 5 * np.sin(direction), 0.0, 0.3])
    assert total_cost([block], x) == pytest.approx(0.0, abs=1e-20)
    x[6] += 0.05
    np.testing.assert_allclose(block.residuals(x), [[-0.5]], atol=1e-9)


def test_off_axis_is_the_way_to_the_nearest_right_angle():
    np.testing.assert_allclose(off_axis(np.radians([0, 90, 100, -80, 44, 46])), np.radians([0, 0, 10, 10, 44, -44]))


def test_lag_and_axis_stand_behind_the_scales(graph):
    legs = Legs(np.array([0]), np.array([3]), np.array([0.1]), 0.7)
    full = replace(
        graph,
        log_scale_sigma=np.full(2, 0.1),
        loop_velocity=np.zeros((len(graph.loops), 2)),
        lag_sigma_s=3.0,
        legs=legs,
    )
    assert Layout.of(full) == Layout(34, 30, 32, 33)
    assert first_guess(full)[-4:].tolist() == [0.0, 0.0, 0.0, 0.7]
    kinds = [type(block) for block in graph_blocks(full, OptimizerConfig())]
    assert SamePlaceBlock in kinds
    assert AlongAxisBlock in kinds
