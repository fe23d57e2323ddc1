"""GTSAM is the independent judge here. g2o-python cannot be: it crashes with NumPy 2."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radioslam import planar
from radioslam.config import OptimizerConfig
from radioslam.errors import GraphError
from radioslam.factors import first_guess, graph_blocks
from radioslam.losses import robust_loss
from radioslam.optimizer import minimize, total_cost
from radioslam.pose_graph import Edges, PoseGraph, Priors, diagonal_information

from .builders import chain, grid_walk, gtsam_graph, gtsam_optimum, numeric_jacobian, random_graph

LOSSES = ("none", "huber", "cauchy", "dcs")
PRECISE = OptimizerConfig(tolerance=1e-12)


class Linear:
    """Factors r = A x[variables] - b, one scalar each."""

    def __init__(self, a, b, variables, loss="none", loss_scale=1.0):
        self.a, self.b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
        self.variables, self.loss, self.loss_scale = np.asarray(variables), loss, loss_scale

    def residuals(self, x):
        return (np.sum(self.a * x[self.variables], axis=1) - self.b)[:, None]

    def linearize(self, x):
        return self.residuals(x), self.a[:, None, :]


def location(values, loss="none", loss_scale=1.0):
    """One unknown measured by several values."""
    return Linear(np.ones((len(values), 1)), values, np.zeros((len(values), 1), np.int64), loss, loss_scale)


def dense(rng, factors=12, unknowns=5, loss="none"):
    """A linear problem in which every factor sees three of the unknowns."""
    variables = np.array([rng.choice(unknowns, 3, replace=False) for _ in range(factors)])
    return Linear(rng.normal(size=(factors, 3)), rng.normal(size=factors), variables, loss)


def solve(graph, config=PRECISE, variances=False):
    blocks = graph_blocks(graph, config)
    return minimize(blocks, first_guess(graph), config, variances)


def beginning_of(graph, nodes):
    """The part of a graph between its first nodes."""
    odometry, loops = (e.select((e.i < nodes) & (e.j < nodes)) for e in (graph.odometry, graph.loops))
    return PoseGraph(graph.poses[:nodes], odometry, loops, priors=graph.priors)


# Robust losses


@pytest.mark.parametrize("loss", LOSSES)
@given(q=st.floats(1e-3, 1e3), scale=st.floats(0.3, 5.0))
def test_the_weight_is_the_derivative_of_the_loss(loss, q, scale):
    if abs(q - scale**2) > 1e-4 * q:  # the losses bend at k², where central differences see both sides
        numeric = numeric_jacobian(lambda v: robust_loss(loss, v, scale)[0], np.array([q]), 1e-5 * q)[0, 0]
        assert robust_loss(loss, np.array([q]), scale)[1][0] == pytest.approx(numeric, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_losses_and_weights_have_no_jump_at_their_scale(loss, scale):
    around = scale**2 * np.array([1 - 1e-9, 1 + 1e-9])
    rho, weight = robust_loss(loss, around, scale)
    assert rho[1] - rho[0] == pytest.approx(0.0, abs=1e-7)
    assert weight[1] - weight[0] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("loss", LOSSES)
def test_losses_begin_as_the_square_grow_and_never_exceed_it(loss):
    q = np.linspace(0, 100, 1001)
    rho, weight = robust_loss(loss, q, 2.0)
    assert rho[0] == 0.0
    assert weight[0] == 1.0
    assert np.all(np.diff(rho) > 0)
    assert np.all(rho <= q)
    assert np.all(np.diff(weight) <= 0)


def test_losses_far_out_are_those_of_the_literature():
    q = np.array([100.0])
    assert robust_loss("none", q, 2.0)[0] == pytest.approx(100)
    assert robust_loss("huber", q, 2.0)[0] == pytest.approx(2 * 2 * 10 - 4)
    assert robust_loss("cauchy", q, 2.0)[0] == pytest.approx(4 * np.log(26))
    # Dynamic covariance scaling, Agarwal et al. 2013: half of it is 1.5 Φ - 2 Φ²/(Φ + q), with Φ = 4.
    assert robust_loss("dcs", q, 2.0)[0] / 2 == pytest.approx(1.5 * 4 - 2 * 16 / 104)


def test_dcs_stops_charging_for_what_is_far_out():
    assert robust_loss("dcs", np.array([1e12]), 2.0)[0] == pytest.approx(3 * 4)


# Closed forms


def test_squares_give_the_mean():
    assert minimize([location([1.0, 2.0, 9.0])], np.zeros(1), PRECISE).x == pytest.approx([4.0])


def test_huber_gives_the_mean_with_the_outlier_pulled_to_its_scale():
    # 0, 1, 2 inside and 100 outside of k = 3: 3x - 3 = k, whatever the outlier says.
    solution = minimize([location([0.0, 1.0, 2.0, 100.0], "huber", 3.0)], np.zeros(1), PRECISE)
    assert solution.x == pytest.approx([2.0], abs=1e-6)


@pytest.mark.parametrize("loss", ["cauchy", "dcs"])
def test_redescending_losses_leave_a_far_outlier_aside(loss):
    solution = minimize([location([0.0, 1.0, 2.0, 1000.0], loss, 2.0)], np.ones(1), PRECISE)
    assert solution.x == pytest.approx([1.0], abs=0.01)


def test_a_linear_problem_ends_at_the_least_squares_solution():
    rng = np.random.default_rng(0)
    block = dense(rng)
    matrix = np.zeros((12, 5))
    np.put_along_axis(matrix, block.variables, block.a, axis=1)
    expected = np.linalg.lstsq(matrix, block.b)[0]
    solution = minimize([block], np.zeros(5), variances=True)
    np.testing.assert_allclose(solution.x, expected, atol=1e-6)
    np.testing.assert_allclose(solution.inverse_diagonal, np.diag(np.linalg.inv(matrix.T @ matrix)), rtol=1e-9)
    assert solution.iterations <= 3


@pytest.mark.parametrize("loss", LOSSES)
def test_the_gradient_vanishes_at_the_solution(loss):
    blocks = [dense(np.random.default_rng(3), factors=20, loss=loss), dense(np.random.default_rng(4))]
    solution = minimize(blocks, np.zeros(5), PRECISE)
    assert solution.converged
    gradient = numeric_jacobian(lambda x: np.array([total_cost(blocks, x)]), solution.x, 1e-5)[0]
    np.testing.assert_allclose(gradient, 0.0, atol=1e-4)


# Pose graphs


@pytest.mark.parametrize("seed", range(3))
def test_exact_measurements_give_back_the_true_path(seed):
    rng = np.random.default_rng(seed)
    graph = random_graph(rng, nodes=40, loops=20, noise=0.0)
    disturbed = replace(graph, poses=graph.poses + rng.normal(0, 0.2, graph.poses.shape))
    solution = solve(disturbed)
    assert solution.converged
    assert solution.cost_after == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(solution.x.reshape(-1, 3), graph.poses, atol=1e-6)


def test_a_walk_of_long_steps_is_given_its_scale():
    steps = np.tile([1.0, 0.0, 0.3], (30, 1))
    truth, long = chain(steps), chain(steps * [1.1, 1.0, 1.0])
    n = len(truth)
    priors = Priors(
        np.array([0, 10, 20]), truth[[0, 10, 20]], np.repeat(diagonal_information(0.01, 0.01, 0.01), 3, axis=0)
    )
    odometry = Edges(
        np.arange(n - 1),
        np.arange(1, n),
        steps * [1.1, 1.0, 1.0],
        np.tile(diagonal_information(0.1, 0.1, 0.1), (n - 1, 1, 1)),
    )
    graph = PoseGraph(long, odometry, priors=priors, walk=np.zeros(n, np.int64), log_scale_sigma=np.array([1.0]))
    solution = solve(graph)
    assert np.exp(solution.x[-1]) == pytest.approx(1 / 1.1, rel=1e-3)
    np.testing.assert_allclose(solution.x[:-1].reshape(-1, 3), truth, atol=0.01)


@pytest.mark.parametrize("seed", range(2))
def test_gtsam_ends_at_the_same_optimum_of_position_only_loops(seed):
    graph = beginning_of(grid_walk(np.random.default_rng(seed))[1], 150).check()
    assert len(graph.loops) > 10
    ours = solve(graph)
    assert ours.converged
    theirs = gtsam_optimum(gtsam_graph(graph, log_map=False), graph.poses)
    cost = total_cost(graph_blocks(graph, PRECISE), theirs.ravel())
    assert ours.cost_after == pytest.approx(cost, rel=1e-9)
    # Where costs are equal to double precision, poses are equal to about the root of it.
    np.testing.assert_allclose(ours.x.reshape(-1, 3)[:, :2], theirs[:, :2], atol=1e-5)
    np.testing.assert_allclose(planar.wrap(ours.x.reshape(-1, 3)[:, 2] - theirs[:, 2]), 0.0, atol=1e-6)


def test_gtsam_ends_at_the_same_optimum_of_loops_that_know_the_heading():
    graph = random_graph(np.random.default_rng(7), nodes=60, loops=25, noise=0.1)
    theirs = gtsam_optimum(gtsam_graph(graph, log_map=False), graph.poses)
    np.testing.assert_allclose(solve(graph).x.reshape(-1, 3)[:, :2], theirs[:, :2], atol=1e-4)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_order_of_edges_does_not_matter(loss):
    _, graph = grid_walk(np.random.default_rng(0))
    config = OptimizerConfig(loop_loss=loss, tolerance=1e-12)
    rng = np.random.default_rng(1)
    shuffled = replace(
        graph,
        odometry=graph.odometry.select(rng.permutation(len(graph.odometry))),
        loops=graph.loops.select(rng.permutation(len(graph.loops))),
    )
    one, other = solve(graph, config), solve(shuffled, config)
    assert one.cost_after == pytest.approx(other.cost_after, rel=1e-9)
    np.testing.assert_allclose(one.x, other.x, atol=1e-4)


def mean_error_m(truth, solution):
    """Of the shape alone: the first leg's heading turns the whole map and says nothing about the loops."""
    positions = solution.x.reshape(-1, 3)[:, :2]
    motion = planar.align_rigid(positions, truth[:, :2])
    return np.hypot(*(planar.transform(motion, positions) - truth[:, :2]).T).mean()


