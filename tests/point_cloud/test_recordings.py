import numpy as np
import pytest

from radioslam import rigid
from radioslam.errors import LogError
from radioslam.formats.tum import read_spatial_tum, read_tum, write_spatial_tum, write_tum
from radioslam.point_cloud.recordings import find_recordings
from tests.point_cloud.scenes import random_motion
from tests.point_cloud.test_clouds import POINTS, write_ply


def clouds_in(folder, names=("1.ply", "2.5.ply", "10.ply")):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        write_ply(folder / name, POINTS)
    return folder


def trajectory(path, last_s=20.0):
    write_tum(path, np.array([0.0, last_s]), np.array([[0.0, 0.0, 0.0], [last_s, 0.0, 0.0]]))
    return path


def test_clouds_get_the_pose_of_their_time(tmp_path):
    (found,) = find_recordings([clouds_in(tmp_path / "walk")], trajectory(tmp_path / "o.tum"))
    assert found.name == "walk"
    assert [path.name for path in found.clouds] == ["1.ply", "2.5.ply", "10.ply"]  # by time, not by name
    np.testing.assert_allclose(found.body_at_clouds()[:, 0, 3], [1.0, 2.5, 10.0])
    assert found.is_planar


def test_listed_times_beat_names_and_mounts_are_read(tmp_path):
    folder = clouds_in(tmp_path / "walk")
    (folder / "clouds.txt").write_text("# time name\n3 10.ply\n4 2.5.ply\n5 1.ply\n")
    mount = random_motion(1)
    np.savetxt(folder / "mount.txt", mount)
    (found,) = find_recordings([folder], trajectory(tmp_path / "o.tum"))
    assert [path.name for path in found.clouds] == ["10.ply", "2.5.ply", "1.ply"]
    np.testing.assert_allclose(found.T_body_sensor, mount, atol=1e-12)


def test_walks_in_the_open_format_bring_odometry_and_scans(tmp_path):
    for name in ("b", "a"):
        clouds_in(tmp_path / name / "clouds")
        trajectory(tmp_path / name / "trajectory.tum")
    (tmp_path / "a" / "scans.csv").write_text("time_s,bssid,rssi_dbm\n1,x,-50\n")
    a, b = find_recordings([tmp_path])
    assert (a.name, b.name) == ("a", "b")
    assert a.walk is not None
    assert b.walk is None


def test_poses_beside_the_clouds_serve_without_odometry(tmp_path):
    folder = clouds_in(tmp_path / "walk", ("1.ply", "2.ply"))
    np.savetxt(folder / "1.pose.txt", np.eye(4))
    with pytest.raises(LogError, match=r"2\.pose\.txt: expected the cloud's pose \(or --odometry TUM\), found no such"):
        find_recordings([folder])
    T = random_motion(2)
    np.savetxt(folder / "2.pose.txt", T)
    (found,) = find_recordings([folder])
    np.testing.assert_allclose(found.body_at_clouds()[1], T, atol=1e-9)
    assert not found.is_planar


def test_a_cloud_outside_of_the_odometry_has_no_pose(tmp_path):
    with pytest.raises(LogError, match=r"10\.ply: expected a pose at 10 s .* found poses from 0 to 5 s"):
        find_recordings([clouds_in(tmp_path / "walk")], trajectory(tmp_path / "o.tum", 5.0))


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("one.ply", "2.ply"), "a number in the name"),
        (("a1.ply", "b1.ply"), "a time of its own"),
    ],
)
def test_times_must_be_there_and_differ(tmp_path, names, message):
    with pytest.raises(LogError, match=message):
        find_recordings([clouds_in(tmp_path / "walk", names)], trajectory(tmp_path / "o.tum"))


def test_broken_lists_are_told_by_line(tmp_path):
    folder = clouds_in(tmp_path / "walk")
    (folder / "clouds.txt").write_text("1 1.ply\nx 2.5.ply\n")
    with pytest.raises(LogError, match=r"clouds\.txt:2: expected time_s and name"):
        find_recordings([folder], trajectory(tmp_path / "o.tum"))
    (folder / "clouds.txt").write_text("1 1.ply\n")
    with pytest.raises(LogError, match=r"the time of 10\.ply"):
        find_recordings([folder], trajectory(tmp_path / "o.tum"))


def test_nothing_to_read_is_told(tmp_path):
    with pytest.raises(LogError, match="a folder of point clouds"):
        find_recordings([tmp_path / "none"])
    with pytest.raises(LogError, match="none below it"):
        find_recordings([tmp_path])
    clouds_in(tmp_path / "a" / "clouds")
    clouds_in(tmp_path / "b" / "clouds")
    with pytest.raises(LogError, match="one walk for one trajectory, found 2"):
        find_recordings([tmp_path], trajectory(tmp_path / "o.tum"))
    trajectory(tmp_path / "a" / "trajectory.tum")
    with pytest.raises(LogError, match="walks of different names"):
        find_recordings([tmp_path / "a", tmp_path / "a"])


def test_poses_in_space_go_through_tum(tmp_path):
    T = np.array([random_motion(k) for k in range(5)])
    write_spatial_tum(tmp_path / "a.tum", np.arange(5.0), T)
    time_s, read = read_spatial_tum(tmp_path / "a.tum")
    np.testing.assert_array_equal(time_s, np.arange(5.0))
    np.testing.assert_allclose(read, T, atol=2e-6)
    np.testing.assert_allclose(read_tum(tmp_path / "a.tum").values, rigid.to_planar(T), atol=1e-5)
