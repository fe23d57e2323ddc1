"""A crowd of rigid walks: each keeps the shape that odometry gave it, but may be shifted, turned and scaled.

The unknowns are x = (x_0, y_0, θ_0, s_0, x_1, …, φ, τ): where each walk's centre stands, its turn, the logarithm of its
scale, a turn φ common to all compasses, and by how much the radio lags. What a scan at the point q of a walk holds was
heard where the walker, of velocity v, had been τ before; seen from outside, with q from the walk's centre:

    p = (x, y) + a,    a = exp(s) R(θ) (q - τ v),    ∂p/∂θ = R(π/2) a,    ∂p/∂s = a,    ∂p/∂τ = -exp(s) R(θ) v
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.losses import LossName

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class RigidWalks:
    """Points of walks about their centres.

    Attributes:
        walk: (n,) walk of each point.  points: (n, 2) from the walk's centre, metres.  velocity: (n, 2) in m/s, zero
            for points that no radio tells.  centre: (w, 2) in the walk's own frame.
    """

    walk: Integers
    points: Array
    velocity: Array
    centre: Array

    @staticmethod
    def of(walk: Integers, positions_xy: Array, velocity: Array, walks: int) -> RigidWalks:
        """Walks through positions (n, 2) in frames of their own; the centre is their mean."""
        count = np.maximum(np.bincount(walk, minlength=walks), 1)
        centre = np.column_stack([np.bincount(walk, column, walks) / count for column in positions_xy.T])
        return RigidWalks(walk, positions_xy - centre[walk], velocity, centre)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 4 * len(self.centre) + 2

    @property
    def common_turn(self) -> int:
        """Place of φ in x."""
        return 4 * len(self.centre)

    @property
    def lag(self) -> int:
        """Place of τ in x."""
        return 4 * len(self.centre) + 1

    def places(self, x: Array) -> Array:
        """The walks' own unknowns (w, 4), a view into x."""
        return x[: 4 * len(self.centre)].reshape(-1, 4)

    def unknowns(self, k: int) -> Integers:
        """Places (w,) in x of the k-th unknown of every walk: 0 x, 1 y, 2 turn, 3 log scale."""
        return 4 * np.arange(len(self.centre)) + k

    def variables(self, i: Integers) -> Integers:
        """Places (m, 5) in x of the unknowns that points i (m,) depend on."""
        return np.column_stack([4 * self.walk[i][:, None] + np.arange(4), np.full(len(i), self.lag)])

    def positions(self, x: Array) -> Array:
        """Points (n, 2) in the frame of the crowd."""
        return self.arms(x) + self.places(x)[self.walk, :2]

    def arms(self, x: Array) -> Array:
        """Points (n, 2), turned, scaled and set back by the lag, from their walk's centre."""
        return self._laid(x, self.points - x[self.lag] * self.velocity)

    def jacobians(self, x: Array, i: Integers) -> Array:
        """∂p/∂(x, y, θ, s, τ), (m, 2, 5), of points i (m,)."""
        arm = self.arms(x)[i]
        jacobian = np.zeros((len(i), 2, 5))
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
        jacobian[:, 0, 2], jacobian[:, 1, 2] = -arm[:, 1], arm[:, 0]
        jacobian[:, :, 3] = arm
        jacobian[:, :, 4] = -self._laid(x, self.velocity)[i]
        return jacobian

    def _laid(self, x: Array, vectors: Array) -> Array:
        place = self.places(x)[self.walk]
        return np.exp(place[:, 3:]) * planar.rotate(place[:, 2], vectors)


@dataclass(frozen=True)
class Placement:
    """Where the w walks of a crowd stand, as rigid pieces.

    Attributes:
        centre: (w, 2) a point of each walk's own frame.  place: (w, 4) where it lies in the frame of the walk's part
            (x, y in m), the walk's turn (rad) and the logarithm of its scale.
        part: (w,) walks of one number share a frame; 0 is the main part.
        sigma_m: (w,) standard deviation per axis of the centre, from the part's best known walk or, with known
            positions, from the building; NaN for a walk alone.
        reason: (w,) why a walk is not in the main part, empty for those that are.
        fixed: (w,) whether a known position holds the walk.
    """

    centre: Array
    place: Array
    part: Integers
    sigma_m: Array
    reason: tuple[str, ...]
    fixed: NDArray[np.bool_]

    def poses(self, walk: Integers, poses: Array) -> Array:
        """Poses (n, 3) of the walks' own frames, ``walk`` (n,), in the frames of their parts."""
        place = self.place[walk]
        arm = planar.rotate(place[:, 2], poses[:, :2] - self.centre[walk])
        return np.column_stack([place[:, :2] + np.exp(place[:, 3:]) * arm, poses[:, 2] + place[:, 2]])


class SamePlaceBlock:
    """Loops between walks: e = (p_j - p_i) / σ."""

    def __init__(
        self, walks: RigidWalks, i: Integers, j: Integers, sigma_m: Array, loss: LossName = "cauchy", scale: float = 1.0
    ) -> None:
        self.walks, self.i, self.j, self.sigma_m = walks, i, j, sigma_m
        self.loss, self.loss_scale = loss, scale
        self.variables = np.concatenate([walks.variables(i), walks.variables(j)], axis=1)

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 2)."""
        positions = self.walks.positions(x)
        return (positions[self.j] - positions[self.i]) / self.sigma_m[:, None]

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 2) and Jacobians (m, 2, 10)."""
        ends = [-self.walks.jacobians(x, self.i), self.walks.jacobians(x, self.j)]
        return self.residuals(x), np.concatenate(ends, axis=2) / self.sigma_m[:, None, None]


class TurnBlock:
    """Compasses that share what turns them all: e = (θ - φ) / σ for each walk's turn, ``turns`` (m,)."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, turns: Integers, common_turn: int, sigma_rad: float) -> None:
        self.variables = np.column_stack([turns, np.full(len(turns), common_turn)])
        self.jacobian = np.tile(np.array([[[1.0, -1.0]]]) / sigma_rad, (len(turns), 1, 1))

    def residuals(self, x: Array) -> Array:
        """Whitened residuals (m, 1)."""
        return np.einsum("mab,mb->ma", self.jacobian, x[self.variables])

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residuals (m, 1) and Jacobians (m, 1, 2)."""
        return self.residuals(x), self.jacobian


class MeanBlock:
    """A gauge, one factor: the mean of k unknowns is zero, e = mean / σ."""

    loss: LossName = "none"
    loss_scale = 1.0

    def __init__(self, variables: Integers, sigma: float) -> None:
        self.variables = variables[None, :]
        self.jacobian = np.full((1, 1, len(variables)), 1.0 / (len(variables) * sigma))

    def residuals(self, x: Array) -> Array:
        """Whitened residual (1, 1)."""
        return np.einsum("mab,mb->ma", self.jacobian, x[self.variables])

    def linearize(self, x: Array) -> tuple[Array, Array]:
        """Whitened residual (1, 1) and Jacobian (1, 1, k)."""
        return self.residuals(x), self.jacobian
