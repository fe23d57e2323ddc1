import numpy as np
import pytest

from radioslam import rigid
from radioslam.planar import wrap
from radioslam.point_cloud import find_recordings
from radioslam.point_cloud.clouds import read_cloud
from radioslam.simulator import SCENARIOS, TrackerDrift, simulate
from radioslam.simulator.cloud_frames import true_poses, write_clouds
from radioslam.simulator.depth_camera import DepthCamera
from radioslam.simulator.furnishing import WAY_CLEARANCE_M, Scene, furnish
from radioslam.simulator.ray_casting import depth_of
from radioslam.simulator.tracker import drifted_poses
from radioslam.simulator.walkable import WALL_CLEARANCE_M
from tests.crowds import office_walks
from tests.point_cloud.scenes import CAMERA, box, camera_at, room, view


def test_depths_are_those_of_the_surfaces_they_claim():
    """Every noiseless point lies on a rectangle of the scene."""
    T = camera_at(2.0, 2.5, 0.7)
    points = rigid.transform(T, view(T, None))
    scene = room()
    gaps = []
    for x0, y0, x1, y1, low, high in scene.upright:
        along = np.array([x1 - x0, y1 - y0])
        share = np.clip((points[:, :2] - [x0, y0]) @ along / (along @ along), 0, 1)
        flat = np.linalg.norm(points[:, :2] - [x0, y0] - share[:, None] * along, axis=1)
        gaps.append(np.hypot(flat, np.maximum(0, np.maximum(low - points[:, 2], points[:, 2] - high))))
    for west, south, east, north, z in scene.level:
        inside = (points[:, 0] >= west - 1e-9) & (points[:, 0] <= east + 1e-9)
        inside &= (points[:, 1] >= south - 1e-9) & (points[:, 1] <= north + 1e-9)
        gaps.append(np.where(inside, np.abs(points[:, 2] - z), np.inf))
    assert np.min(gaps, axis=0).max() < 1e-9
    assert len(points) > 5000


def test_the_nearest_surface_hides_what_is_behind():
    (far, _), (near, _) = box(5, -2, 6, 2, 0, 3), box(3, -0.5, 3.5, 0.5, 0, 3)
    scene = Scene(np.concatenate([far, near]), np.zeros((0, 5)))
    T = rigid.from_planar(np.zeros((1, 3)))[0] @ DepthCamera(pitch_rad=0.0).mount()
    depth = depth_of(scene, T, np.array([[0.0, 0, 1], [0.3, 0, 1]]), 9.0)
    np.testing.assert_allclose(depth, [3.0, 5.0])
    assert np.isinf(depth_of(scene, T, np.array([[0.0, 0, 1]]), 2.9)[0])


def test_the_camera_looks_ahead_and_down():
    mount = DepthCamera(pitch_rad=0.2).mount()
    np.testing.assert_allclose(mount[:3, :3] @ [0, 0, 1], [np.cos(0.2), 0, -np.sin(0.2)])
    np.testing.assert_allclose(mount[:3, :3] @ [1, 0, 0], [0, -1, 0])
    assert np.linalg.det(mount[:3, :3]) == pytest.approx(1.0)


def test_noise_grows_with_the_square_of_the_depth_and_gaps_stay_gaps():
    camera, rng = DepthCamera(), np.random.default_rng(0)
    for z in (1.0, 4.0):
        measured = camera.measure(np.full(20_000, z), rng)
        assert measured.mean() == pytest.approx(z, abs=1e-3)
        assert measured.std() == pytest.approx(camera.noise_m + camera.noise_per_m * z * z, rel=0.05)
    assert camera.measure(np.array([np.inf]), rng)[0] == 0.0


def test_true_poses_are_those_of_a_tracker_without_drift():
    walk = office_walks()[0]
    truth = true_poses(walk.reference.positions_xy)
    seen = drifted_poses(walk.reference.positions_xy, TrackerDrift(0, 0, 0), np.random.default_rng(0))
    np.testing.assert_allclose(wrap(truth[:, 2] - seen[:, 2]), 0.0, atol=1e-9)
    np.testing.assert_allclose(truth[:, :2] - truth[0, :2], seen[:, :2], atol=1e-9)


def test_nobody_walks_through_furniture():
    building = SCENARIOS["office"].make_building()
    walks = office_walks()
    paths = np.concatenate([walk.reference.positions_xy for walk in walks])
    scene = furnish(building, paths, 1)
    own = len(building.walls) + len(building.doors)
    assert len(scene.upright) > own + 200
    for x0, y0, x1, y1, *_ in scene.upright[own:]:
        along = np.array([x1 - x0, y1 - y0])
        share = np.clip((paths - [x0, y0]) @ along / max(along @ along, 1e-12), 0, 1)
        assert np.linalg.norm(paths - [x0, y0] - share[:, None] * along, axis=1).min() > 0.0
    assert WAY_CLEARANCE_M > 0.5
    assert WALL_CLEARANCE_M > 0.4


def test_one_seed_gives_one_scene():
    building, paths = SCENARIOS["office"].make_building(), np.array([[1.0, 6.0]])
    a, b, c = (furnish(building, paths, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.upright, b.upright)
    assert a.upright.shape != c.upright.shape


def test_frames_of_a_walk_are_read_back_where_they_were_taken(tmp_path):
    from radioslam.formats import write_walk

    (walk,) = simulate("office", seed=3, walks=1)
    scene = furnish(SCENARIOS["office"].make_building(), walk.reference.positions_xy, 3)
    folder = write_walk(walk, tmp_path)
    write_clouds(walk, scene, folder, np.random.default_rng(0), CAMERA)
    (recording,) = find_recordings([tmp_path])
    assert len(recording.clouds) == len(walk.reference)
    np.testing.assert_allclose(recording.cloud_s, walk.reference.time_s)
    k = 30
    T = rigid.from_planar(true_poses(walk.reference.positions_xy))[k] @ recording.T_body_sensor
    points = rigid.transform(T, read_cloud(recording.clouds[k]))
    assert points[:, 2].min() > -0.15
    assert points[:, 2].max() < SCENARIOS["office"].make_building().storey_height_m + 0.15
