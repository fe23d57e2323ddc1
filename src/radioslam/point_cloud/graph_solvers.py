"""Optimizing a graph of point clouds: in the plane by this package's solver, in space by GTSAM, known here only."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.config import OptimizerConfig, ReferenceConfig
from radioslam.errors import ConfigError
from radioslam.factors import BetweenBlock, PriorBlock, ZeroBlock
from radioslam.normal_equations import Block
from radioslam.optimizer import minimize
from radioslam.point_cloud.spatial_graph import SpatialEdges, SpatialGraph
from radioslam.pose_graph import PoseGraph, Priors

Array = NDArray[np.float64]

ANCHOR_SIGMA = 1e-4
GRADUATION = (1000.0, 300.0, 100.0, 30.0, 10.0, 3.0, 1.0)
"""Widenings of the robust loss, one solution after the other."""


def solve(graph: SpatialGraph, planar: bool, config: ReferenceConfig) -> tuple[SpatialGraph, bool]:
    """The graph with its best poses, and whether the optimizer converged.

    Registrations are good to a centimetre, drift is metres: at first even right loops lie a hundred standard deviations
    off, and a robust loss would pass them over. So the loss is wide at first and narrows with each solution (graduated
    non-convexity, Yang et al. 2020).
    """
    converged = False
    for widening in GRADUATION:
        poses, converged = (_solve_planar if planar else _solve_spatial)(
            graph, config, widening * config.loop_loss_scale
        )
        graph = replace(graph, T_map_body=poses)
    return graph, converged


def planar_graph(graph: SpatialGraph) -> PoseGraph:
    """The same nodes and edges as x, y and heading."""
    poses = rigid.to_planar(graph.T_map_body)
    stiff = np.broadcast_to(np.eye(3) / ANCHOR_SIGMA**2, (len(graph.anchors), 3, 3))
    priors = Priors(graph.anchors, poses[graph.anchors], stiff)
    return PoseGraph(poses, graph.odometry.planar(), loops=graph.loops.planar(), priors=priors)


def _solve_planar(graph: SpatialGraph, config: ReferenceConfig, loss_scale: float) -> tuple[Array, bool]:
    """Beside the poses each walk has the logarithm of its odometry's scale as an unknown, unless measured."""
    flat = planar_graph(graph)
    walks = len(graph.measured)
    scale = flat.poses.size + np.arange(walks)
    blocks: list[Block] = [
        BetweenBlock(flat.odometry, log_scale=scale[graph.walk[flat.odometry.i]]),
        BetweenBlock(flat.loops, loss="dcs", loss_scale=loss_scale),
        PriorBlock(flat.priors),
        ZeroBlock(scale, np.where(graph.measured, ANCHOR_SIGMA, config.odometry_scale_sigma)),
    ]
    x = np.concatenate([flat.poses.ravel(), np.zeros(walks)])
    solution = minimize(blocks, x, OptimizerConfig(max_iterations=config.max_iterations))
    poses = rigid.from_planar(solution.x[: flat.poses.size].reshape(-1, 3))
    poses[:, 2, 3] = graph.T_map_body[:, 2, 3]
    return poses, solution.converged


def _solve_spatial(graph: SpatialGraph, config: ReferenceConfig, loss_scale: float) -> tuple[Array, bool]:
    gtsam = _gtsam()
    factors, initial = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k, T in enumerate(graph.T_map_body):
        initial.insert(k, gtsam.Pose3(T))
    for k in graph.anchors:
        noise = gtsam.noiseModel.Isotropic.Sigma(6, ANCHOR_SIGMA)
        factors.add(gtsam.PriorFactorPose3(int(k), gtsam.Pose3(graph.T_map_body[k]), noise))
    _add_edges(gtsam, factors, graph.odometry, None)
    _add_edges(gtsam, factors, graph.loops, gtsam.noiseModel.mEstimator.DCS.Create(loss_scale**2))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(config.max_iterations)
    optimizer = gtsam.LevenbergMarquardtOptimizer(factors, initial, parameters)
    before, values = factors.error(initial), optimizer.optimize()
    poses = np.array([values.atPose3(k).matrix() for k in range(len(graph.T_map_body))])
    converged = bool(factors.error(values) <= before and optimizer.iterations() < config.max_iterations)
    return poses, converged


def _add_edges(gtsam: Any, factors: Any, edges: SpatialEdges, loss: Any) -> None:
    for i, j, T, covariance in zip(edges.i, edges.j, edges.T_i_j, edges.covariance, strict=True):
        noise = gtsam.noiseModel.Gaussian.Covariance(covariance)
        noise = gtsam.noiseModel.Robust.Create(loss, noise) if loss is not None else noise
        factors.add(gtsam.BetweenFactorPose3(int(i), int(j), gtsam.Pose3(T), noise))


def _gtsam() -> Any:
    try:
        import gtsam
    except ImportError:
        advice = "install it with: pip install 'radioslam[pointcloud]', or give --planar"
        raise ConfigError(f"graphs in space need GTSAM; {advice}") from None
    return gtsam
