import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import ar_session, find_logs, read_walk, read_walks
from radioslam.formats.pose_files import poses_of, read_poses, sniff

from .samples import AR_WIFI, ARCORE_POSES, ARKIT_POSES, POSES, TERMUX, TUM

LAYOUTS = {"header": POSES, "arcore": ARCORE_POSES, "arkit": ARKIT_POSES}


def write(folder, **files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name.replace("__", ".")).write_bytes(content)
    return folder


@pytest.mark.parametrize("layout", LAYOUTS)
def test_poses_are_seen_from_above(tmp_path, layout):
    write(tmp_path, poses__txt=LAYOUTS[layout])
    signal = read_poses(tmp_path / "poses.txt")
    np.testing.assert_allclose(signal.time_s, [1000, 1000.5, 1001])
    # Forward along -z is up the page; then a quarter turn to the right, towards +x.
    np.testing.assert_allclose(signal.values, [[0, 0, np.pi / 2], [0, 0.6, np.pi / 2], [0.5, 0.6, 0]], atol=1e-6)


def test_a_camera_that_looks_down_heads_where_its_top_does(tmp_path):
    half = 0.5**0.5
    rows = [f"{k},{0.5 * k},1.3,0.0,{-half},0,0,{half}" for k in range(3)]
    write(tmp_path, poses__csv=("timestamp,tx,ty,tz,qx,qy,qz,qw\n" + "\n".join(rows)).encode())
    np.testing.assert_allclose(read_poses(tmp_path / "poses.csv").values[:, 2], np.pi / 2)


@pytest.mark.parametrize("unit", [1, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("start_s", [0, 15_492, 1_715_936_400])
def test_the_unit_of_times_shows_in_their_steps(tmp_path, unit, start_s):
    rows = [f"{(start_s + k / 30) * unit:.6f},0,0,0,0,0,0,1" for k in range(60)]
    write(tmp_path, poses__csv=("timestamp,x,y,z,qx,qy,qz,qw\n" + "\n".join(rows)).encode())
    np.testing.assert_allclose(read_poses(tmp_path / "poses.csv").time_s, start_s + np.arange(60) / 30, atol=1e-5)


def test_columns_are_found_by_name_and_others_passed_over(tmp_path):
    rows = [b"state,qw,qx,qy,qz,timestamp [ns],x,y,z", *(b"TRACKING,1,0,0,0,%d,0,0,%d" % (k, -k) for k in range(3))]
    write(tmp_path, poses__csv=b"\n".join(rows))
    signal = read_poses(tmp_path / "poses.csv")
    np.testing.assert_allclose(signal.time_s, np.arange(3) * 1e-9)
    np.testing.assert_array_equal(signal.values[:, 1], [0, 1, 2])


def test_tum_is_not_taken_for_a_session():
    assert all(map(sniff, LAYOUTS.values()))
    assert not sniff(TUM)
    assert not sniff(b"# timestamp tx ty tz qx qy qz qw\n0 0 0 0 0 0 0 1\n")


def test_scans_and_poses_of_a_session_are_one_walk(tmp_path):
    folder = write(tmp_path / "session3", wifi__csv=AR_WIFI, ARCore_sensor_pose__txt=ARCORE_POSES)
    for path in (folder, folder / "ARCore_sensor_pose.txt", folder / "wifi.csv"):
        assert find_logs([path]) == [folder / "wifi.csv"]
    (walk,) = read_walks([folder])
    assert walk.name == "session3"
    np.testing.assert_allclose(walk.wifi.scan_time_s, [1000.2, 1000.9])
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-60, -63, -61])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2437, np.nan, 2437])
    assert len(walk.odometry) == 3


