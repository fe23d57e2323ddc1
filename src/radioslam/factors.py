"""Constraints of a pose graph as blocks of factors for the optimizer.

The unknowns are x = (x_0, y_0, θ_0, x_1, …, then the logarithm of the scale of each walk, the radio's lag and the
building's axis), each of the last three only where the graph has it; see ``Layout``.
Residuals live in the measurement's frame, as in g2o:

    e_ij = (R_zᵀ (R_iᵀ (t_j - t_i) - exp(s) t_z), wrap(θ_j - θ_i - θ_z)),   s = 0 where odometry is taken as it is

so that a step needs few iterations however far the walk has turned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import OptimizerConfig
from radioslam.losses import LossName
from radioslam.normal_equations import Block
from radioslam.pose_graph import Edges, Legs, PoseGraph, Priors

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
    """Independent unknowns near one value: e = (x - value) / σ for ``variables`` (m,) and σ (m,) or a number."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, variables: Integers, sigma: Array | float, value: float = 0.0) -> None:
        self.variables, self.value = variables[:, None], value
        self.jacobian = np.broadcast_to(1.0 / np.asarray(sigma), variables.shape).reshape(-1, 1, 1)

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 1)."""
        return (x[self.variables] - self.value) * self.jacobian[:, 0]

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 1) and Jacobians (m, 1, 1)."""
        return self.residuals(x), self.jacobian


class PlaceBlock:
    """Positions of ``nodes`` (m,) near places (m, 2), known to σ (m,) per axis: e = (t - place) / σ."""

    def __init__(self, nodes: Integers, places_xy: Array, sigma_m: Array, loss: LossName, loss_scale: float) -> None:
        self.loss, self.loss_scale, self.places_xy = loss, loss_scale, places_xy
        self.variables = pose_variables(nodes)[:, :2]
        self.jacobian = np.eye(2) / sigma_m[:, None, None]

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 2)."""
        return np.einsum("mab,mb->ma", self.jacobian, x[self.variables] - self.places_xy)

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 2) and Jacobians (m, 2, 2)."""
        return self.residuals(x), self.jacobian


class SamePlaceBlock:
    """Loops of a radio that lags by τ: e = (t_j - t_i - τ v) / σ, v (m, 2) how much faster j moved than i.

    What a scan holds was heard τ before its time, at t - τ · velocity. Linear; σ is that of the loops' x and y.
    """

    backbone = False

    def __init__(self, loops: Edges, velocity: Array, lag: int, loss: LossName, loss_scale: float) -> None:
        self.loss, self.loss_scale = loss, loss_scale
        m = len(loops)
        ends = [pose_variables(loops.i)[:, :2], pose_variables(loops.j)[:, :2]]
        self.variables = np.concatenate([*ends, np.full((m, 1), lag)], axis=1)
        rows = np.concatenate(
            [np.tile(-np.eye(2), (m, 1, 1)), np.tile(np.eye(2), (m, 1, 1)), -velocity[:, :, None]], axis=2
        )
        self.jacobian = rows * np.sqrt(loops.information[:, 0, 0])[:, None, None]

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 2)."""
        return np.einsum("mab,mb->ma", self.jacobian, x[self.variables])

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 2) and Jacobians (m, 2, 5)."""
        return self.residuals(x), self.jacobian


class AlongAxisBlock:
    """Legs along or across an axis α: e = (direction of t_end - t_begin, less α, from the nearest right angle) / σ."""

    backbone = False

    def __init__(self, legs: Legs, axis: int, loss: LossName, loss_scale: float) -> None:
        self.loss, self.loss_scale, self.sigma = loss, loss_scale, legs.sigma_rad
        ends = [pose_variables(legs.begin)[:, :2], pose_variables(legs.end)[:, :2]]
        self.variables = np.concatenate([*ends, np.full((len(legs), 1), axis)], axis=1)

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 1)."""
        values = x[self.variables]
        dx, dy = (values[:, 2:4] - values[:, :2]).T
        return (off_axis(np.arctan2(dy, dx) - values[:, 4]) / self.sigma)[:, None]

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 1) and Jacobians (m, 1, 5)."""
        values = x[self.variables]
        dx, dy = (values[:, 2:4] - values[:, :2]).T
        square = np.maximum(dx * dx + dy * dy, 1e-12)
        turn = np.column_stack([dy, -dx, -dy, dx, -square]) / square[:, None]
        return self.residuals(x), (turn / self.sigma[:, None])[:, None, :]


def off_axis(angle: Array) -> Array:
    """Angles (any shape) from the nearest multiple of π/2, in [-π/4, π/4)."""
    return (angle + np.pi / 4) % (np.pi / 2) - np.pi / 4


@dataclass(frozen=True)
class Layout:
    """Where the unknowns of a graph stand in x: ``size`` in all, the poses first.

    Attributes:
        scales: first of the walks' log scales.  lag, axis: places; each None where the graph has no such unknown.
    """

    size: int
    scales: int | None
    lag: int | None
    axis: int | None

    @staticmethod
    def of(graph: PoseGraph) -> Layout:
        """The layout of a graph."""
        size, places = graph.poses.size, list[int | None]()
        scales = 0 if graph.log_scale_sigma is None else len(graph.log_scale_sigma)
        for count in (scales, int(graph.loop_velocity is not None), int(graph.legs is not None)):
            places.append(size if count else None)
            size += count
        return Layout(size, *places)


def first_guess(graph: PoseGraph) -> Array:
    """The unknowns (n,) to begin with: the graph's poses and axis, no lag, scales as they are."""
    layout = Layout.of(graph)
    x = np.zeros(layout.size)
    x[: graph.poses.size] = graph.poses.ravel()
    if graph.legs is not None and layout.axis is not None:
        x[layout.axis] = graph.legs.axis_rad
    return x


def graph_blocks(graph: PoseGraph, config: OptimizerConfig) -> list[Block]:
    """The blocks of a graph."""
    layout, scale = Layout.of(graph), None
    blocks: list[Block] = [BetweenBlock(graph.links), PriorBlock(graph.priors)]
    if layout.scales is not None and graph.log_scale_sigma is not None and graph.walk is not None:
        scale = layout.scales + graph.walk[graph.odometry.i]
        blocks.append(ZeroBlock(layout.scales + np.arange(len(graph.log_scale_sigma)), graph.log_scale_sigma))
    blocks.append(BetweenBlock(graph.odometry, log_scale=scale))
    robust = config.loop_loss, config.loss_scale
    if layout.lag is not None and graph.loop_velocity is not None:
        blocks.append(ZeroBlock(np.array([layout.lag]), graph.lag_sigma_s))
        blocks.append(SamePlaceBlock(graph.loops, graph.loop_velocity, layout.lag, *robust))
    else:
        blocks.append(BetweenBlock(graph.loops, *robust, backbone=False))
    if layout.axis is not None and graph.legs is not None:
        blocks.append(AlongAxisBlock(graph.legs, layout.axis, *robust))
    return blocks


def pose_variables(nodes: Integers) -> Integers:
    """Places (m, 3) in x of the poses of nodes (m,)."""
    return 3 * nodes[:, None] + np.arange(3)


def _square_root(information: Array) -> Array:
    """Upper triangular S (m, 3, 3) with SᵀS = Ω."""
    return np.swapaxes(np.linalg.cholesky(information), 1, 2)
