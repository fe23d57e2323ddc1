"""Pose graphs in space: SE(3) nodes and edges as arrays, their g2o text, and what they are in the plane.

x* = argmin Σ_odometry e' Σ⁻¹ e + Σ_loops ρ(e' Σ⁻¹ e),   e_ij = log(z_ij⁻¹ x_i⁻¹ x_j),  rotation before translation
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.pose_graph import Edges

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_PLANAR = np.array([3, 4, 2])
"""Where x, y and θ stand among rotation and translation in space."""


@dataclass(frozen=True)
class SpatialEdges:
    """m relative constraints.

    Attributes:
        i, j: (m,) nodes.  T_i_j: (m, 4, 4) pose of j seen from i.
        covariance: (m, 6, 6) of a small motion of j in its own axes, rotation (rad) before translation (m).
    """

    i: Integers
    j: Integers
    T_i_j: Array
    covariance: Array

    def __len__(self) -> int:
        return len(self.i)

    def select(self, mask: NDArray[np.bool_]) -> SpatialEdges:
        """The edges that a mask (m,) picks."""
        return SpatialEdges(self.i[mask], self.j[mask], self.T_i_j[mask], self.covariance[mask])

    def planar(self) -> Edges:
        """What they say of x, y and heading, the rest marginalized."""
        covariance = self.covariance[:, _PLANAR[:, None], _PLANAR]
        information = np.asarray(np.linalg.inv(covariance), float)
        information = (information + np.swapaxes(information, 1, 2)) / 2  # exactly symmetric
        return Edges(self.i, self.j, rigid.to_planar(self.T_i_j), information)


@dataclass(frozen=True)
class SpatialGraph:
    """Poses (n, 4, 4) in one frame, ``odometry`` along the walks, and ``loops``: what registration found.

    The nodes ``anchors`` (a,) stay where they are: the first of each part that nothing ties to another. Each ``walk``
    (n,) may have taken its metres too long or too short, but for those that are ``measured`` (w,): by their clouds.
    """

    T_map_body: Array
    odometry: SpatialEdges
    loops: SpatialEdges
    anchors: Integers
    walk: Integers
    measured: NDArray[np.bool_]


def moved(covariance: Array, T_new_old: Array) -> Array:
    """Covariances (m, 6, 6) of small motions of frames that are mounted on each other: Ad Σ Adᵀ (m, 6, 6)."""
    R, t = T_new_old[..., :3, :3], T_new_old[..., :3, 3]
    skew = np.zeros((*t.shape[:-1], 3, 3))
    skew[..., 0, 1], skew[..., 0, 2], skew[..., 1, 2] = -t[..., 2], t[..., 1], -t[..., 0]
    skew -= np.swapaxes(skew, -1, -2)
    adjoint = np.zeros((*t.shape[:-1], 6, 6))
    adjoint[..., :3, :3] = adjoint[..., 3:, 3:] = R
    adjoint[..., 3:, :3] = skew @ R
    return np.asarray(adjoint @ covariance @ np.swapaxes(adjoint, -1, -2))


def write_spatial_g2o(graph: SpatialGraph, path: Path) -> None:
    """Write VERTEX_SE3:QUAT, FIX and EDGE_SE3:QUAT lines; the information is translation before rotation.

    g2o's residual in rotation is the vector part of a quaternion, half the angle: its information is four times ours.
    """
    order, scale = np.array([3, 4, 5, 0, 1, 2]), np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    upper = np.triu_indices(6)
    lines = [f"VERTEX_SE3:QUAT {k} {_pose(T)}" for k, T in enumerate(graph.T_map_body)]
    lines += [f"FIX {k}" for k in graph.anchors]
    for edges in (graph.odometry, graph.loops):
        information = np.linalg.inv(edges.covariance)[:, order[:, None], order] * np.outer(scale, scale)
        for i, j, T, omega in zip(edges.i, edges.j, edges.T_i_j, information, strict=True):
            lines.append(f"EDGE_SE3:QUAT {i} {j} {_pose(T)} {_numbers(omega[upper])}")
    path.write_text("\n".join(lines) + "\n", "utf-8")


def _pose(T: Array) -> str:
    return f"{_numbers(T[:3, 3])} {_numbers(rigid.quaternions(T[None])[0])}"


def _numbers(values: Array) -> str:
    return " ".join(repr(float(v)) for v in values)
