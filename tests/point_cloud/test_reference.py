"""Whole runs: walks through a small furnished room, from frames on disk to reference paths."""

from dataclasses import replace

import numpy as np
import pytest

from radioslam import rigid
from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.point_cloud import Recording, find_recordings, make_reference
from radioslam.point_cloud import reference as page
from radioslam.point_cloud.candidates import alike_by_radio, along_walks, near_in_estimate
from radioslam.point_cloud.depth import DEPTH_ENDING, INTRINSICS_NAME, write_depth
from radioslam.point_cloud.nodes import collect_nodes
from radioslam.point_cloud.reference_folder import summarize
from radioslam.simulator.ray_casting import depth_of
from radioslam.walk import RadioScans, Reference, Signal, Walk
from tests.point_cloud.scenes import CAMERA, room

CONFIG = load_config(environment={})


def circle(count=40, start=0.0):
    """True planar poses of somebody who turns twice on a small circle in the room's middle, looking outwards."""
    angle = start + np.linspace(0, 4 * np.pi, count)
    return np.column_stack([2.0 + 0.45 * np.cos(angle), 2.5 + 0.45 * np.sin(angle), angle])


def drifted(T, turn_rad=0.02, scale=1.08):
    """Odometry that turns too far with each step and takes them too long."""
    steps = rigid.inverse(T[:-1]) @ T[1:] @ rigid.from_planar(np.array([[0.0, 0.0, turn_rad]]))
    steps[:, :3, 3] *= scale
    poses = [np.eye(4)]
    for step in steps:
        poses.append(poses[-1] @ step)
    return np.array(poses)


def record(folder, poses, name="walk", seed=0, walk=None) -> Recording:
    folder = folder / name
    folder.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    T = rigid.from_planar(poses)
    np.savetxt(folder / INTRINSICS_NAME, CAMERA.intrinsics())
    for k, sensor in enumerate(T @ CAMERA.mount()):
        depth = CAMERA.measure(depth_of(room(), sensor, CAMERA.rays(), CAMERA.range_m), rng)
        write_depth(folder / f"{k:03d}{DEPTH_ENDING}", depth.reshape(CAMERA.height, CAMERA.width))
    times = np.arange(float(len(poses)))
    clouds = tuple(sorted(folder.glob(f"*{DEPTH_ENDING}")))
    return Recording(name, times, drifted(T), clouds, times, CAMERA.mount(), walk)


def heard(name, poses, stations):
    """A walk's scans: strengths that fall with the distance to the stations, every second time."""
    rows = [
        (
            float(k),
            f"ap{s}",
            -40.0 - 8.0 * float(np.hypot(*(pose[:2] + 2 * np.array([np.cos(pose[2]), np.sin(pose[2])]) - at))),
        )
        for k, pose in enumerate(poses)
        for s, at in enumerate(stations)
        if k % 2 == 0
    ]
    times = np.arange(float(len(poses)))
    scans = RadioScans.from_readings(*zip(*rows, strict=True))
    poses = rigid.to_planar(drifted(rigid.from_planar(poses)))
    return Walk(name, scans, odometry=Signal(times, poses), reference=Reference(times, poses[:, :2]))


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    recording = record(tmp_path_factory.mktemp("one"), circle())
    return recording, make_reference([recording], CONFIG)


def error(T, poses):
    there = rigid.fit(T[:, :3, 3], rigid.from_planar(poses)[:, :3, 3])
    metres, radians = rigid.apart(there @ T, rigid.from_planar(poses))
    return metres.mean(), radians.mean()


def test_the_reference_path_is_far_better_than_odometry(one):
    recording, result = one
    before, after = error(recording.T_odom_body, circle()), error(result.paths[0], circle())
    assert result.planar
    assert result.converged
    assert before[1] > 0.2
    assert after[0] < 0.03
    assert after[1] < 0.02


def test_loops_of_all_kinds_are_tried_and_counted(one):
    summary = summarize(one[1])
    assert summary["loops"][page.ALONG]["accepted"] > 15
    assert summary["loops"][page.NEAR]["accepted"] > 3
    assert sum(c["tried"] - c["accepted"] for c in summary["loops"].values()) == sum(summary["rejected"].values())
    assert summary["walks"][0]["has_loops"]
    assert summary["walks"][0]["error_m"] is None


def test_space_finds_what_the_plane_finds(one):
    pytest.importorskip("gtsam")
    result = make_reference([one[0]], CONFIG, planar=False)
    assert not result.planar
    assert error(result.paths[0], circle())[0] < 0.03


