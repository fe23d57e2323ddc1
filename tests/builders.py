"""Small walks, fingerprints and graphs that many tests begin with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi, sin
from typing import Any

import numpy as np
from scipy import sparse

from radioslam import planar
from radioslam.fingerprints import Fingerprints
from radioslam.merging import MergedTracks
from radioslam.pose_graph import Edges, PoseGraph, Priors, diagonal_information
from radioslam.walk import RadioScans, Reference, Signal, Walk


def scans_of(*readings: tuple[float, str, float] | tuple[float, str, float, float]) -> RadioScans:
    """Scans from (time, identity, RSS[, last seen]) rows."""
    time_s, identity, rss = ([row[k] for row in readings] for k in range(3))
    seen = [row[3] if len(row) > 3 else np.nan for row in readings]
    return RadioScans.from_readings(time_s, identity, rss, last_seen_s=seen)


def scans_at(times_s: Sequence[float]) -> RadioScans:
    """One reading of one access point at each time, never twice the same."""
    return scans_of(*((float(t), "ap", -40.0 - k % 20) for k, t in enumerate(times_s)))


def tracked_walk(
    poses: Any,
    times_s: Any = None,
    name: str = "walk",
    scans: RadioScans | None = None,
    reference: Reference | None = None,
) -> Walk:
    """A walk with given odometry poses (n, 3), a second apart, and a scan at each."""
    poses = np.asarray(poses, dtype=float)
    times_s = np.arange(float(len(poses))) if times_s is None else np.asarray(times_s, dtype=float)
    return Walk(name, scans or scans_at(times_s), odometry=Signal(times_s, poses), reference=reference)


def fingerprints_at(distance_m: Any, walk: Any = None, poses: Any = None, rss_dbm: Any = None) -> Fingerprints:
    """Fingerprints so many metres along their walks; without poses the walks are straight."""
    distance = np.asarray(distance_m, dtype=float)
    n = len(distance)
    walks = np.zeros(n, np.int64) if walk is None else np.asarray(walk, dtype=np.int64)
    scan = np.arange(n) - np.searchsorted(walks, walks)
    straight = np.column_stack([distance, np.zeros((n, 2))])
    return Fingerprints(
        walk=walks,
        scan=scan,
        time_s=scan.astype(float),
        poses=straight if poses is None else np.asarray(poses, dtype=float),
        distance_m=distance,
        rss_dbm=sparse.csr_array(np.full((n, 1), -50.0) if rss_dbm is None else np.asarray(rss_dbm, dtype=float)),
        transmitters=("ap",),
    )


def merged_at(poses: Any, walk: Any, frame: Any) -> MergedTracks:
    """Merged tracks with a node per fingerprint, standing at the given poses."""
    poses = np.asarray(poses, dtype=float)
    nodes = np.arange(len(poses))
    return MergedTracks(
        tracks=(),
        walk=np.asarray(walk, dtype=np.int64),
        time_s=nodes.astype(float),
        poses=poses,
        fingerprint=nodes,
        frame=np.asarray(frame, dtype=np.int64),
        links=Edges.none(),
        priors=Priors.none(),
    )


def random_information(rng: np.random.Generator, count: int) -> Any:
    """Well-conditioned symmetric positive definite matrices (count, 3, 3)."""
    roots = rng.normal(size=(count, 3, 3))
    return roots @ roots.transpose(0, 2, 1) + np.eye(3)


def edges_between(rng: np.random.Generator, poses: Any, i: Any, j: Any, noise: float) -> Edges:
    """Edges that measure the motion between poses, with noise (m and rad) and full information matrices."""
    i, j = np.asarray(i, dtype=np.int64), np.asarray(j, dtype=np.int64)
    measurement = planar.between(poses[i], poses[j]) + noise * rng.normal(size=(len(i), 3))
    return Edges(i, j, measurement, random_information(rng, len(i)))


def random_graph(rng: np.random.Generator, nodes: int = 30, loops: int = 15, noise: float = 0.05) -> PoseGraph:
    """A winding walk of metre steps with loops between nodes anywhere, held at its first pose."""
    steps = np.column_stack([np.ones(nodes), np.zeros(nodes), rng.normal(0, 0.4, nodes)])
    truth = chain(steps[:-1])
    i, j = np.array([(a, b) for a in range(nodes) for b in range(a + 2, nodes)]).T
    chosen = rng.choice(len(i), loops, replace=False)
    odometry = edges_between(rng, truth, np.arange(nodes - 1), np.arange(1, nodes), noise)
    return PoseGraph(
        chain(odometry.measurement),
        odometry,
        loops=edges_between(rng, truth, i[chosen], j[chosen], noise),
        priors=Priors(np.array([0]), truth[:1], diagonal_information(0.1, 0.1, 0.1)),
    )


def grid_walk(rng: np.random.Generator, wrong: float = 0.0) -> tuple[Any, PoseGraph]:
    """True poses (n, 3) of a walk through the streets of a 6 by 6 grid, and a graph of it.

    Steps of 1 m with 2 cm and 0.01 rad of noise; loops say only "the same place" (σ = 0.5 m, no heading), and the
    share ``wrong`` of them is added between any two nodes.
    """
    corner, heading, corners = np.array([0.0, 0.0]), 0.0, []
    for _ in range(60):
        turns = [heading + turn for turn in (0.0, pi / 2, -pi / 2)]
        turns = [t for t in turns if np.all(np.abs(corner + 5 * np.array([cos(t), sin(t)]) - 12.5) < 13)]
        heading = float(rng.choice(turns)) if turns else heading + pi
        corners.append((corner, heading))
        corner = np.round(corner + 5 * np.array([cos(heading), sin(heading)]))
    truth = np.array([[*(c + k * np.array([cos(h), sin(h)])), h] for c, h in corners for k in range(5)])
    n = len(truth)
    steps = planar.between(truth[:-1], truth[1:]) + rng.normal(size=(n - 1, 3)) * [0.02, 0.02, 0.01]
    apart = np.hypot(*(truth[:, None, :2] - truth[None, :, :2]).transpose(2, 0, 1))
    far = np.arange(n)[None, :] - np.arange(n)[:, None] > 10
    i, j = np.nonzero(far & (apart < 0.5))
    chosen = rng.choice(len(i), min(len(i), n), replace=False)
    i, j = i[chosen], j[chosen]
    if wrong:
        a, b = np.nonzero(far & (apart > 5))
        chosen = rng.choice(len(a), round(wrong * len(i)), replace=False)
        i, j = np.append(i, a[chosen]), np.append(j, b[chosen])
    return truth, PoseGraph(
        chain(steps, truth[0]),
        Edges(np.arange(n - 1), np.arange(1, n), steps, np.tile(diagonal_information(0.02, 0.02, 0.01), (n - 1, 1, 1))),
        loops=Edges(i, j, np.zeros((len(i), 3)), np.tile(diagonal_information(0.5, 0.5, 1000**0.5), (len(i), 1, 1))),
        priors=Priors(np.array([0]), truth[:1], diagonal_information(0.01, 0.01, 0.01)),
    )


def chain(steps: Any, start: Any = (0.0, 0.0, 0.0)) -> Any:
    """Poses (n + 1, 3) reached by n motions one after the other."""
    poses = [np.asarray(start, dtype=float)]
    for step in steps:
        poses.append(planar.compose(poses[-1], step))
    return np.array(poses)


def numeric_jacobian(function: Callable[[Any], Any], x: Any, step: float = 1e-6) -> Any:
    """Central differences (…, n) of a function of x (n,)."""
    columns = [(function(x + h) - function(x - h)) / (2 * step) for h in step * np.eye(len(x))]
    return np.stack(columns, axis=-1)


# GTSAM as an independent judge of the optimizer ---------------------------------------------------------------------


def gtsam_values(poses: Any) -> Any:
    """Poses (n, 3) as gtsam.Values."""
    import gtsam

    values = gtsam.Values()
    for k, pose in enumerate(poses):
        values.insert(k, gtsam.Pose2(*pose))
    return values


def gtsam_poses(values: Any) -> Any:
    """gtsam.Values as poses (n, 3)."""
    poses = [values.atPose2(k) for k in range(values.size())]
    return np.array([[pose.x(), pose.y(), pose.theta()] for pose in poses])


def gtsam_graph(graph: PoseGraph, log_map: bool) -> Any:
    """The graph in GTSAM: with its own log-map edges, or with edges of the same residual as ours (in Python, slow)."""
    import gtsam

    information = gtsam.noiseModel.Gaussian.Information
    factors = gtsam.NonlinearFactorGraph()
    edges = Edges.concatenate([graph.odometry, graph.links, graph.loops])
    for i, j, z, omega in zip(edges.i, edges.j, edges.measurement, edges.information, strict=True):
        if log_map:
            factors.add(gtsam.BetweenFactorPose2(int(i), int(j), gtsam.Pose2(*z), information(omega)))
        else:
            factors.add(gtsam.CustomFactor(information(omega), [int(i), int(j)], _residual_of_g2o(z)))
    for node, z, omega in zip(graph.priors.node, graph.priors.measurement, graph.priors.information, strict=True):
        factors.add(gtsam.PriorFactorPose2(int(node), gtsam.Pose2(*z), information(omega)))
    return factors


def gtsam_optimum(factors: Any, initial: Any) -> Any:
    """Poses (n, 3) where GTSAM's Levenberg-Marquardt ends."""
    import gtsam

    settings = gtsam.LevenbergMarquardtParams()
    settings.setMaxIterations(200)
    settings.setRelativeErrorTol(1e-13)
    settings.setAbsoluteErrorTol(1e-13)
    return gtsam_poses(gtsam.LevenbergMarquardtOptimizer(factors, gtsam_values(initial), settings).optimize())


def _residual_of_g2o(z: Any) -> Callable[[Any, Any, Any], Any]:
    """An error function for gtsam.CustomFactor; tangents of GTSAM lie in each pose's own frame."""
    zx, zy, zt = (float(v) for v in z)
    cz, sz = cos(zt), sin(zt)

    def error(factor: Any, values: Any, jacobians: Any) -> Any:
        a, b = (values.atPose2(key) for key in factor.keys())  # noqa: SIM118
        dx, dy, turn = b.x() - a.x(), b.y() - a.y(), b.theta() - a.theta() - zt
        c, s = cos(a.theta() + zt), sin(a.theta() + zt)
        if jacobians is not None:
            cb, sb = cos(turn), sin(turn)
            jacobians[0] = np.array([[-cz, -sz, c * dy - s * dx], [sz, -cz, -c * dx - s * dy], [0, 0, -1.0]], order="F")
            jacobians[1] = np.array([[cb, -sb, 0], [sb, cb, 0], [0, 0, 1.0]], order="F")
        shift = [c * dx + s * dy - cz * zx - sz * zy, c * dy - s * dx + sz * zx - cz * zy]
        return np.array([*shift, (turn + pi) % (2 * pi) - pi])

    return error
