from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from radioslam import rigid
from radioslam.config import load_config
from radioslam.g2o import read_g2o, write_g2o
from radioslam.point_cloud.graph_solvers import planar_graph, solve
from radioslam.point_cloud.spatial_graph import SpatialEdges, SpatialGraph, moved, write_spatial_g2o
from tests.point_cloud.scenes import random_motion

CONFIG = load_config(environment={}).reference
NOT_MEASURED = np.array([False])
COVARIANCE = np.diag([0.01, 0.01, 0.01, 0.05, 0.05, 0.05]) ** 2


def edges(pairs, T, seed=None, sigma=1.0):
    i, j = np.array(pairs, dtype=np.int64).T
    z = rigid.inverse(T[i]) @ T[j]
    if seed is not None:
        noise = sigma * np.random.default_rng(seed).standard_normal((len(i), 6)) * np.sqrt(np.diag(COVARIANCE))
        z = z @ rigid.motion(Rotation.from_rotvec(noise[:, :3]).as_matrix(), noise[:, 3:])
    return SpatialEdges(i, j, z, np.tile(COVARIANCE, (len(i), 1, 1)))


def ring(planar, count=24):
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    T = rigid.from_planar(np.column_stack([5 * np.cos(angle), 5 * np.sin(angle), angle + np.pi / 2]))
    if planar:
        return T
    T[:, 2, 3] = np.sin(angle)
    return random_motion(1) @ T @ random_motion(2, 0.0)


def drifting(T, planar):
    chain = edges([(k, k + 1) for k in range(len(T) - 1)], T, seed=3)
    if planar:
        chain = SpatialEdges(chain.i, chain.j, rigid.from_planar(rigid.to_planar(chain.T_i_j)), chain.covariance)
    poses = [T[0]]
    for step in chain.T_i_j:
        poses.append(poses[-1] @ step)
    return np.array(poses), chain


def error(T, truth):
    return np.linalg.norm(T[:, :3, 3] - truth[:, :3, 3], axis=1).mean()


@pytest.mark.parametrize("planar", [True, False])
def test_a_loop_takes_the_drift_away_and_wrong_loops_do_not_bring_it_back(planar):
    if not planar:
        pytest.importorskip("gtsam")
    truth = ring(planar)
    poses, chain = drifting(truth, planar)
    n = len(truth)
    pairs = [(0, n - 1), (1, n - 2), (2, n - 3), (0, n - 2), (5, 17), (3, 12)]
    good = edges(pairs, truth, seed=4, sigma=0.2)
    wrong = edges([(4, 20), (8, 15)], truth)
    shift = rigid.from_planar(np.array([[3.0, -2.0, 0.5], [-2.0, 2.0, -0.7]]))
    loops = SpatialEdges(
        np.append(good.i, wrong.i),
        np.append(good.j, wrong.j),
        np.concatenate([good.T_i_j, wrong.T_i_j @ shift]),
        np.tile(COVARIANCE, (len(pairs) + 2, 1, 1)),
    )
    solved, converged = solve(
        SpatialGraph(poses, chain, loops, np.array([0]), np.zeros(len(poses), np.int64), NOT_MEASURED), planar, CONFIG
    )
    assert converged
    assert error(poses, truth) > 0.15
    assert error(solved.T_map_body, truth) < 0.5 * error(poses, truth)
    np.testing.assert_allclose(solved.T_map_body[0], truth[0], atol=1e-3)


def test_space_and_plane_agree_on_a_plane():
    pytest.importorskip("gtsam")
    truth = ring(True)
    poses, chain = drifting(truth, True)
    loop = edges([(0, len(truth) - 1)], truth)
    graph = SpatialGraph(poses, chain, loop, np.array([0]), np.zeros(len(poses), np.int64), ~NOT_MEASURED)
    flat, space = (solve(graph, planar, CONFIG)[0].T_map_body for planar in (True, False))
    np.testing.assert_allclose(flat, space, atol=5e-3)


def test_the_scale_of_the_odometry_is_found_where_loops_tell_it():
    truth = ring(True)
    chain = edges([(k, k + 1) for k in range(len(truth) - 1)], truth)
    chain.T_i_j[:, :3, 3] *= 1.03
    known = edges([(0, k) for k in range(2, 12)], truth)
    graph = SpatialGraph(truth, chain, known, np.array([0]), np.zeros(len(truth), np.int64), NOT_MEASURED)
    free, fixed = (solve(replace(graph, measured=m), True, CONFIG)[0] for m in (NOT_MEASURED, ~NOT_MEASURED))
    assert error(free.T_map_body, truth) < 0.5 * error(fixed.T_map_body, truth)


def test_the_covariance_of_a_mounted_frame_is_that_of_moved_samples():
    mount, covariance = random_motion(5), np.diag([1, 2, 3, 4, 5, 6.0]) * 1e-6
    small = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, 20_000)
    motions = rigid.motion(Rotation.from_rotvec(small[:, :3]).as_matrix(), small[:, 3:])
    seen = mount @ motions @ rigid.inverse(mount)
    samples = np.column_stack([Rotation.from_matrix(seen[:, :3, :3]).as_rotvec(), seen[:, :3, 3]])
    expected = moved(covariance, mount)
    np.testing.assert_allclose(np.cov(samples.T), expected, atol=0.03 * np.abs(expected).max())


def test_planar_g2o_is_read_by_this_package(tmp_path):
    truth = ring(True)
    poses, chain = drifting(truth, True)
    graph = SpatialGraph(
        poses, chain, edges([(0, 23), (3, 9)], truth), np.array([0]), np.zeros(len(poses), np.int64), NOT_MEASURED
    )
    write_g2o(planar_graph(graph), tmp_path / "graph.g2o")
    read = read_g2o((tmp_path / "graph.g2o").read_text())
    np.testing.assert_allclose(read.poses, rigid.to_planar(poses), atol=1e-12)
    assert len(read.loops) == 2


def test_spatial_g2o_is_what_gtsam_reads(tmp_path):
    gtsam = pytest.importorskip("gtsam")
    truth = ring(False)
    poses, chain = drifting(truth, False)
    graph = SpatialGraph(
        poses, chain, edges([(0, 23)], truth), np.array([0]), np.zeros(len(poses), np.int64), NOT_MEASURED
    )
    write_spatial_g2o(graph, tmp_path / "graph.g2o")
    factors, values = gtsam.readG2o(str(tmp_path / "graph.g2o"), True)
    read = np.array([values.atPose3(k).matrix() for k in range(len(poses))])
    np.testing.assert_allclose(read, poses, atol=1e-9)
    factor = factors.at(0)
    np.testing.assert_allclose(factor.measured().matrix(), chain.T_i_j[0], atol=1e-9)
    assert "FIX 0" in (tmp_path / "graph.g2o").read_text()
