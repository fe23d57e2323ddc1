from dataclasses import replace

import numpy as np
import pytest

from radioslam import rigid
from radioslam.formats import write_walk
from radioslam.point_cloud import find_recordings
from radioslam.point_cloud.clouds import read_cloud
from radioslam.simulator import SCENARIOS, simulate
from radioslam.simulator.cloud_frames import true_poses, write_clouds
from radioslam.simulator.furnishing import Scene, furnish
from radioslam.simulator.lidar import Lidar
from radioslam.simulator.ray_casting import depth_of, within_sector
from tests.point_cloud.scenes import box, room

FEW = Lidar(columns=64, sectors=8)


def upright_at(x, y, heading_rad):
    return rigid.from_planar(np.array([[x, y, heading_rad]]))[0] @ FEW.mount()


@pytest.mark.parametrize("heading_rad", [0.0, 0.7, 3.0])
def test_sectors_change_nothing(heading_rad):
    """What each sector sees is what the whole scene shows along its rays."""
    T, rays = upright_at(2.0, 2.5, heading_rad), FEW.rays().reshape(-1, 3)
    range_m = depth_of(room(), T, rays, FEW.range_m)
    near = np.isfinite(range_m)
    points = replace(FEW, noise_m=0.0).turn(room(), T, np.random.default_rng(0))
    np.testing.assert_allclose(points, rays[near] * range_m[near, None])
    assert near.mean() > 0.9


def test_a_sector_drops_what_lies_beside_it():
    (ahead, on_it), (behind, below) = box(3, -1, 4, 1, 0, 2), box(-4, -1, -3, 1, 0, 2)
    scene = Scene(np.concatenate([ahead, behind]), np.concatenate([on_it, below]))
    kept = within_sector(scene, np.eye(4), np.array([1.0, -0.1, 0.0]), np.array([1.0, 0.1, 0.0]))
    np.testing.assert_array_equal(kept.upright[:, 0] > 0, True)
    np.testing.assert_array_equal(kept.level, on_it)
    assert len(kept.upright) == 2  # its sides lie beside the sector


def test_ranges_are_noisy_along_the_ray_and_end_at_the_range():
    wall = Scene(np.array([[5.0, -1000.0, 5.0, 1000.0, -1000.0, 1000.0]]), np.zeros((0, 5)))
    scanner = Lidar(columns=2048)
    points = scanner.turn(wall, np.eye(4), np.random.default_rng(0))
    range_m = np.linalg.norm(points, axis=1)
    error = range_m - 5.0 / (points[:, 0] / range_m)
    assert error.std() == pytest.approx(scanner.noise_m, rel=0.05)
    assert abs(error.mean()) < 1e-3
    assert range_m.max() < scanner.range_m + 0.1
    assert points[:, 0].min() > 4.8


def test_turns_of_a_walk_are_read_back_where_they_were_taken(tmp_path):
    (walk,) = simulate("office", seed=3, walks=1)
    building = SCENARIOS["office"].make_building()
    scene = furnish(building, walk.reference.positions_xy, 3)
    folder = write_walk(walk, tmp_path)
    write_clouds(walk, scene, folder, np.random.default_rng(0), FEW)
    (recording,) = find_recordings([tmp_path])
    np.testing.assert_allclose(recording.cloud_s, walk.reference.time_s)
    T = rigid.from_planar(true_poses(walk.reference.positions_xy))[30] @ recording.T_body_sensor
    points = rigid.transform(T, read_cloud(recording.clouds[30]))
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.1)
    assert points[:, 2].max() < building.storey_height_m + 0.1
