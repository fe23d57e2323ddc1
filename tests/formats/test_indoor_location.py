from pathlib import Path

import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import indoor_location

from .samples import INDOOR


def read(folder: Path, content: bytes):
    path = folder / "walk7.txt"
    path.write_bytes(content)
    return indoor_location.read(path)


def test_values_are_read_exactly(tmp_path):
    walk = read(tmp_path, INDOOR)
    assert (walk.name, walk.device, walk.floor, walk.notes) == ("walk7", "OPPO PBCM10", "F1", ())
    accelerometer = walk.inertial.accelerometer
    np.testing.assert_array_equal(accelerometer.time_s, [1574559495.401, 1574559495.421, 1574559499.0])
    np.testing.assert_array_equal(accelerometer.values, [[-0.5, 1.25, 9.75], [-0.25, 1.5, 9.5], [0, 1, 10]])
    np.testing.assert_array_equal(walk.inertial.gyroscope.values, [[-0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(walk.inertial.magnetometer.values, [[29.5, 6.5, -30.25]])
    np.testing.assert_allclose(walk.inertial.rotation_vector.values, [[0, 0.6, 0, 0.8]])
    np.testing.assert_array_equal(walk.reference.time_s, [1574559495.263, 1574559499.263])
    np.testing.assert_array_equal(walk.reference.positions_xy, [[81.25, 93.5], [80.25, 94.5]])


def test_radio_values_are_read_exactly(tmp_path):
    walk = read(tmp_path, INDOOR)
    wifi, ble = walk.wifi, walk.ble
    assert wifi.transmitters == ("74:ee:2a:cd:eb:43", "a8:0c:ca:03:9d:d7")
    np.testing.assert_array_equal(wifi.scan_time_s, [1574559497.191, 1574559498.5])
    np.testing.assert_array_equal(wifi.reading_scan, [0, 0, 1])
    np.testing.assert_array_equal(wifi.reading_transmitter, [0, 1, 1])
    np.testing.assert_array_equal(wifi.rss_dbm, [-53, -49, -51])
    np.testing.assert_array_equal(wifi.frequency_mhz, [5785, 2422, 2422])
    np.testing.assert_array_equal(wifi.last_seen_s, [1574559490.742, 1574559495.45, 1574559498.0])
    assert ble.transmitters == ("e0:78:a3:3d:b5:d6",)
    np.testing.assert_array_equal(ble.scan_time_s, [1574559496.436])
    np.testing.assert_array_equal(ble.rss_dbm, [-93])


def test_floor_is_the_folder_above_path_data_files(tmp_path):
    folder = tmp_path / "B2" / "path_data_files"
    folder.mkdir(parents=True)
    assert read(folder, INDOOR).floor == "B2"


@pytest.mark.parametrize("missing", [b"\n1574559495401\tTYPE_GYRO", b"\n1574559498500\tTYPE_WIFI", b"\n#\tendTime"])
def test_two_records_on_one_line(tmp_path, missing):
    glued = read(tmp_path, INDOOR.replace(missing, missing[1:]))
    plain = read(tmp_path, INDOOR)
    np.testing.assert_array_equal(glued.wifi.rss_dbm, plain.wifi.rss_dbm)
    np.testing.assert_array_equal(glued.wifi.last_seen_s, plain.wifi.last_seen_s)
    np.testing.assert_array_equal(glued.inertial.gyroscope.values, plain.inertial.gyroscope.values)
    np.testing.assert_array_equal(glued.inertial.accelerometer.values, plain.inertial.accelerometer.values)


@pytest.mark.parametrize("ssid", [b"a\tb", b"\xff\xfe\x80", b"line\nbreak", b"car\rriage", b'"', b"#"])
def test_an_odd_network_name_does_not_matter(tmp_path, ssid):
    odd = read(tmp_path, INDOOR.replace(b"WIFI\tFMI", b"WIFI\t" + ssid, 1))
    np.testing.assert_array_equal(odd.wifi.rss_dbm, read(tmp_path, INDOOR).wifi.rss_dbm)


def test_waypoints_are_sorted_and_equal_times_dropped(tmp_path):
    extra = b"1574559494000\tTYPE_WAYPOINT\t1\t2\n1574559494000\tTYPE_WAYPOINT\t3\t4\n"
    walk = read(tmp_path, INDOOR + extra)
    np.testing.assert_array_equal(walk.reference.positions_xy, [[1, 2], [81.25, 93.5], [80.25, 94.5]])
    assert len(walk.notes) == 2


@pytest.mark.parametrize("sentinel", [b"0", b"127"])
def test_readings_without_strength_are_left_out(tmp_path, sentinel):
    walk = read(tmp_path, INDOOR.replace(b"\t-53\t", b"\t" + sentinel + b"\t"))
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-49, -51])
    assert "1 readings without RSS" in walk.notes[0]


def test_samples_slightly_out_of_order_are_sorted(tmp_path):
    late = b"1574559498900\tTYPE_ACCELEROMETER\t7\t7\t7\t2\n"
    walk = read(tmp_path, INDOOR + late)
    np.testing.assert_array_equal(walk.inertial.accelerometer.values[2], [7, 7, 7])
    assert "out of order" in walk.notes[0]


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b"-0.25\t1.5", b"-0.25\tnan", 10, "a finite number as y, found 'nan'"),
        (b"-0.25\t1.5", b"-0.25\t1_5", 10, "a finite number as y, found '1_5'"),
        (b"-0.25\t1.5", b"-0.25,1.5", 10, "found 5 columns"),
        (b"-0.25\t1.5", b"-0.25\t1e9", 10, "accelerometer values below 1e+06"),
        (b"1.25\t9.75", b"1.29.75", 5, "found 5 columns"),
        (b"\t0\t7\t", b"\t07\t", 11, "as MAC"),
        (b"0.0\t0.6\t0.0", b"0.0\t1.6\t0.0", 8, "unit sphere"),
        (b"\t-53\t", b"\t5\t", 13, "RSS in [-127, 0) dBm, found 5"),
        (b"\t-53\t", b"\t-128\t", 13, "RSS in [-127, 0) dBm, found -128"),
        (b"\t-93\t", b"\tx\t", 11, "a finite number as RSS, found 'x'"),
        (b"74:ee:2a:cd:eb:43", b"\xff\xfe", 13, "UTF-8 text as BSSID"),
        (b"81.25", b"1e7", 4, "a position within"),
        (b"1574559499000\tTYPE_ACC", b"1574559490000\tTYPE_ACC", 15, "do not go backwards"),
        (b"#\tendTime:1574559499300\n", b"15745594", 17, "a record"),
        (b"#\tendTime:1574559499300\n", b"1574559499300\tTYPE_ACCELEROMETER\t1", 17, "columns"),
        (b"#\tendTime", b"hello", 17, "found 'hello"),
        (b"#\tBrand", b"Brand", 3, "a record"),
    ],
)
def test_the_message_names_the_bad_line(tmp_path, old, new, line, message):
    assert old in INDOOR
    with pytest.raises(LogError) as error:
        read(tmp_path, INDOOR.replace(old, new, 1))
    assert error.value.line == line
    assert message in str(error.value)


def test_wrong_separator(tmp_path):
    with pytest.raises(LogError, match="separate the fields by tabs"):
        read(tmp_path, INDOOR.replace(b"\t", b" "))


def test_a_byte_order_mark_and_windows_lines_do_not_matter(tmp_path):
    walk = read(tmp_path, b"\xef\xbb\xbf" + INDOOR.replace(b"\n", b"\r\n"))
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-53, -49, -51])
    assert walk.device == "OPPO PBCM10"
