import gzip

import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import open_format, read_walk

from .samples import OPEN_FOLDER


@pytest.fixture
def folder(tmp_path):
    target = tmp_path / "walk7"
    target.mkdir()
    for name, content in OPEN_FOLDER.items():
        (target / name).write_bytes(content)
    return target


def check_values(walk):
    assert (walk.device, walk.floor, walk.notes) == ("robot", "3", ())
    np.testing.assert_array_equal(walk.wifi.scan_time_s, [0.5, 2.5])
    assert walk.wifi.transmitters == ("aa:01", "aa:02")
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-48, -71.5, -55])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2412, np.nan, 5180])
    np.testing.assert_array_equal(walk.wifi.last_seen_s, [0.25, np.nan, 2.25])
    assert walk.ble.transmitters == ("be:ac",)
    np.testing.assert_allclose(walk.odometry.values, [[0, 0, 0], [1.5, 0, np.pi / 2]])
    np.testing.assert_array_equal(walk.inertial.accelerometer.values, [[0, 0, 9.81], [0, 0.5, 9.8]])
    np.testing.assert_array_equal(walk.inertial.gyroscope.time_s, [0.02])
    assert walk.inertial.magnetometer is None
    np.testing.assert_array_equal(walk.inertial.rotation_vector.values, [[0, 0, 0, 1], [0, 0, 1, 0]])
    np.testing.assert_array_equal(walk.reference.positions_xy, [[1, 2], [3, 4]])
    assert walk.reference.origin_wgs84 == (49.5, 11.0)


def test_a_folder_is_a_walk(folder):
    walk = read_walk(folder / "scans.csv")
    assert (walk.name, walk.path) == ("walk7", folder / "scans.csv")
    check_values(walk)


def test_a_trajectory_means_its_walk(folder):
    check_values(read_walk(folder / "trajectory.tum"))


def test_flat_files_are_a_walk(folder):
    flat = folder.parent / "flat"
    flat.mkdir()
    for kind, name in open_format.FOLDER_NAMES.items():
        (flat / f"hall{open_format.FLAT_ENDINGS[kind]}").write_bytes(OPEN_FOLDER[name])
    for name in ("hall.scans.csv", "hall.tum"):
        walk = read_walk(flat / name)
        assert walk.name == "hall"
        check_values(walk)


def test_every_file_may_be_gzip(folder):
    for name, content in OPEN_FOLDER.items():
        (folder / name).unlink()
        (folder / f"{name}.gz").write_bytes(gzip.compress(content))
    walk = read_walk(folder / "scans.csv.gz")
    assert walk.name == "walk7"
    check_values(walk)


def test_columns_are_found_by_name(folder):
    scans = b"\xef\xbb\xbfrssi_dbm,channel,bssid,time_s\r\n-48,6,aa:01,0.5\r\n-71.5,6,aa:02,0.5\r\n"
    (folder / "scans.csv").write_bytes(scans)
    wifi = read_walk(folder / "scans.csv").wifi
    np.testing.assert_array_equal(wifi.rss_dbm, [-48, -71.5])
    assert np.isnan(wifi.last_seen_s).all()


def test_scans_alone_can_be_looked_at(folder):
    for name in set(OPEN_FOLDER) - {"scans.csv"}:
        (folder / name).unlink()
    walk = read_walk(folder / "scans.csv")
    assert (walk.motion, walk.reference, walk.ble, walk.device) == (None, None, None, "")


@pytest.mark.parametrize(
    ("name", "old", "new", "line", "message"),
    [
        ("scans.csv", b"-71.5", b"0", 3, "RSS in [-127, 0) dBm, found 0"),
        ("scans.csv", b"-71.5", b"127", 3, "RSS in [-127, 0) dBm, found 127"),
        ("scans.csv", b"-71.5", b"inf", 3, "a finite number as rssi_dbm, found 'inf'"),
        ("scans.csv", b"5180", b"nan", 4, "a finite number as frequency_mhz, found 'nan'"),
        ("scans.csv", b",2.25\n", b"", 4, "the line is cut short"),
        ("scans.csv", b"aa:02", b"", 3, "text as bssid, found nothing"),
        ("scans.csv", b"aa:02", b"\xff", 3, "UTF-8 text as bssid"),
        ("scans.csv", b"bssid", b"mac", 1, "a header with the columns time_s,rssi_dbm,bssid"),
        ("reference.csv", b"x_m", b"x", 1, "a header with the columns time_s,x_m,y_m"),
        ("reference.csv", b"3.0", b"3e9", 3, "a position within"),
        ("inertial.csv", b"gx,gy,gz", b"gx,gy,g", 1, "the columns gx,gy,gz together"),
        ("inertial.csv", b",0.1,0.2", b",0.1,", 3, "all of gx,gy,gz or none"),
        ("inertial.csv", b"ax,ay,az", b"a,b,c", None, "accelerometer columns ax,ay,az with values"),
        ("inertial.csv", b"0,0,1,0\n", b"0,0,3,0\n", 3, "a unit quaternion"),
        ("inertial.csv", b"0.02,", b"-9,", 3, "do not go backwards"),
        ("walk.toml", b"device =", b"phone =", None, "known keys, found 'phone'"),
        ("walk.toml", b"device =", b"device", None, "TOML in UTF-8"),
        ("walk.toml", b"49.5", b"149.5", None, "origin_latitude_deg as a number within"),
        ("walk.toml", b"origin_longitude_deg = 11.0", b"", None, "origin_longitude_deg as a number"),
        ("ble.csv", b"identity", b"bssid", 1, "a header with the columns time_s,rssi_dbm,identity"),
    ],
)
def test_the_message_names_file_and_line(folder, name, old, new, line, message):
    content = OPEN_FOLDER[name]
    assert old in content
    (folder / name).write_bytes(content.replace(old, new, 1))
    with pytest.raises(LogError) as error:
        open_format.read(folder / "scans.csv")
    assert error.value.path == folder / name
    assert error.value.line == line
    assert message in str(error.value)


def test_wrong_separator(folder):
    scans = folder / "scans.csv"
    scans.write_bytes(OPEN_FOLDER["scans.csv"].replace(b",", b";"))
    with pytest.raises(LogError, match="separate them by ','"):
        read_walk(scans)