def test_many_sessions_in_one_folder_are_paired_by_name(tmp_path):
    shifted = ARKIT_POSES.replace(b"-0.6", b"-0.9")
    folder = write(tmp_path, a_wifi__csv=AR_WIFI, a_pose__csv=POSES, b_wifi__csv=AR_WIFI, b_pose__txt=shifted)
    walks = read_walks([folder])
    assert [walk.name for walk in walks] == ["a_wifi", "b_wifi"]
    assert [walk.odometry.values[1, 1] for walk in walks] == [0.6, 0.9]


def test_a_trajectory_of_another_walk_is_not_taken(tmp_path):
    folder = write(tmp_path, a_wifi__csv=AR_WIFI, b_pose__csv=POSES)
    assert poses_of(folder / "a_wifi.csv") is None
    assert ar_session.log_of(folder / "b_pose.csv") == folder / "b_pose.csv"
    with pytest.raises(LogError, match="expected motion"):
        read_walks([folder / "a_wifi.csv"])
    with pytest.raises(LogError, match="expected WiFi scans"):
        read_walks([folder / "b_pose.csv"])


def test_poses_beside_termux_scans(tmp_path):
    folder = write(tmp_path, a_scans__json=TERMUX, a_pose__csv=POSES)
    walk = read_walk(folder / "a_scans.json")
    assert (len(walk.wifi), len(walk.odometry)) == (2, 3)
    with pytest.raises(LogError, match="two clocks that never meet"):
        read_walks([folder / "a_scans.json"])


@pytest.mark.parametrize("header", [b"time,mac,level", b"timestamp,SSID_,BSSID,signal", b"t,rss,address"])
def test_scans_by_other_names(tmp_path, header):
    values = {b"BSSID": b"20-23-00-00-00-15", b"SSID_": b"x"}
    values |= dict.fromkeys((b"mac", b"address"), b"20:23:00:00:00:15")
    values |= dict.fromkeys((b"level", b"signal", b"rss"), b"-55") | dict.fromkeys(
        (b"time", b"timestamp", b"t"), b"5.0"
    )
    rows = [header, b",".join(values[name] for name in header.split(b","))]
    write(tmp_path, wifi__csv=b"\n".join(rows))
    assert ar_session.sniff(rows[0])
    assert read_walk(tmp_path / "wifi.csv").wifi.transmitters == ("20:23:00:00:00:15",)


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        (POSES.replace(b"0,0,0,1", b"0,0,0,2", 1), 2, "a unit quaternion"),
        (POSES.replace(b"-0.6", b"x", 1), 3, "a finite number as tz"),
        (POSES.replace(b",0.5,1.41", b",1.41"), 4, "8 columns"),
        (POSES.replace(b"1001.0", b"996.0"), 4, "trajectory times that do not go backwards"),
        (ARKIT_POSES.replace(b"1000.5 1", b"1000.5 3"), 3, "a rotation matrix"),
        (b"# made by hand\n1,2,3\n", 2, "a header that names timestamp,tx,ty,tz,qx,qy,qz,qw"),
        (b"timestamp,tx,ty,tz,qx,qy,qz,qw\n", None, "comments only"),
    ],
)
def test_the_message_names_the_bad_pose(tmp_path, content, line, message):
    write(tmp_path, poses__csv=content)
    with pytest.raises(LogError) as error:
        read_poses(tmp_path / "poses.csv")
    assert error.value.line == line
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b"-63", b"63", 3, "RSS in [-127, 0) dBm, found 63"),
        (b"20-23-00-00-00-15", b"Guest", 3, "a BSSID such as"),
        (b"BSSID", b"AP", 1, "columns with a time, a BSSID and an RSS"),
        (b"1000900", b"soon", 4, "a finite number as timestamp_ms"),
    ],
)
def test_the_message_names_the_bad_reading(tmp_path, old, new, line, message):
    write(tmp_path, wifi__csv=AR_WIFI.replace(old, new, 1))
    with pytest.raises(LogError) as error:
        ar_session.read(tmp_path / "wifi.csv")
    assert error.value.line == line
    assert message in str(error.value)