@pytest.mark.parametrize("seed", range(4))
def test_loops_take_the_drift_out_of_a_walk(seed):
    truth, graph = grid_walk(np.random.default_rng(seed))
    without = mean_error_m(truth, solve(replace(graph, loops=Edges.none())))
    assert mean_error_m(truth, solve(graph)) < 0.7 * without


@pytest.mark.parametrize("loss", ["cauchy", "dcs"])
@pytest.mark.parametrize("seed", range(4))
def test_redescending_losses_err_with_wrong_loops_about_as_much_as_without(seed, loss):
    truth, graph = grid_walk(np.random.default_rng(seed))
    disturbed = grid_walk(np.random.default_rng(seed), wrong=0.05)[1]
    clean = mean_error_m(truth, solve(graph))
    assert mean_error_m(truth, solve(disturbed, OptimizerConfig(loop_loss=loss))) < 1.25 * clean


@pytest.mark.parametrize("seed", range(4))
def test_squares_do_not_survive_wrong_loops(seed):
    truth, graph = grid_walk(np.random.default_rng(seed))
    disturbed = grid_walk(np.random.default_rng(seed), wrong=0.05)[1]
    assert mean_error_m(truth, solve(disturbed)) > 5 * mean_error_m(truth, solve(graph))


# Honest status


