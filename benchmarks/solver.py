"""Pose graph optimization beside GTSAM's Levenberg-Marquardt, on the standard graphs, one thread each.

GTSAM's own reader loads the graph (its time is not counted); both start from the same poses and stop at the same
relative tolerance. GTSAM's between-factor uses the log map, ours the plain difference as g2o does, so both results are
judged by our cost.
"""

from __future__ import annotations

import gzip
import os
import tempfile
import time
from pathlib import Path

import numpy as np

from radioslam.config import OptimizerConfig
from radioslam.factors import BetweenBlock, PriorBlock
from radioslam.g2o import read_g2o
from radioslam.optimizer import minimize, total_cost
from radioslam.pose_graph import Edges, PoseGraph

REPOSITORY = Path(__file__).resolve().parent.parent
GRAPHS = ("intel", "MIT", "manhattan", "city10000")
RELATIVE_TOLERANCE = 1e-6


def blocks_of(graph: PoseGraph) -> list[BetweenBlock | PriorBlock]:
    return [BetweenBlock(Edges.concatenate([graph.odometry, graph.loops])), PriorBlock(graph.priors)]


def ours(graph: PoseGraph) -> tuple[float, float]:
    """Seconds and cost."""
    started = time.perf_counter()
    config = OptimizerConfig(tolerance=RELATIVE_TOLERANCE, max_iterations=200)
    solution = minimize(blocks_of(graph), graph.poses.ravel(), config)
    return time.perf_counter() - started, solution.cost_after


def gtsams(text: str, graph: PoseGraph) -> tuple[float, float]:
    """Seconds, building the graph from arrays left out, and cost by our measure."""
    import gtsam

    with tempfile.NamedTemporaryFile("w", suffix=".g2o") as file:
        file.write(text)
        file.flush()
        factors, _ = gtsam.readG2o(file.name, False)
    factors.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*graph.poses[0]), gtsam.noiseModel.Isotropic.Sigma(3, 1e-6)))
    initial = gtsam.Values()
    for k, pose in enumerate(graph.poses):
        initial.insert(k, gtsam.Pose2(*pose))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(RELATIVE_TOLERANCE)
    parameters.setMaxIterations(200)
    started = time.perf_counter()
    values = gtsam.LevenbergMarquardtOptimizer(factors, initial, parameters).optimize()
    seconds = time.perf_counter() - started
    poses = [values.atPose2(k) for k in range(len(graph.poses))]
    x = np.array([[pose.x(), pose.y(), pose.theta()] for pose in poses]).ravel()
    return seconds, total_cost(blocks_of(graph), x)


def run() -> None:
    """Print seconds, the ratio and both costs for every graph."""
    folder = Path(os.environ.get("RADIOSLAM_DATA", REPOSITORY.parent / "shared" / "data")) / "pose-graphs"
    if not folder.is_dir():
        print(f"solver: no graphs in {folder}; set RADIOSLAM_DATA to the folder of recordings")
        return
    print(f"{'graph':10} {'poses':>6} {'ours s':>8} {'GTSAM s':>8} {'ratio':>6} {'our cost':>12} {'its cost':>12}")
    for name in GRAPHS:
        text = gzip.decompress((folder / f"{name}.g2o.gz").read_bytes()).decode()
        graph = read_g2o(text, name)
        ours(graph)  # warm
        (a, our_cost), (b, its_cost) = ours(graph), gtsams(text, graph)
        row = f"{name:10} {len(graph.poses):6d} {a:8.3f} {b:8.3f} {b / a:6.1f}"
        print(f"{row} {our_cost:12.4g} {its_cost:12.4g}", flush=True)


if __name__ == "__main__":
    run()
