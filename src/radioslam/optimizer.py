"""Levenberg-Marquardt over blocks of factors.

The unknowns are one flat vector x (n,). A block holds m factors of one kind as arrays: whitened residuals r (m, d),
their Jacobians J (m, d, k) and the k unknowns of each factor, ``variables`` (m, k). The cost is

    F(x) = 1/2 Σ_blocks Σ_factors ρ(‖r‖²)

with the block's robust loss ρ, minimized by iteratively reweighted steps (JᵀWJ + λ diag) δ = -JᵀW r, whose linear
algebra is that of ``normal_equations``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.config import OptimizerConfig
from radioslam.errors import GraphError
from radioslam.losses import robust_loss
from radioslam.normal_equations import Block, NormalEquations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """What the optimizer reached.

    Attributes:
        x: (n,) the unknowns.
        converged: the tolerance was met within the iterations allowed.
        iterations: steps tried.  cost_before, cost_after: F(x).  seconds: wall clock.
        inverse_diagonal: (n,) variances, the diagonal of (JᵀWJ)⁻¹ at x, or None if not asked for.
    """

    x: Array
    converged: bool
    iterations: int
    cost_before: float
    cost_after: float
    seconds: float
    inverse_diagonal: Array | None


def minimize(
    blocks: Sequence[Block],
    x: Array,
    config: OptimizerConfig | None = None,
    variances: bool = False,
    progress: Callable[[int, float], None] | None = None,
) -> Solution:
    """Minimize F from x (n,). ``progress`` is called with (iteration, cost) after each step.

    Raises:
        GraphError: a residual is not finite, or the factors leave an unknown undetermined.
    """
    config = config or OptimizerConfig()
    started = time.perf_counter()
    blocks = [block for block in blocks if len(block.variables)]
    system = NormalEquations(blocks, len(x))
    cost = cost_before = total_cost(blocks, x)
    if not np.isfinite(cost):
        raise GraphError("expected finite residuals at the start, found others; check poses and measurements")
    damping, growth, iteration, converged = 1e-6, 2.0, 0, cost < 1e-20
    hessian, gradient = system.assemble(x)
    while iteration < config.max_iterations and not converged:
        iteration += 1
        step = system.solve(hessian, gradient, damping)
        predicted = -0.5 * float(step @ (gradient - damping * system.diagonal_of(hessian) * step))
        trial = x + step
        trial_cost = total_cost(blocks, trial)
        gain = (cost - trial_cost) / predicted if predicted > 0 else -1.0
        if np.isfinite(trial_cost) and gain > 0:
            converged = cost - trial_cost <= config.tolerance * cost or float(np.abs(step).max()) <= config.tolerance
            x, cost = trial, trial_cost
            damping, growth = max(damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 1e-12), 2.0
            if not converged:
                hessian, gradient = system.assemble(x)
        else:
            at_rest = damping < 1e-3 and predicted <= config.tolerance * cost
            converged = at_rest or float(np.abs(step).max()) <= config.tolerance
            damping, growth = damping * growth, 2 * growth
        if progress:
            progress(iteration, cost)
    diagonal = system.inverse_diagonal(x) if variances else None
    return Solution(x, converged, iteration, cost_before, cost, time.perf_counter() - started, diagonal)


def total_cost(blocks: Sequence[Block], x: Array) -> float:
    """F(x)."""
    cost = 0.0
    for block in blocks:
        q = np.sum(block.residuals(x) ** 2, axis=1)
        cost += 0.5 * float(np.sum(robust_loss(block.loss, q, block.loss_scale)[0]))
    return cost