def test_one_iteration_is_not_enough_and_the_result_says_so():
    _, graph = grid_walk(np.random.default_rng(0))
    solution = solve(graph, OptimizerConfig(max_iterations=1))
    assert not solution.converged
    assert solution.iterations == 1
    assert solution.cost_after < solution.cost_before


def test_costs_before_and_after_are_those_of_the_start_and_the_end():
    graph = random_graph(np.random.default_rng(0), noise=0.3)
    blocks = graph_blocks(graph, PRECISE)
    solution = minimize(blocks, graph.poses.ravel(), PRECISE)
    assert solution.cost_before == total_cost(blocks, graph.poses.ravel())
    assert solution.cost_after == total_cost(blocks, solution.x)
    assert solution.seconds > 0
    assert solution.inverse_diagonal is None


def test_at_the_optimum_nothing_is_left_to_do():
    graph = random_graph(np.random.default_rng(0), noise=0.3)
    once = solve(graph)
    again = solve(replace(graph, poses=once.x.reshape(-1, 3)), OptimizerConfig())
    assert again.converged
    assert again.cost_after <= again.cost_before
    np.testing.assert_allclose(again.x, once.x, atol=1e-3)


def test_the_start_is_left_as_it_was():
    graph = random_graph(np.random.default_rng(0), noise=0.3)
    before = graph.poses.copy()
    solve(graph)
    np.testing.assert_array_equal(graph.poses, before)


