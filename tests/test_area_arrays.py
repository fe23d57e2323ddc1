"""Areas on their way between machines."""

from __future__ import annotations

import numpy as np

from radioslam.area_arrays import area_arrays, area_of, reduced_arrays, reduced_of
from radioslam.areas import AreaSolver, split_graph, walks_by_area
from radioslam.config import load_config
from radioslam.factors import first_guess
from tests.crowds import office_result


def test_an_area_comes_back_and_reduces_to_the_same():
    graph, config = office_result("default", "known").graph, load_config(environment={}).optimizer
    x = first_guess(graph)
    for area in split_graph(graph, walks_by_area(graph, 2)):
        reduced = AreaSolver(area, config).reduce(x, 1e-6)
        again = AreaSolver(area_of(area_arrays(area)), config).reduce(x, 1e-6)
        for one in (again, reduced_of(reduced_arrays(reduced))):
            assert one.cost == reduced.cost
            np.testing.assert_array_equal(one.matrix, reduced.matrix)
            np.testing.assert_array_equal(one.vector, reduced.vector)
            np.testing.assert_array_equal(one.variables, reduced.variables)
