"""The linear system of one optimizer step, (JᵀWJ + λ diag) δ = -JᵀW r; the only file that knows the sparse solvers.

The sparsity of JᵀWJ is found once and its values are summed with one ``bincount`` per step. Two solvers share it:

* direct: LDLᵀ by qdldl (AMD ordering). Fast while the factor stays sparse, as with few loops per walk.
* iterative: conjugate gradients preconditioned by the factor of the *backbone*, all entries that backbone blocks
  (odometry, priors) touch. In a crowd every walk is tied to every other, the factor of the whole fills up (40 walks
  with 180,000 loops: half a minute), while some fifty iterations of gradients take a fifth of a second.

A first direct factor that filled up, or more loops than a sparse factor can hold, decide for gradients; a system that
they do not solve in ``MOST_ITERATIONS`` goes back to the direct solver for good.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from radioslam.errors import GraphError
from radioslam.losses import LossName, robust_loss
from radioslam.selected_inverse import inverse_diagonal

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CROWDED = 12
"""Entries of JᵀWJ's upper triangle per unknown above which the direct solver is not even tried."""
FILL = 10
"""A factor with so many times the entries of JᵀWJ has filled up."""
SMALLEST_ITERATIVE = 3000
"""Unknowns below which the direct solver wins in any case."""
MOST_ITERATIONS = 200
RELATIVE_RESIDUAL = 1e-4
"""Of a step; the next step mends what is left. Thousands of scans end within 0.1 mm of where 1e-8 takes them."""


class Block(Protocol):
    """m factors of one kind.

    A block with ``backbone = False`` ties far parts of the graph; the preconditioner holds its share of the diagonal.
    """

    variables: Integers
    loss: LossName
    loss_scale: float  # standard deviations

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, d) and Jacobians (m, d, k) at x (n,)."""
        ...

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, d) at x (n,)."""
        ...


def factorise(matrix: sparse.csc_array) -> qdldl.Solver:
    """LDLᵀ of a symmetric positive definite matrix (n, n)."""
    return qdldl.Solver(sparse.csc_matrix(sparse.triu(matrix)), upper=True)


def _factorised(solver: qdldl.Solver | None, upper: sparse.csc_matrix) -> qdldl.Solver:
    """A solver of an upper triangle; one that knows its pattern already only renews the numbers."""
    if solver is None:
        return qdldl.Solver(upper, upper=True)
    solver.update(upper, upper=True)
    return solver


class NormalEquations:
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
        self.rows, self.columns = unique % size, unique // size
        self.pointers = np.searchsorted(self.columns, np.arange(size + 1))
        self.diagonal_slot = self.slot[:size]
        held = [True, *(getattr(block, "backbone", True) for block in blocks)]
        self.in_backbone = np.zeros(len(self.rows), bool)
        self.in_backbone[self.slot[np.repeat(held, [len(k) for k in keys])]] = True
        self.direct: qdldl.Solver | None = None
        self.backbone: qdldl.Solver | None = None
        self.may_iterate = size >= SMALLEST_ITERATIVE and not self.in_backbone.all()
        self.iterates = self.may_iterate and len(self.rows) > CROWDED * size

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
        """Diagonal (n,) of JᵀWJ."""
        return values[self.diagonal_slot]

    def solve(self, values: Array, gradient: Array, damping: float) -> Array:
        """The step δ (n,).

        Raises:
            GraphError: no factor says anything of an unknown.
        """
        self._check_determined(values)
        damped = values.copy()
        damped[self.diagonal_slot] *= 1.0 + damping
        if self.iterates:
            step = self._solve_iteratively(damped, -gradient)
            if step is not None:
                return step
            self.may_iterate = self.iterates = False
        step = np.asarray(self._factorise(damped).solve(-gradient))
        if self.may_iterate:  # the pattern, and with it the fill, stays what it is
            self.may_iterate = self.iterates = self.fill() > FILL
        return step

    def fill(self) -> float:
        """Entries of the direct factor over those of JᵀWJ."""
        return self.direct.factors()[0].nnz / len(self.rows) if self.direct is not None else 0.0

    def inverse_diagonal(self, x: Array) -> Array:
        """Diagonal (n,) of (JᵀWJ)⁻¹.

        Raises:
            GraphError: the factors leave an unknown undetermined.
        """
        values = self.assemble(x)[0]
        self._check_determined(values)
        lower, pivots, order = self._factorise(values).factors()
        if np.any(pivots <= 0):
            raise GraphError("expected a graph that is tied down, found a singular one; a map lacks its anchor")
        diagonal = np.empty(self.size)
        diagonal[order] = inverse_diagonal(sparse.csc_array(lower), pivots)
        return diagonal

    def _check_determined(self, values: Array) -> None:
        undetermined = np.flatnonzero(self.diagonal_of(values) <= 0)
        if len(undetermined):
            raise GraphError(f"expected factors on every unknown, found none on {len(undetermined)} of them")

    def _factorise(self, values: Array) -> qdldl.Solver:
        matrix = sparse.csc_matrix((values, self.rows, self.pointers), shape=(self.size, self.size))
        self.direct = _factorised(self.direct, matrix)
        return self.direct

    def _solve_iteratively(self, values: Array, right: Array) -> Array | None:
        """Preconditioned conjugate gradients; None where they take too long."""
        shape = (self.size, self.size)
        upper = sparse.csc_matrix((values, self.rows, self.pointers), shape=shape)
        whole = (upper + sparse.triu(upper, 1).T).tocsr()
        held = (values[self.in_backbone], (self.rows[self.in_backbone], self.columns[self.in_backbone]))
        self.backbone = _factorised(self.backbone, sparse.csc_matrix(held, shape=shape))
        inverse = LinearOperator(shape, matvec=lambda r, solver=self.backbone: solver.solve(r.ravel()))
        step, unsolved = cg(whole, right, rtol=RELATIVE_RESIDUAL, maxiter=MOST_ITERATIONS, M=inverse)
        return None if unsolved else np.asarray(step)