def test_progress_is_told_at_every_iteration_and_the_cost_never_rises():
    _, graph = grid_walk(np.random.default_rng(1), wrong=0.05)
    config, told = OptimizerConfig(loop_loss="cauchy"), []
    blocks = graph_blocks(graph, config)
    solution = minimize(blocks, graph.poses.ravel(), config, progress=lambda k, cost: told.append((k, cost)))
    assert [k for k, _ in told] == list(range(1, solution.iterations + 1))
    costs = [solution.cost_before, *(cost for _, cost in told)]
    assert np.all(np.diff(costs) <= 0)
    assert costs[-1] == solution.cost_after


def test_an_unknown_without_factors_is_an_error():
    with pytest.raises(GraphError, match="found none on 2 of them"):
        minimize([location([1.0, 2.0])], np.zeros(3))


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_residuals_that_are_not_finite_are_an_error(number):
    with pytest.raises(GraphError, match="expected finite residuals"):
        minimize([location([1.0, number])], np.zeros(1))


def test_poses_that_are_not_finite_are_an_error():
    graph = random_graph(np.random.default_rng(0))
    graph.poses[3, 1] = np.nan
    with pytest.raises(GraphError, match="expected finite residuals"):
        solve(graph)


# Variances


@pytest.mark.parametrize("loss", LOSSES)
def test_variances_are_the_diagonal_of_the_inverse_of_the_normal_equations(loss):
    _, graph = grid_walk(np.random.default_rng(2), wrong=0.02)
    graph = beginning_of(graph, 60)
    config = OptimizerConfig(loop_loss=loss)
    solution = solve(graph, config, variances=True)
    normal = np.zeros((180, 180))
    for block in graph_blocks(graph, config):
        residuals, jacobians = block.linearize(solution.x)
        weights = robust_loss(block.loss, np.sum(residuals**2, axis=1), block.loss_scale)[1]
        for variables, jacobian, weight in zip(block.variables, jacobians, weights, strict=True):
            normal[np.ix_(variables, variables)] += weight * jacobian.T @ jacobian
    np.testing.assert_allclose(solution.inverse_diagonal, np.diag(np.linalg.inv(normal)), rtol=1e-6)


def test_variances_grow_along_a_walk_without_loops():
    graph = replace(random_graph(np.random.default_rng(0), nodes=20, loops=1), loops=Edges.none())
    heading_variance = solve(graph, variances=True).inverse_diagonal[2::3]
    assert np.all(np.diff(heading_variance) > 0)
    assert heading_variance[0] == pytest.approx(0.01)


def test_a_graph_that_nothing_holds_has_no_variances():
    loose = replace(random_graph(np.random.default_rng(0)), priors=Priors.none())
    with pytest.raises(GraphError, match="a map lacks its anchor"):
        solve(loose, OptimizerConfig(), variances=True)
