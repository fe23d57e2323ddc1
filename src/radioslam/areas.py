"""One pose graph as areas that can be optimized apart, and what is left to be solved together.

Every walk belongs to one area. A loop between two areas makes its end in the other area a *shared* unknown, as are the
radio's lag and the building's axis. With x = (inner, shared), an area's share of a Gauss-Newton step is eliminated to

    S = H_ss - H_si H_ii⁻¹ H_is,    b = g_s - H_si H_ii⁻¹ g_i       (Schur complement)

The sum over areas is the reduced graph, (Σ S) δ_s = -Σ b; then each area finds δ_i = -H_ii⁻¹ (g_i + H_is δ_s). It is
the step that the whole graph would take, so both end at the same place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import OptimizerConfig
from radioslam.factors import Layout, graph_blocks
from radioslam.normal_equations import NormalEquations, factorise
from radioslam.optimizer import total_cost
from radioslam.pose_graph import Edges, Legs, PoseGraph, Priors
from radioslam.selected_inverse import inverse_diagonal

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Area:
    """A part of a graph.

    Attributes:
        graph: its walks, the loops that it owns, and the far ends of these as nodes without walk.
        variables: (k,) place of each of its unknowns among those of the whole graph.
        shared: (k,) whether other areas know it too.
    """

    graph: PoseGraph
    variables: Integers
    shared: NDArray[np.bool_]


def walks_by_area(graph: PoseGraph, areas: int) -> Integers:
    """(n_walks,) area of each walk: the widest part is halved along its longer side until there are enough.

    Raises:
        ValueError: the graph does not say which walk a node belongs to.
    """
    if graph.walk is None:
        raise ValueError("expected a graph with walks, found one without")
    count = np.bincount(graph.walk)
    centre = np.column_stack([np.bincount(graph.walk, column) / count for column in graph.poses[:, :2].T])
    area = np.zeros(len(count), np.int64)
    for new in range(1, min(areas, len(count))):
        widest = int(np.argmax(np.bincount(area, count)))
        here = np.flatnonzero(area == widest)
        if len(here) < 2:
            break
        axis = int(np.ptp(centre[here], axis=0).argmax())
        area[here[np.argsort(centre[here, axis], kind="stable")[len(here) // 2 :]]] = new
    return area


def split_graph(graph: PoseGraph, area_of_walk: Integers) -> Iterator[Area]:
    """The areas of a graph; an edge between two belongs to that of its first node."""
    assert graph.walk is not None
    area_of_node = area_of_walk[graph.walk]
    count = int(area_of_walk.max()) + 1
    far = [edges.j[area_of_node[edges.i] != area_of_node[edges.j]] for edges in (graph.loops, graph.links)]
    shared_node = np.isin(np.arange(len(graph.poses)), np.concatenate(far))
    for number in range(count):
        yield _area(graph, number, count, area_of_node, area_of_walk, shared_node)


def shared_part(areas: Sequence[Area]) -> float:
    """The part of all unknowns that are shared, 0 to 1. They are dense in the reduced graph, so few of them pay."""
    shared = np.unique(np.concatenate([area.variables[area.shared] for area in areas]))
    return len(shared) / (1 + max(int(area.variables.max()) for area in areas))


def _area(
    graph: PoseGraph,
    number: int,
    count: int,
    area_of_node: Integers,
    area_of_walk: Integers,
    shared_node: NDArray[np.bool_],
) -> Area:
    own = area_of_node == number
    owned = [own[edges.i] for edges in (graph.odometry, graph.loops, graph.links)]
    needed = own.copy()
    needed[graph.loops.j[owned[1]]] = needed[graph.links.j[owned[2]]] = True
    nodes = np.flatnonzero(needed)
    place = np.full(len(needed), -1)
    place[nodes] = np.arange(len(nodes))
    walks = np.flatnonzero(area_of_walk == number)
    walk = np.zeros(len(area_of_walk), np.int64)
    walk[walks] = np.arange(len(walks))
    assert graph.walk is not None
    held = own[graph.priors.node]
    priors = Priors(place[graph.priors.node[held]], graph.priors.measurement[held], graph.priors.information[held])
    part = PoseGraph(
        poses=graph.poses[nodes],
        odometry=_numbered(graph.odometry.select(owned[0]), place),
        loops=_numbered(graph.loops.select(owned[1]), place),
        links=_numbered(graph.links.select(owned[2]), place),
        priors=priors,
        walk=walk[graph.walk[nodes]],
        log_scale_sigma=None if graph.log_scale_sigma is None else graph.log_scale_sigma[walks],
        loop_velocity=None if graph.loop_velocity is None else graph.loop_velocity[owned[1]],
        lag_sigma_s=graph.lag_sigma_s * count**0.5,  # so many areas hold it
        legs=_legs(graph.legs, own, place),
    )
    whole, layout = Layout.of(graph), Layout.of(part)
    variables, shared = np.empty(layout.size, np.int64), np.zeros(layout.size, bool)
    variables[: 3 * len(nodes)] = (3 * nodes[:, None] + np.arange(3)).ravel()
    shared[: 3 * len(nodes)] = np.repeat(shared_node[nodes], 3)
    if layout.scales is not None and whole.scales is not None:
        variables[layout.scales : layout.scales + len(walks)] = whole.scales + walks
    for here, there in ((layout.lag, whole.lag), (layout.axis, whole.axis)):
        if here is not None and there is not None:
            variables[here], shared[here] = there, True
    return Area(part, variables, shared)


def _numbered(edges: Edges, place: Integers) -> Edges:
    return replace(edges, i=place[edges.i], j=place[edges.j])


def _legs(legs: Legs | None, own: NDArray[np.bool_], place: Integers) -> Legs | None:
    if legs is None:
        return None
    here = own[legs.begin]
    return Legs(place[legs.begin[here]], place[legs.end[here]], legs.sigma_rad[here], legs.axis_rad)


@dataclass(frozen=True)
class Reduced:
    """An area's share of the reduced graph: cost F, ``matrix`` (s, s), ``vector`` (s,), ``variables`` (s,) of it."""

    cost: float
    matrix: Array
    vector: Array
    variables: Integers


