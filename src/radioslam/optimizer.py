"""Levenberg-Marquardt over blocks of factors; the only file that knows the sparse solver.

The unknowns are one flat vector x (n,). A block holds m factors of one kind as arrays: whitened residuals r (m, d),
their Jacobians J (m, d, k) and the k unknowns of each factor, ``variables`` (m, k). The cost is

    F(x) = 1/2 Σ_blocks Σ_factors ρ(‖r‖²)

with the block's robust loss ρ, minimized by iteratively reweighted steps (JᵀWJ + λ diag) δ = -JᵀW r. The sparsity of
JᵀWJ is found once; its values are summed with one ``bincount`` per step and factorised by qdldl (LDLᵀ, AMD ordering).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import OptimizerConfig
from radioslam.errors import GraphError
from radioslam.selected_inverse import inverse_diagonal

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
LossName = Literal["none", "huber", "cauchy", "dcs"]


class Block(Protocol):
    """m factors of one kind."""

    variables: Integers
    loss: LossName
    loss_scale: float  # standard deviations

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, d) and Jacobians (m, d, k) at x (n,)."""
        ...

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, d) at x (n,)."""
        ...


def robust_loss(name: LossName, q: Array, scale: float) -> tuple[Array, Array]:
    """ρ(q) and its derivative, the weight, for squared whitened residuals q (m,).

    With k = scale: ``huber`` 2k√q - k² beyond k²; ``cauchy`` k² log(1 + q/k²); ``dcs`` (dynamic covariance scaling,
    Agarwal et al. 2013, Φ = k²) q up to Φ, then 3Φ - 4Φ²/(Φ+q), whose weight is (2Φ/(Φ+q))².
    """
    k2 = scale * scale
    if name == "none":
        return q, np.ones_like(q)
    if name == "cauchy":
        return k2 * np.log1p(q / k2), 1.0 / (1.0 + q / k2)
    inside = q <= k2
    if name == "huber":
        root = np.sqrt(np.maximum(q, k2))
        return np.where(inside, q, 2 * scale * root - k2), np.where(inside, 1.0, scale / root)
    weight = (2 * k2 / (k2 + q)) ** 2
    return np.where(inside, q, 3 * k2 - 4 * k2 * k2 / (k2 + q)), np.where(inside, 1.0, weight)


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
    system = _NormalEquations(blocks, len(x))
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


class _NormalEquations:
    """JᵀWJ (upper triangle, CSC) and JᵀWr of a fixed set of blocks."""

    def __init__(self, blocks: Sequence[Block], size: int) -> None:
        self.blocks, self.size = blocks, size
        keys, self.upper = [np.arange(size, dtype=np.int64) * (size + 1)], []
        for block in blocks:
            row, column = block.variables[:, :, None], block.variables[:, None, :]
            upper = np.broadcast_to(row <= column, (len(row), row.shape[1], row.shape[1]))
            keys.append((column * size + row)[upper])
            self.upper.append(upper)
        unique, self.slot = np.unique(np.concatenate(keys), return_inverse=True)
        self.rows, columns = unique % size, unique // size
        self.pointers = np.searchsorted(columns, np.arange(size + 1))
        self.diagonal_slot = self.slot[:size]
        self.factor: qdldl.Solver | None = None

    def assemble(self, x: Array) -> tuple[Array, Array]:
        """Values (nnz,) of the upper triangle of JᵀWJ, and the gradient JᵀWr (n,)."""
        values: list[Array] = [np.zeros(self.size)]
        gradient: Array = np.zeros(self.size)
        for block, upper in zip(self.blocks, self.upper, strict=True):
            r, jacobian = block.linearize(x)
            weight = robust_loss(block.loss, np.sum(r**2, axis=1), block.loss_scale)[1]
            weighted = jacobian * weight[:, None, None]
            values.append((weighted.transpose(0, 2, 1) @ jacobian)[upper])
            pull = (weighted * r[:, :, None]).sum(axis=1)
            gradient = gradient + np.bincount(block.variables.ravel(), pull.ravel(), minlength=self.size)
        total = np.bincount(self.slot, np.concatenate(values), minlength=len(self.rows))
        return total.astype(np.float64, copy=False), gradient

    def diagonal_of(self, values: Array) -> Array:
        return values[self.diagonal_slot]

    def solve(self, values: Array, gradient: Array, damping: float) -> Array:
        damped = values.copy()
        damped[self.diagonal_slot] *= 1.0 + damping
        return np.asarray(self._factorise(damped).solve(-gradient))

    def _factorise(self, values: Array) -> qdldl.Solver:
        undetermined = np.flatnonzero(values[self.diagonal_slot] <= 0)
        if len(undetermined):
            raise GraphError(f"expected factors on every unknown, found none on {len(undetermined)} of them")
        matrix = sparse.csc_matrix((values, self.rows, self.pointers), shape=(self.size, self.size))
        if self.factor is None:
            self.factor = qdldl.Solver(matrix, upper=True)
        else:
            self.factor.update(matrix, upper=True)
        return self.factor

    def inverse_diagonal(self, x: Array) -> Array:
        """Diagonal (n,) of (JᵀWJ)⁻¹."""
        lower, pivots, order = self._factorise(self.assemble(x)[0]).factors()
        if np.any(pivots <= 0):
            raise GraphError("expected a graph that is tied down, found a singular one; a map lacks its anchor")
        diagonal = np.empty(self.size)
        diagonal[order] = inverse_diagonal(sparse.csc_array(lower), pivots)
        return diagonal
