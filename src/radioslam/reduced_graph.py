"""Gauss-Newton over the areas of a graph: areas reduce, the shared unknowns are solved, areas follow.

Who computes an area's share, and where, is for the caller to say; what passes between are the unknowns.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.areas import Area, AreaSolver, Reduced
from radioslam.config import OptimizerConfig
from radioslam.errors import GraphError
from radioslam.normal_equations import factorise
from radioslam.optimizer import Solution

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Values = tuple[Integers, Array]


class AreaWorkers(Protocol):
    """Where areas are kept and computed; ``x`` (n,) are the unknowns of the whole graph."""

    def reduce(self, x: Array, damping: float) -> Sequence[Reduced]:
        """Every area's share of the reduced graph."""
        ...

    def back(self, x: Array, damping: float, shared_step: Array) -> Sequence[Values]:
        """Every area's inner variables and their step."""
        ...

    def variances(self, x: Array, covariances: Sequence[Array]) -> Sequence[Values]:
        """Every area's inner variables and their variances, given the covariance (s, s) of its shared ones."""
        ...


class AreasHere:
    """All areas in this process."""

    def __init__(self, areas: Sequence[Area], config: OptimizerConfig) -> None:
        self.solvers = [AreaSolver(area, config) for area in areas]

    def reduce(self, x: Array, damping: float) -> Sequence[Reduced]:
        """One after the other."""
        return [solver.reduce(x, damping) for solver in self.solvers]

    def back(self, x: Array, damping: float, shared_step: Array) -> Sequence[Values]:
        """By what the last reduction left."""
        self.reduce(x, damping)
        return [solver.back(shared_step) for solver in self.solvers]

    def variances(self, x: Array, covariances: Sequence[Array]) -> Sequence[Values]:
        """The same without damping."""
        self.reduce(x, 0.0)
        return [solver.variances(one) for solver, one in zip(self.solvers, covariances, strict=True)]


def minimize_in_areas(workers: AreaWorkers, x: Array, config: OptimizerConfig, variances: bool) -> Solution:
    """Minimize F from x (n,) as ``optimizer.minimize`` does, to the same tolerance.

    Raises:
        GraphError: a residual is not finite at the start.
    """
    started = time.perf_counter()
    damping, iteration, converged = 1e-6, 0, False
    shares = workers.reduce(x, damping)
    cost = cost_before = sum(share.cost for share in shares)
    if not np.isfinite(cost):
        raise GraphError("expected finite residuals at the start, found others; check poses and measurements")
    while iteration < config.max_iterations and not converged:
        iteration += 1
        step = _shared_step(shares, len(x))
        for variables, inner in workers.back(x, damping, step):
            step[variables] = inner
        trial_damping = max(damping / 3, 1e-12)
        trial = workers.reduce(x + step, trial_damping)
        trial_cost = sum(share.cost for share in trial)
        small = float(np.abs(step).max()) <= config.tolerance
        if np.isfinite(trial_cost) and trial_cost <= cost:
            converged = small or cost - trial_cost <= config.tolerance * cost
            x, cost, shares, damping = x + step, trial_cost, trial, trial_damping
        else:
            converged = small
            damping *= 8
            shares = workers.reduce(x, damping)
    diagonal = _variances(workers, x) if variances else None
    return Solution(x, converged, iteration, cost_before, cost, time.perf_counter() - started, diagonal)


def _summed(shares: Sequence[Reduced]) -> tuple[Integers, sparse.csc_array, Array]:
    """Shared variables (s,), the matrix (s, s) and the vector (s,) of the reduced graph."""
    variables = np.unique(np.concatenate([share.variables for share in shares]))
    places = [np.searchsorted(variables, share.variables) for share in shares]
    rows = np.concatenate([np.repeat(place, len(place)) for place in places])
    columns = np.concatenate([np.tile(place, len(place)) for place in places])
    values = np.concatenate([share.matrix.ravel() for share in shares])
    size = len(variables)
    matrix = sparse.csc_array(sparse.coo_array((values, (rows, columns)), shape=(size, size)))
    vector = np.bincount(np.concatenate(places), np.concatenate([share.vector for share in shares]), size)
    return variables, matrix, vector.astype(np.float64)


def _shared_step(shares: Sequence[Reduced], size: int) -> Array:
    variables, matrix, vector = _summed(shares)
    step = np.zeros(size)
    if len(variables):
        step[variables] = -factorise(matrix).solve(vector)
    return step


def _variances(workers: AreaWorkers, x: Array) -> Array:
    shares = workers.reduce(x, 0.0)
    variables, matrix, _ = _summed(shares)
    size = len(variables)
    covariance = np.linalg.inv(matrix.toarray()) if size else np.zeros((0, 0))
    diagonal = np.empty(len(x))
    diagonal[variables] = np.diag(covariance)
    places = [np.searchsorted(variables, share.variables) for share in shares]
    for own, values in workers.variances(x, [covariance[np.ix_(place, place)] for place in places]):
        diagonal[own] = values
    return diagonal
