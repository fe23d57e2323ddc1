"""Conjugate gradients against the direct solver: the same steps, the same optimum."""

import numpy as np
import pytest

from radioslam import normal_equations
from radioslam.config import OptimizerConfig
from radioslam.factors import graph_blocks
from radioslam.normal_equations import NormalEquations
from radioslam.optimizer import minimize

from .builders import grid_walk


@pytest.fixture
def graph():
    return grid_walk(np.random.default_rng(3), wrong=0.02)[1]


@pytest.fixture
def by_gradients(monkeypatch):
    """Small graphs too are solved by conjugate gradients from the first step on."""
    monkeypatch.setattr(normal_equations, "SMALLEST_ITERATIVE", 0)
    monkeypatch.setattr(normal_equations, "CROWDED", 0)


def system_of(graph):
    return NormalEquations(graph_blocks(graph, OptimizerConfig(loop_loss="cauchy")), graph.poses.size)


def test_small_systems_are_solved_directly(graph):
    system = system_of(graph)
    assert not system.may_iterate
    assert system.fill() == 0.0


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_gradients_that_go_on_give_the_step_of_the_direct_solver(graph, by_gradients, damping, monkeypatch):
    monkeypatch.setattr(normal_equations, "RELATIVE_RESIDUAL", 1e-8)
    iterative = system_of(graph)
    assert iterative.iterates
    values, gradient = iterative.assemble(graph.poses.ravel())
    step = iterative.solve(values, gradient, damping)
    assert iterative.direct is None, "the direct solver must not have been asked"
    iterative.iterates = False
    np.testing.assert_allclose(step, iterative.solve(values, gradient, damping), atol=1e-6 * np.abs(step).max())


def test_both_solvers_reach_one_optimum(graph, request):
    config = OptimizerConfig(loop_loss="cauchy", tolerance=1e-10)
    blocks = graph_blocks(graph, config)
    direct = minimize(blocks, graph.poses.ravel(), config)
    request.getfixturevalue("by_gradients")
    iterative = minimize(blocks, graph.poses.ravel(), config)
    assert iterative.converged
    np.testing.assert_allclose(iterative.x, direct.x, atol=1e-4)


def test_gradients_that_take_too_long_leave_it_to_the_direct_solver(graph, by_gradients, monkeypatch):
    monkeypatch.setattr(normal_equations, "MOST_ITERATIONS", 1)
    system = system_of(graph)
    values, gradient = system.assemble(graph.poses.ravel())
    step = system.solve(values, gradient, 0.0)
    assert not system.may_iterate
    assert system.direct is not None
    direct = system_of(graph)
    direct.may_iterate = direct.iterates = False
    np.testing.assert_array_equal(step, direct.solve(values, gradient, 0.0))


def test_a_factor_that_filled_up_hands_over_to_gradients(graph, monkeypatch):
    monkeypatch.setattr(normal_equations, "SMALLEST_ITERATIVE", 0)
    monkeypatch.setattr(normal_equations, "CROWDED", 1000)
    monkeypatch.setattr(normal_equations, "FILL", 0.5)
    system = system_of(graph)
    values, gradient = system.assemble(graph.poses.ravel())
    assert not system.iterates
    system.solve(values, gradient, 0.0)
    assert system.iterates


def test_a_factor_that_stays_sparse_stays_with_the_direct_solver(graph, monkeypatch):
    monkeypatch.setattr(normal_equations, "SMALLEST_ITERATIVE", 0)
    monkeypatch.setattr(normal_equations, "CROWDED", 1000)
    monkeypatch.setattr(normal_equations, "FILL", 1000)
    system = system_of(graph)
    system.solve(*system.assemble(graph.poses.ravel()), 0.0)
    assert not system.may_iterate
