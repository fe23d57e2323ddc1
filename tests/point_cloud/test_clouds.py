import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.point_cloud.clouds import check_cloud, read_cloud, unit_warning

POINTS = np.random.default_rng(0).uniform(-2, 2, (500, 3)).astype(np.float32)


def write_ply(path, points, form="ascii"):
    head = f"ply\nformat {form} 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    order = ">f4" if form == "binary_big_endian" else "<f4"
    rows = "".join(" ".join(f"{v:.9g}" for v in p) + "\n" for p in points).encode()
    path.write_bytes(head.encode() + (rows if form == "ascii" else points.astype(order).tobytes()))
    return path


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_is_read_in_all_its_forms(tmp_path, form):
    np.testing.assert_allclose(read_cloud(write_ply(tmp_path / "a.ply", POINTS, form)), POINTS, rtol=1e-6)


@pytest.mark.parametrize("text", ["", "ply\n", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", "solid x\n"])
def test_broken_ply_is_one_clear_error(tmp_path, text):
    path = tmp_path / "a.ply"
    path.write_text(text)
    with pytest.raises(LogError, match=r"expected a PLY file with vertices x, y, z"):
        read_cloud(path)


def test_a_ply_that_is_cut_off_is_an_error(tmp_path):
    path = write_ply(tmp_path / "a.ply", POINTS, "binary_little_endian")
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(LogError, match="PLY"):
        read_cloud(path)


def test_other_endings_are_not_clouds(tmp_path):
    with pytest.raises(LogError, match=r"a point cloud \(\.ply, \.pcd, \.depth\.png\)"):
        read_cloud(tmp_path / "a.las")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_points_that_are_no_numbers_are_an_error(tmp_path, bad):
    points = POINTS.copy()
    points[[3, 7], 1] = bad
    with pytest.raises(LogError, match="expected finite points, found 2 of 500 with NaN"):
        read_cloud(write_ply(tmp_path / "a.ply", points))


def test_an_empty_cloud_is_an_error(tmp_path):
    with pytest.raises(LogError, match="found an empty cloud"):
        check_cloud(np.zeros((0, 3)), tmp_path / "a.ply")
    with pytest.raises(LogError, match="found 99 points"):
        check_cloud(POINTS[:99].astype(float), tmp_path / "a.ply")


def test_planes_and_lines_are_errors_wherever_they_lie(tmp_path):
    u, v = np.random.default_rng(1).uniform(-3, 3, (2, 400, 1))
    a, b, at = np.array([1.0, 2.0, 2.0]) / 3, np.array([2.0, 1.0, -2.0]) / 3, np.array([5.0, 1.0, 2.0])
    with pytest.raises(LogError, match="all of them on a plane"):
        check_cloud(at + u * a + v * b, tmp_path / "a.ply")
    with pytest.raises(LogError, match="all of them on a line"):
        check_cloud(at + u * a, tmp_path / "a.ply")
    rough = at + u * a + v * b + np.random.default_rng(2).normal(0, 0.002, (400, 3))
    assert len(check_cloud(rough, tmp_path / "a.ply")) == 400


def test_millimetres_are_warned_of_and_metres_are_not(tmp_path):
    path = tmp_path / "a.ply"
    assert unit_warning(POINTS, path) is None
    warning = unit_warning(POINTS * 1000.0, path)
    assert warning is not None
    assert "millimetres; try --unit 0.001" in warning
    assert unit_warning(np.zeros((0, 3)), path) is None


def test_the_unit_is_applied(tmp_path):
    path = write_ply(tmp_path / "a.ply", POINTS * 1000)
    np.testing.assert_allclose(read_cloud(path, 0.001), POINTS, rtol=1e-5)
