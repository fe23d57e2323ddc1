"""A graph in areas, solved by its reduced graph, against the same graph as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radioslam.areas import split_graph, walks_by_area
from radioslam.config import load_config
from radioslam.engine import OneMachine
from radioslam.factors import first_guess
from radioslam.pose_graph import Priors, diagonal_information
from radioslam.reduced_graph import AreasHere, minimize_in_areas
from tests.crowds import office_result

CONFIG = load_config(environment={}).optimizer


def crowd(starts="known"):
    """The graph of an office at its first guess, with all unknowns of whole walks."""
    result = office_result("default", starts)
    rng = np.random.default_rng(1)
    moved = result.graph.poses + rng.normal(0, [0.5, 0.5, 0.05], result.graph.poses.shape)
    return replace(result.graph, poses=moved)


@pytest.mark.parametrize("areas", [1, 2, 4])
def test_areas_end_where_the_whole_graph_does(areas):
    graph = crowd()
    whole = OneMachine().optimize(graph, CONFIG, last=True)
    parts = list(split_graph(graph, walks_by_area(graph, areas)))
    assert len(parts) == areas
    solution = minimize_in_areas(AreasHere(parts, CONFIG), first_guess(graph), CONFIG, variances=True)
    assert solution.converged
    assert solution.cost_before == pytest.approx(whole.cost_before)
    assert solution.cost_after == pytest.approx(whole.cost_after, rel=1e-5)
    positions = [one.x[: graph.poses.size].reshape(-1, 3)[:, :2] for one in (whole, solution)]
    assert np.abs(positions[0] - positions[1]).max() < 0.02
    np.testing.assert_allclose(solution.inverse_diagonal, whole.inverse_diagonal, rtol=0.02)


def test_every_factor_belongs_to_one_area():
    graph = crowd()
    parts = list(split_graph(graph, walks_by_area(graph, 3)))
    for name in ("odometry", "loops", "links", "priors"):
        assert sum(len(getattr(part.graph, name)) for part in parts) == len(getattr(graph, name))
    inner = np.concatenate([part.variables[~part.shared] for part in parts])
    assert len(np.unique(inner)) == len(inner)
    everything = np.unique(np.concatenate([part.variables for part in parts]))
    np.testing.assert_array_equal(everything, np.arange(len(first_guess(graph))))


def test_a_graph_of_few_walks_has_no_more_areas_than_walks():
    graph = crowd()
    assert walks_by_area(graph, 100).max() + 1 <= len(np.unique(graph.walk))


def test_common_starts_tie_areas_by_their_links():
    graph = crowd("common")
    held = diagonal_information(0.01, 0.01, 0.01)
    graph = replace(graph, priors=Priors(np.zeros(1, np.int64), graph.poses[:1], held))
    whole = OneMachine().optimize(graph, CONFIG, last=False)
    parts = AreasHere(list(split_graph(graph, walks_by_area(graph, 3))), CONFIG)
    solution = minimize_in_areas(parts, first_guess(graph), CONFIG, variances=False)
    assert solution.cost_after == pytest.approx(whole.cost_after, rel=1e-4)
