import numpy as np
import pytest
from PIL import Image

from radioslam.errors import LogError
from radioslam.point_cloud import depth
from radioslam.point_cloud.clouds import read_cloud

K = np.array([[100.0, 0, 2], [0, 50.0, 1], [0, 0, 1]])


def folder_with(tmp_path, metres, intrinsics=K):
    path = tmp_path / "frame-000001.depth.png"
    depth.write_depth(path, metres)
    if intrinsics is not None:
        np.savetxt(tmp_path / depth.INTRINSICS_NAME, intrinsics)
    return path


def test_pixels_become_points_and_those_without_reading_none(tmp_path):
    metres = np.zeros((3, 5))
    metres[1, 2], metres[0, 4], metres[2, 0] = 2.0, 1.5, 65.535
    points = read_cloud(folder_with(tmp_path, metres))
    np.testing.assert_allclose(points[np.argsort(points[:, 2])][:2], [[0.03, -0.03, 1.5], [0.0, 0.0, 2.0]])
    assert len(depth.back_project(np.array([[0, 65535]], np.uint16), K)) == 0


def test_an_image_comes_back_as_it_was_written(tmp_path):
    metres = np.round(np.random.default_rng(0).uniform(0, 9, (4, 6)), 3)
    np.testing.assert_array_equal(depth.read_depth(folder_with(tmp_path, metres)), np.round(metres * 1000))


def test_missing_intrinsics_are_told(tmp_path):
    path = folder_with(tmp_path, np.ones((3, 3)), None)
    with pytest.raises(LogError, match=r"intrinsics\.txt: expected intrinsics of the depth camera, found no such file"):
        read_cloud(path)


@pytest.mark.parametrize("text", ["1 2 3\n", "a b c\n", "1 0 0\n0 nan 0\n0 0 1\n", ""])
@pytest.mark.filterwarnings("ignore:loadtxt")
def test_intrinsics_that_are_none_are_told(tmp_path, text):
    path = folder_with(tmp_path, np.ones((3, 3)), None)
    (tmp_path / depth.INTRINSICS_NAME).write_text(text)
    with pytest.raises(LogError, match="a 3 × 3 matrix"):
        read_cloud(path)


def test_colour_images_and_broken_ones_are_no_depth(tmp_path):
    np.savetxt(tmp_path / depth.INTRINSICS_NAME, K)
    path = tmp_path / "a.depth.png"
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(path)
    with pytest.raises(LogError, match="16 bits per pixel, found one of mode RGB"):
        read_cloud(path)
    path.write_bytes(b"\x89PNG\r\n")
    with pytest.raises(LogError, match="a depth image"):
        read_cloud(path)


def test_poses_are_rigid_or_refused(tmp_path):
    path = tmp_path / "a.pose.txt"
    rough = np.eye(4)
    rough[0, 1] = 1e-4
    np.savetxt(path, rough)
    R = depth.read_pose(path, "a pose")[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    for bad in (2 * np.eye(4), np.diag([-1.0, 1, 1, 1]), np.full((4, 4), -np.inf)):
        np.savetxt(path, bad)
        with pytest.raises(LogError, match="a pose"):
            depth.read_pose(path, "a pose")
