"""Pose graphs as g2o text, the common tongue of pose graph optimizers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.errors import GraphError
from radioslam.pose_graph import Edges, PoseGraph, Priors

Array = NDArray[np.float64]


def write_g2o(graph: PoseGraph, path: Path) -> None:
    """Write VERTEX_SE2, EDGE_PRIOR_SE2 and EDGE_SE2 lines; edges in the order odometry, links, loops."""
    upper = np.triu_indices(3)
    lines = [f"VERTEX_SE2 {k} {_numbers(pose)}" for k, pose in enumerate(graph.poses)]
    for node, z, information in zip(graph.priors.node, graph.priors.measurement, graph.priors.information, strict=True):
        lines.append(f"EDGE_PRIOR_SE2 {node} {_numbers(z)} {_numbers(information[upper])}")
    edges = Edges.concatenate([graph.odometry, graph.links, graph.loops])
    for i, j, z, information in zip(edges.i, edges.j, edges.measurement, edges.information, strict=True):
        lines.append(f"EDGE_SE2 {i} {j} {_numbers(z)} {_numbers(information[upper])}")
    path.write_text("\n".join(lines) + "\n", "utf-8")


def _numbers(values: Array) -> str:
    return " ".join(repr(float(v)) for v in values)


def read_g2o(text: str, name: str = "g2o") -> PoseGraph:
    """Read VERTEX_SE2, EDGE_SE2, EDGE_PRIOR_SE2 and FIX lines; edges between consecutive nodes count as odometry.

    Vertices may come in any order and be missing altogether, as long as each edge k-1 → k is there to chain them.
    Without prior or FIX the first node is fixed.

    Raises:
        GraphError: a malformed line (named by its number), or an edge to a vertex that is not there.
    """
    vertices: dict[int, list[float]] = {}
    edges: list[list[float]] = []
    priors: list[list[float]] = []
    fixed: list[int] = []
    widths = {"VERTEX_SE2": 4, "EDGE_SE2": 11, "EDGE_PRIOR_SE2": 10}
    for number, line in enumerate(text.splitlines(), 1):
        tag, *fields = line.split() or ["#"]
        if tag.startswith("#"):
            continue
        try:
            values = [float(f) for f in fields]
            if tag == "FIX":
                fixed += [_number(v) for v in values]
            elif len(values) != widths[tag]:
                raise ValueError(f"{len(values)} numbers after {tag}")
            elif tag == "VERTEX_SE2":
                vertices[_number(values[0])] = values[1:]
            else:
                (edges if tag == "EDGE_SE2" else priors).append(values)
        except (ValueError, KeyError) as error:
            expected = "VERTEX_SE2, EDGE_SE2, EDGE_PRIOR_SE2 or FIX with its numbers"
            raise GraphError(f"{name}:{number}: expected {expected}, found {error}") from None
    return _assemble(vertices, np.array(edges).reshape(-1, 11), np.array(priors).reshape(-1, 10), fixed, name)


def _number(value: float) -> int:
    if not value.is_integer() or abs(value) > 2**53:
        raise ValueError(f"the vertex number {value:g}")
    return int(value)


def _assemble(vertices: dict[int, list[float]], edges: Array, priors: Array, fixed: list[int], name: str) -> PoseGraph:
    ids = np.array(sorted(vertices), dtype=np.int64) if vertices else np.unique(edges[:, :2]).astype(np.int64)
    pairs = np.searchsorted(ids, edges[:, :2])
    known = np.isin(edges[:, :2], ids).all() and np.isin(priors[:, 0], ids).all() and np.isin(fixed, ids).all()
    if not len(ids) or not known:
        raise GraphError(f"{name}: expected edges between its vertices, found other numbers or no vertex")
    all_edges = Edges(pairs[:, 0], pairs[:, 1], edges[:, 2:5], _symmetric(edges[:, 5:]))
    chain = pairs[:, 1] == pairs[:, 0] + 1
    poses = np.array([vertices[k] for k in ids]) if vertices else _chain(all_edges, chain, len(ids))
    anchors = np.searchsorted(ids, np.array(fixed or ([] if len(priors) else ids[:1]), dtype=np.int64))
    stiff = np.broadcast_to(1e12 * np.eye(3), (len(anchors), 3, 3))
    return PoseGraph(
        poses,
        all_edges.select(chain),
        loops=all_edges.select(~chain),
        priors=Priors(
            np.concatenate([np.searchsorted(ids, priors[:, 0]), anchors]).astype(np.int64),
            np.concatenate([priors[:, 1:4], poses[anchors]]),
            np.concatenate([_symmetric(priors[:, 4:]), stiff]),
        ),
    )


def _symmetric(upper: Array) -> Array:
    """(m, 6) upper triangles, row by row, as (m, 3, 3)."""
    return upper[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


def _chain(edges: Edges, chain: NDArray[np.bool_], n: int) -> Array:
    poses = np.zeros((n, 3))
    step = {int(i): z for i, z in zip(edges.i[chain], edges.measurement[chain], strict=True)}
    for k in range(n - 1):
        if k not in step:
            raise GraphError(f"expected vertices, or edges that chain all nodes, found neither at node {k}")
        poses[k + 1] = planar.compose(poses[k], step[k])
    return poses