def test_two_walks_are_tied_by_what_they_heard(tmp_path):
    stations = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [0.0, 5.0], [3.0, 9.0], [9.0, 3.0]])
    paths = {"a": circle(24), "b": circle(24, start=1.0)}
    recordings = [
        record(tmp_path, poses, name, seed, heard(name, poses, stations))
        for seed, (name, poses) in enumerate(paths.items())
    ]
    config = load_config(overrides=["reference.similarity_threshold=0.6"], environment={})
    result = make_reference(recordings, config)
    assert set(result.part.tolist()) == {0}
    both = np.concatenate(result.paths), np.concatenate(list(paths.values()))
    assert error(*both)[0] < 0.05
    assert summarize(result)["loops"][page.RADIO]["accepted"] >= 3


def test_walks_that_heard_nothing_alike_stay_apart(tmp_path):
    recordings = [record(tmp_path, circle(8)[:6], name, seed) for seed, name in enumerate("ab")]
    result = make_reference(recordings, CONFIG)
    assert set(result.part.tolist()) == {0, 1}
    assert summarize(result)["parts"] == 2


def test_candidates_keep_to_the_rules(one):
    recording, result = one
    nodes, settings = result.nodes, CONFIG.reference
    pairs = along_walks(nodes, 2)
    assert set((pairs[:, 1] - pairs[:, 0]).tolist()) == {1, 2}
    found = near_in_estimate(nodes, result.graph.T_map_body, result.part, 1.5, set(), settings)
    i, j = found.T
    assert np.all(np.abs(nodes.distance_m[i] - nodes.distance_m[j]) >= settings.least_walked_m)
    sensor = result.graph.T_map_body @ nodes.T_body_sensor
    assert np.all(rigid.apart(sensor[i], sensor[j])[1] <= settings.max_turn_rad)
    again = near_in_estimate(
        nodes, result.graph.T_map_body, result.part, 1.5, set(map(tuple, found.tolist())), settings
    )
    assert not set(map(tuple, found.tolist())) & set(map(tuple, again.tolist()))
    apart = np.arange(len(nodes))
    assert len(near_in_estimate(nodes, result.graph.T_map_body, apart, 1.5, set(), settings)) == 0
    assert len(alike_by_radio(nodes, [recording], CONFIG)) == 0


def test_a_flat_cloud_is_left_out_and_told(tmp_path):
    recording = record(tmp_path, circle(12)[:6])
    blank = np.zeros((CAMERA.height, CAMERA.width))
    write_depth(recording.clouds[2], blank)
    write_depth(recording.clouds[3], blank + 2.0)
    nodes = collect_nodes([recording], CONFIG.registration, CONFIG.reference, 1.0, lambda *_: None)
    assert nodes.time_s.tolist() == [0.0, 1.0, 4.0, 5.0]
    assert "an empty cloud" in nodes.skipped[0]
    assert "all of them on a plane" in nodes.skipped[1]


def test_nothing_that_can_be_registered_is_one_error(tmp_path):
    recording = record(tmp_path, circle(12)[:3])
    for path in recording.clouds:
        write_depth(path, np.zeros((CAMERA.height, CAMERA.width)))
    with pytest.raises(MappingError, match=r"expected two clouds or more that can be registered, found 0; .*empty"):
        make_reference([recording], CONFIG)


def test_millimetres_are_warned_of_before_they_fail(tmp_path):
    recording = record(tmp_path, circle(12)[:3])
    with pytest.raises(MappingError, match="as if in millimetres; try --unit"):
        make_reference([recording], CONFIG, metres_per_unit=1000.0)


def test_a_path_without_nodes_is_its_odometry(one):
    recording, result = one
    alone = page.corrected_path(recording, recording, result.nodes, result.graph.T_map_body, walk=7)
    np.testing.assert_allclose(alone, recording.T_odom_body, atol=1e-12)


@pytest.mark.real_data
@pytest.mark.slow
def test_real_frames_agree_with_their_poses(data_folder):
    pytest.importorskip("gtsam")
    (recording,) = find_recordings([data_folder / "depth-frames"])
    few = replace(recording, clouds=recording.clouds[:12], cloud_s=recording.cloud_s[:12])
    result = make_reference([few], CONFIG)
    at = [int(np.argmin(np.abs(recording.time_s - t))) for t in few.cloud_s]
    moved = rigid.fit(result.paths[0][at][:, :3, 3], recording.T_odom_body[at][:, :3, 3])
    metres, _ = rigid.apart(moved @ result.paths[0][at], recording.T_odom_body[at])
    assert metres.mean() < 0.05