class AreaSolver:
    """Linearizes one area and eliminates its inner unknowns."""

    def __init__(self, area: Area, config: OptimizerConfig) -> None:
        self.area = area
        self.blocks = [block for block in graph_blocks(area.graph, config) if len(block.variables)]
        self.system = NormalEquations(self.blocks, len(area.variables))
        self.inner, self.outer = np.flatnonzero(~area.shared), np.flatnonzero(area.shared)
        self.last: tuple[bytes, float, Reduced] | None = None

    def reduce(self, x: Array, damping: float) -> Reduced:
        """The share of the area at the whole graph's unknowns x (n,); what was done last is not done again."""
        own = x[self.area.variables]
        if self.last is None or self.last[:2] != (own.tobytes(), damping):
            self.last = (own.tobytes(), damping, self._eliminated(own, damping))
        return self.last[2]

    def _eliminated(self, own: Array, damping: float) -> Reduced:
        values, self.gradient = self.system.assemble(own)
        values = values.copy()
        values[self.system.diagonal_slot] *= 1 + damping
        size = (len(own), len(own))
        upper = sparse.csc_array((values, self.system.rows, self.system.pointers), shape=size)
        matrix = sparse.csc_array(upper + sparse.triu(upper, 1).T)
        self.factor = factorise(matrix[self.inner][:, self.inner])
        self.coupling = matrix[self.inner][:, self.outer].toarray()
        right = [*self.coupling.T, self.gradient[self.inner]]
        self.solved = np.column_stack([self.factor.solve(np.ascontiguousarray(column)) for column in right])
        joint = self.coupling.T @ self.solved
        return Reduced(
            total_cost(self.blocks, own),
            matrix[self.outer][:, self.outer].toarray() - joint[:, :-1],
            self.gradient[self.outer] - joint[:, -1],
            self.area.variables[self.outer],
        )

    def back(self, shared_step: Array) -> tuple[Integers, Array]:
        """Variables and step of the inner unknowns, once that of the shared ones, (n,) of the whole graph, is known."""
        step = -self.solved[:, -1] - self.solved[:, :-1] @ shared_step[self.area.variables[self.outer]]
        return self.area.variables[self.inner], step

    def variances(self, shared_covariance: Array) -> tuple[Integers, Array]:
        """Variables and marginal variances of the inner unknowns; the covariance is that of the area's shared ones."""
        lower, pivots, order = self.factor.factors()
        diagonal = np.empty(len(self.inner))
        diagonal[order] = inverse_diagonal(sparse.csc_array(lower), pivots)
        spread = self.solved[:, :-1]
        return self.area.variables[self.inner], diagonal + np.sum((spread @ shared_covariance) * spread, axis=1)
