"""Odometry that clouds correct: a scanner on a circle in the furnished room, and along a bare corridor."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud import Recording
from radioslam.point_cloud.cloud_odometry import follow_clouds, fuse, local_limits
from radioslam.point_cloud.local_map import LocalMap
from radioslam.point_cloud.odometry_edges import joined_steps
from radioslam.point_cloud.pcd import write_pcd
from radioslam.simulator.furnishing import Scene
from radioslam.simulator.lidar import Lidar
from tests.point_cloud.scenes import box, room
from tests.point_cloud.test_reference import circle, drifted

CONFIG = load_config("lidar", environment={}, overrides=["reference.key_frame_m=0.3"])
SCANNER = Lidar(columns=128, lowest_rad=-0.4, highest_rad=0.4)
CORRIDOR = Scene(*box(-40, -1, 40, 1, 0, 2.8))


def record(folder, poses, scene) -> Recording:
    """Turns of the scanner at planar poses (n, 3), with odometry that drifts."""
    rng, T = np.random.default_rng(1), rigid.from_planar(poses)
    clouds = tuple(folder / f"{k:03d}.pcd" for k in range(len(poses)))
    for path, sensor in zip(clouds, T @ SCANNER.mount(), strict=True):
        write_pcd(path, SCANNER.turn(scene, sensor, rng))
    times = np.arange(float(len(poses)))
    return Recording("walk", times, T[0] @ drifted(T, scale=1.05), clouds, times, SCANNER.mount())


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    truth = rigid.from_planar(circle(30))
    recording = record(tmp_path_factory.mktemp("turning"), circle(30), room())
    return truth, recording, follow_clouds(recording, CONFIG, planar=True)


def test_followed_clouds_leave_little_of_the_drift(turning):
    truth, recording, followed = turning
    before_m, before_rad = rigid.apart(recording.T_odom_body, truth)
    after_m, after_rad = rigid.apart(followed.body_at_clouds(), truth)
    assert before_rad[-1] > 0.5
    assert after_rad.max() < 0.01
    assert before_m.max() > 0.2
    assert after_m.max() < 0.03
    assert followed.steps.registered.tolist() == [False] + 29 * [True]
    assert followed.is_planar


def test_steps_err_as_their_covariances_say(turning):
    truth, _, followed = turning
    T, pairs = followed.body_at_clouds(), [(k, k + lag) for lag in (1, 10) for k in range(0, 30 - lag, 3)]
    squares = []
    for i, j in pairs:
        error = rigid.to_vector(rigid.inverse(rigid.inverse(truth[i]) @ truth[j]) @ rigid.inverse(T[i]) @ T[j])
        covariance = joined_steps(T, followed.steps.covariance, i, j)
        squares.append(error[2:5] @ np.linalg.solve(covariance[2:5, 2:5], error[2:5]))
    assert np.mean(squares) < 5.0  # three degrees of freedom
    assert np.max(squares) < 22.0


def test_poses_stand_at_the_times_of_clouds_and_of_odometry(turning):
    _, recording, followed = turning
    late = replace(recording, cloud_s=recording.cloud_s[:-1] + 0.5, clouds=recording.clouds[:-1])
    found = follow_clouds(late, CONFIG, planar=True)
    np.testing.assert_array_equal(found.time_s, np.arange(0.0, 29.1, 0.5))
    assert len(found.steps.covariance) == 29
    np.testing.assert_array_equal(followed.time_s, recording.time_s)


def test_space_finds_what_the_plane_finds(turning):
    truth, recording, _ = turning
    found = follow_clouds(recording, CONFIG, planar=False).body_at_clouds()
    metres, radians = rigid.apart(found, truth)
    assert metres.max() < 0.04
    assert radians.max() < 0.02
    np.testing.assert_allclose(found[:, :3, :3] @ np.swapaxes(found[:, :3, :3], 1, 2), 30 * [np.eye(3)], atol=1e-12)


def test_without_surfaces_odometry_stands(tmp_path):
    recording = record(tmp_path, circle(30)[:6], room())
    for path in recording.clouds[2:]:
        write_pcd(path, np.zeros((0, 3)))
    found = follow_clouds(recording, CONFIG, planar=True)
    assert found.steps.registered.tolist() == [False, True, False, False, False, False]
    steps, raw = (rigid.inverse(T[:-1]) @ T[1:] for T in (found.body_at_clouds(), recording.T_odom_body))
    np.testing.assert_allclose(steps[1:], raw[1:], atol=1e-9)
    assert np.all(found.steps.covariance[2:, 3, 3] > found.steps.covariance[1, 3, 3])


def test_a_cloud_that_contradicts_odometry_is_not_believed(tmp_path):
    recording = record(tmp_path, circle(30)[:4], room())
    elsewhere = circle(30)[3] + [0.0, 0.0, 0.6]
    turn = SCANNER.turn(room(), rigid.from_planar(elsewhere[None])[0] @ SCANNER.mount(), np.random.default_rng(5))
    write_pcd(recording.clouds[3], turn)
    assert follow_clouds(recording, CONFIG, planar=True).steps.registered.tolist() == [False, True, True, False]


def test_along_a_bare_corridor_nothing_is_known_and_odometry_stands(tmp_path):
    """Walls hold heading and the distance to them; along them a registration is worth nothing, and says so."""
    poses = np.column_stack([np.linspace(-3, 3, 13), np.zeros((13, 2))])
    recording = record(tmp_path, poses, CORRIDOR)
    found = rigid.to_planar(follow_clouds(recording, CONFIG, planar=True).body_at_clouds())
    assert found[-1, 0] - found[0, 0] == pytest.approx(6.0 * 1.05, abs=0.05)  # as the odometry has it
    assert np.abs(found[:, 1]).max() < 0.05
    assert np.abs(found[:, 2]).max() < 0.01
    local, rng = LocalMap(CONFIG.reference, local_limits(CONFIG)), np.random.default_rng(0)
    for T in rigid.from_planar(poses[:6]) @ SCANNER.mount():
        local.add(local.frame(SCANNER.turn(CORRIDOR, T, rng)), T)
    T = rigid.from_planar(poses[6:7])[0] @ SCANNER.mount()
    _, covariance = local.measure(local.frame(SCANNER.turn(CORRIDOR, T, rng)), T)
    assert covariance[3, 3] > 1.0
    assert covariance[4, 4] < 0.02**2


def test_the_local_map_ends_behind():
    limits = local_limits(CONFIG)
    local = LocalMap(CONFIG.reference.model_copy(update={"local_map_m": 2.0, "key_frame_m": 0.5}), limits)
    rng = np.random.default_rng(0)
    for x in np.arange(0.0, 5.0, 0.3):
        T = rigid.from_planar(np.array([[x, 0.0, 0.0]]))[0]
        local.add(local.frame(SCANNER.turn(CORRIDOR, T @ SCANNER.mount(), rng)), T)
    held = [float(T[0, 3]) for T, _ in local.frames]
    assert held == pytest.approx([3.0, 3.6, 4.2, 4.8])


covariances = st.integers(0, 10_000).map(
    lambda seed: (lambda A: A @ A.T + 1e-3 * np.eye(6))(0.1 * np.random.default_rng(seed).standard_normal((6, 6)))
)


@settings(deadline=None)
@given(covariances, covariances)
def test_fusing_adds_information(P, R):
    Z = rigid.from_vector(np.array([0.01, -0.02, 0.03, 0.1, 0.2, -0.1]))
    T, joined = fuse(np.eye(4), P, Z, R)
    np.testing.assert_allclose(np.linalg.inv(joined), np.linalg.inv(P) + np.linalg.inv(R), rtol=1e-5, atol=1e-6)
    expected = joined @ np.linalg.solve(R, rigid.to_vector(Z))
    np.testing.assert_allclose(rigid.to_vector(T), expected, atol=1e-9)
