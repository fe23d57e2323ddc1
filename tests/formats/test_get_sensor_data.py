import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import get_sensor_data
from radioslam.formats.streams import group_scan_times

from .samples import SENSOR


def read(folder, content):
    path = folder / "walk7.txt"
    path.write_bytes(content)
    return get_sensor_data.read(path)


def test_motion_keeps_the_sensor_spacing_on_the_app_clock(tmp_path):
    walk = read(tmp_path, SENSOR)
    offset_s = np.median([0.10 - 100, 0.15 - 100.02, 0.14 - 100.04, 9.0 - 108.92])
    expected = np.array([100, 100.02, 100.04, 108.92]) + offset_s
    np.testing.assert_allclose(walk.inertial.accelerometer.time_s, expected, atol=1e-9)
    np.testing.assert_allclose(np.diff(walk.inertial.accelerometer.time_s)[:2], 0.02)
    np.testing.assert_array_equal(walk.inertial.accelerometer.values[0], [1, 2, 9.5])
    np.testing.assert_allclose(walk.inertial.gyroscope.time_s, [0.1], atol=1e-9)
    np.testing.assert_array_equal(walk.inertial.magnetometer.values, [[-2, -34, -45]])
    np.testing.assert_allclose(walk.inertial.rotation_vector.values, [[0.6, 0, 0, 0.8]])


def test_a_sensor_clock_that_jumps_is_not_used(tmp_path):
    walk = read(tmp_path, SENSOR.replace(b";108.92;", b";500.00;"))
    np.testing.assert_array_equal(walk.inertial.accelerometer.time_s, [0.10, 0.14, 0.15, 9.0])
    assert "app's taken" in walk.notes[0]


def test_scans_are_grouped_and_networks_may_have_semicolons(tmp_path):
    wifi = read(tmp_path, SENSOR).wifi
    np.testing.assert_array_equal(wifi.scan_time_s, [0.651, 4.651])
    np.testing.assert_array_equal(wifi.reading_scan, [0, 0, 1])
    assert wifi.transmitters == ("20:23:00:00:00:0a", "20:23:00:00:00:15")
    np.testing.assert_array_equal(wifi.rss_dbm, [-60, -63, -61])
    np.testing.assert_array_equal(wifi.frequency_mhz, [2437, 2452, 2437])


def test_older_wifi_lines_have_no_frequency(tmp_path):
    older = SENSOR.replace(b";2437;", b";").replace(b";2452;-63", b";-63;")
    wifi = read(tmp_path, older).wifi
    np.testing.assert_array_equal(wifi.rss_dbm, [-60, -63, -61])
    assert np.isnan(wifi.frequency_mhz).all()


def test_beacons_device_and_floor(tmp_path):
    walk = read(tmp_path, SENSOR)
    assert walk.ble.transmitters == ("be:ac:20:23:00:01",)
    np.testing.assert_array_equal(walk.ble.scan_time_s, [2.8313])
    np.testing.assert_array_equal(walk.ble.rss_dbm, [-90])
    assert (walk.name, walk.device, walk.floor, walk.notes) == ("walk7", "samsung SM-A520F", "2", ())


def test_reference_is_metres_from_the_first_fix(tmp_path):
    reference = read(tmp_path, SENSOR).reference
    assert reference.origin_wgs84 == (49.461316433032, 11.110964442580)
    np.testing.assert_array_equal(reference.time_s, [1.0, 5.0])
    np.testing.assert_allclose(reference.positions_xy[0], [0, 0], atol=1e-6)
    metres_per_degree = 111_320 * np.cos(np.radians(49.46))
    np.testing.assert_allclose(reference.positions_xy[1], [1e-4 * metres_per_degree, 11.12], rtol=5e-3)


def test_odd_bytes_in_a_network_name_and_windows_lines(tmp_path):
    odd = SENSOR.replace(b"odd;name", b"\xff\xfe").replace(b"\n", b"\r\n")
    np.testing.assert_array_equal(read(tmp_path, odd).wifi.rss_dbm, [-60, -63, -61])


def test_walks_over_several_floors_say_so(tmp_path):
    walk = read(tmp_path, SENSOR.replace(b"064442580;2;", b"064442580;3;"))
    assert walk.floor == "2"
    assert "2 floors" in walk.notes[0]


def test_scan_times_are_grouped_by_the_first():
    grouped = group_scan_times(np.array([2.0, 0.0, 0.4, 0.6, 0.49]))
    np.testing.assert_array_equal(grouped, [2.0, 0.0, 0.0, 0.6, 0.0])


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b"1.1;2.1;9.6", b"1.1;inf;9.6", 5, "a finite number as y, found 'inf'"),
        (b"1.1;2.1;9.6;3", b"1.1;2.1", 5, "7 columns kind;app s;sensor s;x;y;z;accuracy"),
        (b"1.1;2.1;9.6", b"1.12.1;9.6", 5, "found 6 columns"),
        (b"0.15;100.02", b"-5;-1e12", 5, "a time in seconds"),
        (b";100.04;", b";98.50;", 6, "do not go backwards"),
        (b";-63", b";12", 12, "RSS in [-127, 0) dBm, found 12"),
        (b";2452;", b";x;", 12, "finite numbers in WIFI"),
        (b"20:23:00:00:00:15", b"20:23", 12, "expected WIFI;app s;sensor s;SSID;MAC;[MHz;]RSS"),
        (b"BE:AC:20:23:00:01;-90", b"BE:AC", 14, "expected BLE4;"),
        (b"49.461316433032", b"149.4", 16, "a latitude and longitude"),
        (b"11.110964442580", b"x", 16, "a finite number as longitude"),
        (b"PRES;0.1", b"PRES,0.1", 15, "separate the fields by ';'"),
        (b"0.6;0.0;0.0;3", b"1.6;0.0;0.0;3", 10, "unit sphere"),
    ],
)
def test_the_message_names_the_bad_line(tmp_path, old, new, line, message):
    assert old in SENSOR
    with pytest.raises(LogError) as error:
        read(tmp_path, SENSOR.replace(old, new, 1))
    assert error.value.line == line
    assert message in str(error.value)


def test_comments_alone_are_no_log(tmp_path):
    with pytest.raises(LogError, match="comments only"):
        read(tmp_path, b"% LogFile created by the 'GetSensorData' App\n")
