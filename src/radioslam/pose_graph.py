"""The pose graph, equation (1): planar poses as nodes, constraints between them as edges.

    x* = argmin Σ_odometry e' Ω e + Σ_loops e' Ω e + Σ_priors e' Ω e,   e_ij = z_ij⁻¹ ∘ (x_i⁻¹ ∘ x_j)

Residuals live in the measurement's frame, as in g2o: e = (R_zᵀ (R_iᵀ (t_j - t_i) - t_z), wrap(θ_j - θ_i - θ_z)).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from radioslam.errors import GraphError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Edges:
    """m relative constraints.

    Attributes:
        i, j: (m,) nodes.  measurement: (m, 3) pose of j seen from i.
        information: (m, 3, 3) inverse covariance of (x, y, θ) in the measurement's frame.
    """

    i: Integers
    j: Integers
    measurement: Array
    information: Array

    def __len__(self) -> int:
        return len(self.i)

    @staticmethod
    def none() -> Edges:
        """No edge at all."""
        nodes = np.zeros(0, np.int64)
        return Edges(nodes, nodes, np.zeros((0, 3)), np.zeros((0, 3, 3)))

    def select(self, mask: NDArray[np.bool_]) -> Edges:
        """The edges that a mask (m,) picks."""
        return Edges(*(getattr(self, name)[mask] for name in Edges.__dataclass_fields__))

    @staticmethod
    def concatenate(parts: Iterable[Edges]) -> Edges:
        """All edges of the parts, in their order."""
        parts = [Edges.none(), *parts]
        names = Edges.__dataclass_fields__
        return Edges(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class Priors:
    """m constraints on single nodes: ``node`` (m,), ``measurement`` (m, 3), ``information`` (m, 3, 3)."""

    node: Integers
    measurement: Array
    information: Array

    def __len__(self) -> int:
        return len(self.node)

    @staticmethod
    def none() -> Priors:
        """No prior at all."""
        return Priors(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3, 3)))

    @staticmethod
    def concatenate(parts: Iterable[Priors]) -> Priors:
        """All priors of the parts, in their order."""
        parts = [Priors.none(), *parts]
        return Priors(*(np.concatenate([getattr(p, name) for p in parts]) for name in Priors.__dataclass_fields__))


@dataclass(frozen=True)
class Legs:
    """m straight legs that run along or across one axis of the building.

    Attributes:
        begin, end: (m,) nodes.  sigma_rad: (m,) standard deviation of a leg's direction.
        axis_rad: first estimate of the axis, an unknown of the graph.
    """

    begin: Integers
    end: Integers
    sigma_rad: Array
    axis_rad: float

    def __len__(self) -> int:
        return len(self.begin)


@dataclass(frozen=True)
class PoseGraph:
    """Nodes and edges as arrays.

    Attributes:
        poses: (n, 3) initial estimate.
        odometry: edges along the walks.  links: edges between starts.  loops: loop closures.
        priors: constraints on single nodes.
        walk: (n,) walk of each node; what the unknowns of whole walks belong to.
        log_scale_sigma: (n_walks,) standard deviation of the logarithm of each walk's scale, an unknown of the graph
            that stretches its odometry; None where odometry is taken as it is.
        loop_velocity: (n_loops, 2) m/s, how much faster j moved than i. The radio's lag, an unknown of the graph of
            standard deviation ``lag_sigma_s``, parts the ends of a loop by lag times this; None without that unknown.
        legs: straight legs that share an axis, or None.
    """

    poses: Array
    odometry: Edges
    loops: Edges = field(default_factory=Edges.none)
    links: Edges = field(default_factory=Edges.none)
    priors: Priors = field(default_factory=Priors.none)
    walk: Integers | None = None
    log_scale_sigma: Array | None = None
    loop_velocity: Array | None = None
    lag_sigma_s: float = 0.0
    legs: Legs | None = None

    @property
    def edge_count(self) -> int:
        """Odometry, links and loops together."""
        return len(self.odometry) + len(self.links) + len(self.loops)

    def components(self) -> Integers:
        """The connected part (n,) that each node belongs to, priors not counted."""
        edges = Edges.concatenate([self.odometry, self.links, self.loops])
        n = len(self.poses)
        adjacency = coo_array((np.ones(len(edges)), (edges.i, edges.j)), shape=(n, n))
        return connected_components(adjacency, directed=False)[1].astype(np.int64)

    def check(self) -> PoseGraph:
        """Return the graph if it can be solved.

        Raises:
            GraphError: a node outside the graph, an edge from a node to itself, duplicate edges of one kind, a
                number that is not finite, an information matrix that is not symmetric positive definite, or a
                connected part without a prior.
        """
        n = len(self.poses)
        for name in ("odometry", "links", "loops"):
            _check_edges(name, getattr(self, name), n)
        _check_nodes("priors", self.priors.node, n)
        _check_finite("priors", self.priors.measurement)
        _check_information("priors", self.priors.information)
        _check_finite("poses", self.poses)
        anchored = np.zeros(n, bool)
        component = self.components()
        anchored[component[self.priors.node]] = True
        loose = np.flatnonzero(~anchored[component])
        if len(loose):
            raise GraphError(
                f"expected a prior on every connected part, found none for {len(loose)} nodes (first: {loose[0]})"
            )
        return self


def _check_nodes(name: str, nodes: Integers, n: int) -> None:
    if len(nodes) and (nodes.min() < 0 or nodes.max() >= n):
        raise GraphError(f"{name}: expected nodes 0 to {n - 1}, found {nodes.min()} to {nodes.max()}")


def _check_finite(name: str, numbers: Array) -> None:
    if not np.isfinite(numbers).all():
        raise GraphError(f"{name}: expected finite numbers, found others")


def _check_information(name: str, information: Array) -> None:
    if not np.isfinite(information).all():
        raise GraphError(f"{name}: expected finite information, found other numbers")
    symmetric = np.allclose(information, np.swapaxes(information, 1, 2), rtol=1e-6, atol=1e-9)
    if not symmetric or (len(information) and np.linalg.eigvalsh(information).min() <= 0):
        raise GraphError(f"{name}: expected symmetric positive definite information matrices, found others")


def _check_edges(name: str, edges: Edges, n: int) -> None:
    _check_nodes(name, np.concatenate([edges.i, edges.j]), n)
    _check_finite(name, edges.measurement)
    _check_information(name, edges.information)
    if np.any(edges.i == edges.j):
        raise GraphError(
            f"{name}: expected two different nodes, found an edge from {edges.i[edges.i == edges.j][0]} to itself"
        )
    keys = np.minimum(edges.i, edges.j) * n + np.maximum(edges.i, edges.j)
    values, counts = np.unique(keys, return_counts=True)
    if len(values) < len(keys):
        first = int(values[counts > 1][0])
        raise GraphError(f"{name}: expected each edge once, found {first // n}-{first % n} again")


def diagonal_information(*sigmas: Array | float) -> Array:
    """Information (m, 3, 3) of independent standard deviations of x, y (m) and θ (rad), each (m,) or a number."""
    columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(s, dtype=float)) for s in sigmas))
    information = np.zeros((len(columns[0]), 3, 3))
    information[:, range(3), range(3)] = 1.0 / np.stack(columns, axis=1) ** 2
    return information
