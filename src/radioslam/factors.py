"""Constraints of a pose graph as blocks of factors for the optimizer.

The unknowns are x = (x_0, y_0, θ_0, x_1, …, then the logarithm of the scale of each walk).
Residuals live in the measurement's frame, as in g2o:

    e_ij = (R_zᵀ (R_iᵀ (t_j - t_i) - exp(s) t_z), wrap(θ_j - θ_i - θ_z)),   s = 0 where odometry is taken as it is

so that a step needs few iterations however far the walk has turned.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import OptimizerConfig
from radioslam.losses import LossName
from radioslam.normal_equations import Block
from radioslam.pose_graph import Edges, PoseGraph, Priors

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class BetweenBlock:
    """Edges as factors; with ``log_scale`` (m,) the variable that stretches each edge's translation."""

    def __init__(
        self,
        edges: Edges,
        loss: LossName = "none",
        loss_scale: float = 1.0,
        log_scale: Integers | None = None,
        backbone: bool = True,
    ) -> None:
        self.loss, self.loss_scale, self.backbone = loss, loss_scale, backbone
        columns = [pose_variables(edges.i), pose_variables(edges.j)]
        self.scaled = log_scale is not None
        if log_scale is not None:
            columns.append(log_scale[:, None])
        self.variables = np.concatenate(columns, axis=1)
        self.root = _square_root(edges.information)
        self.turn = edges.measurement[:, 2]
        self.offset = planar.rotate(-self.turn, edges.measurement[:, :2])

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 3)."""
        values = x[self.variables]
        shift = planar.rotate(-values[:, 2] - self.turn, values[:, 3:5] - values[:, :2])
        error = np.column_stack([shift - self._stretched(values), planar.wrap(values[:, 5] - values[:, 2] - self.turn)])
        return np.einsum("mab,mb->ma", self.root, error)

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 3) and Jacobians (m, 3, 6), or (m, 3, 7) with scales."""
        values = x[self.variables]
        angle = values[:, 2] + self.turn
        c, s = np.cos(angle), np.sin(angle)
        dx, dy = (values[:, 3:5] - values[:, :2]).T
        jacobian = np.zeros((len(c), 3, self.variables.shape[1]))
        jacobian[:, 0, 3], jacobian[:, 0, 4] = c, s
        jacobian[:, 1, 3], jacobian[:, 1, 4] = -s, c
        jacobian[:, :2, :2] = -jacobian[:, :2, 3:5]
        jacobian[:, 0, 2], jacobian[:, 1, 2] = c * dy - s * dx, -s * dy - c * dx
        jacobian[:, 2, 2], jacobian[:, 2, 5] = -1.0, 1.0
        if self.scaled:
            jacobian[:, :2, 6] = -self._stretched(values)
        return self.residuals(x), self.root @ jacobian

    def _stretched(self, values: Array) -> Array:
        return self.offset * np.exp(values[:, 6:]) if self.scaled else self.offset


class PriorBlock:
    """Priors as factors: e = (R_zᵀ (t - t_z), wrap(θ - θ_z))."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, priors: Priors) -> None:
        self.measurement = priors.measurement
        self.variables = pose_variables(priors.node)
        c, s = np.cos(self.measurement[:, 2]), np.sin(self.measurement[:, 2])
        into_frame = np.zeros((len(c), 3, 3))
        into_frame[:, 0, 0], into_frame[:, 0, 1], into_frame[:, 1, 0], into_frame[:, 1, 1] = c, s, -s, c
        into_frame[:, 2, 2] = 1.0
        self.jacobian = _square_root(priors.information) @ into_frame

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 3)."""
        error = x[self.variables] - self.measurement
        error[:, 2] = planar.wrap(error[:, 2])
        return np.einsum("mab,mb->ma", self.jacobian, error)

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 3) and Jacobians (m, 3, 3)."""
        return self.residuals(x), self.jacobian


class ZeroBlock:
    """Independent unknowns near zero: e = x / σ for ``variables`` (m,) and σ (m,) or a number."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, variables: Integers, sigma: Array | float) -> None:
        self.variables = variables[:, None]
        self.jacobian = np.broadcast_to(1.0 / np.asarray(sigma), variables.shape).reshape(-1, 1, 1)

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 1)."""
        return x[self.variables] * self.jacobian[:, 0]

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 1) and Jacobians (m, 1, 1)."""
        return self.residuals(x), self.jacobian


def graph_blocks(graph: PoseGraph, config: OptimizerConfig) -> tuple[list[Block], int]:
    """The blocks of a graph, and the number of its unknowns."""
    size, blocks, scale = graph.poses.size, list[Block](), None
    if graph.log_scale_sigma is not None and graph.walk is not None:
        scale = size + graph.walk[graph.odometry.i]
        blocks.append(ZeroBlock(size + np.arange(len(graph.log_scale_sigma)), graph.log_scale_sigma))
        size += len(graph.log_scale_sigma)
    blocks += [
        BetweenBlock(graph.odometry, log_scale=scale),
        BetweenBlock(graph.links),
        BetweenBlock(graph.loops, config.loop_loss, config.loss_scale, backbone=False),
        PriorBlock(graph.priors),
    ]
    return blocks, size


def pose_variables(nodes: Integers) -> Integers:
    """Places (m, 3) in x of the poses of nodes (m,)."""
    return 3 * nodes[:, None] + np.arange(3)


def _square_root(information: Array) -> Array:
    """Upper triangular S (m, 3, 3) with SᵀS = Ω."""
    return np.swapaxes(np.linalg.cholesky(information), 1, 2)
