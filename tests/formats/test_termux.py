import json

import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import termux

from .samples import TERMUX, TERMUX_SCAN, TUM

SCAN = json.loads(TERMUX_SCAN)
LATER = [{**SCAN[0], "timestamp": 9_000_000, "rssi": -62}]


def read(folder, content):
    path = folder / "walk.json"
    path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
    return termux.read(path)


def test_scans_that_follow_each_other_have_the_time_of_their_latest_network(tmp_path):
    walk = read(tmp_path, TERMUX)
    assert (walk.name, walk.motion, walk.notes) == ("walk", None, ())
    assert walk.wifi.transmitters == ("20:23:00:00:00:0a", "20:23:00:00:00:15")
    np.testing.assert_array_equal(walk.wifi.scan_time_s, [5, 9])
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-60, -63, -62, -63])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2437, 5180, 2437, 5180])
    np.testing.assert_array_equal(walk.wifi.last_seen_s, [5, 2, 9, 2])


def test_an_array_of_scans_and_a_lonely_scan(tmp_path):
    np.testing.assert_array_equal(read(tmp_path, [SCAN, [], LATER]).wifi.scan_time_s, [5, 9])
    np.testing.assert_array_equal(read(tmp_path, SCAN).wifi.scan_time_s, [5])
    undated = [{key: value for key, value in one.items() if key != "timestamp"} for one in SCAN]
    wifi = read(tmp_path, undated).wifi
    np.testing.assert_array_equal(wifi.scan_time_s, [0])
    assert np.isnan(wifi.last_seen_s).all()


@pytest.mark.parametrize(("name", "unit"), [("time", 1), ("time_ms", 1e3), ("timestamp", 1e9), ("Time", 1e3)])
def test_scans_may_bear_their_time(tmp_path, name, unit):
    lines = [{name: (1715936400 + 5 * k) * unit, "scan": scan} for k, scan in enumerate([SCAN, SCAN, LATER])]
    wifi = read(tmp_path, "\n".join(map(json.dumps, lines)).encode()).wifi
    np.testing.assert_allclose(wifi.scan_time_s, 1715936400 + np.array([0, 5, 10]))
    np.testing.assert_allclose(wifi.last_seen_s, 1715936400 + np.array([0, -3, 5, 2, 10]))


def test_hidden_networks_are_left_out(tmp_path):
    walk = read(tmp_path, [{**SCAN[0], "ssid": ""}, SCAN[1]])
    assert walk.wifi.transmitters == ("20:23:00:00:00:15",)
    assert "1 readings of hidden networks" in walk.notes[0]


def test_a_trajectory_beside_it_is_its_motion(tmp_path):
    (tmp_path / "walk.tum").write_bytes(TUM)
    (tmp_path / "other.tum").write_bytes(TUM)
    assert len(read(tmp_path, TERMUX).odometry) == 2


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        (TERMUX.replace(b"-62", b"62"), 21, "RSS in [-127, 0) dBm, found 62"),
        (TERMUX.replace(b"-62", b'"x"'), 21, "a finite number as rssi"),
        (TERMUX[:-30], TERMUX[:-30].count(b"\n") + 1, "expected JSON"),
        (TERMUX.replace(b"20:23:00:00:00:15", b"Guest", 1), 1, "a BSSID such as"),
        (b'{"API_ERROR": "Location needs to be enabled on the device"}', 1, "Location needs to be enabled"),
        ([SCAN, [{**SCAN[0], "timestamp": None}]], 1, "a time of each scan"),
        ([{"time": 1.0, "scan": SCAN}, SCAN], 1, "found"),
        (b"[]", None, "scans as termux-wifi-scaninfo prints them, found none"),
        ([[[SCAN]]], 1, "scans as termux-wifi-scaninfo prints them"),
        (
            json.dumps(SCAN).encode() + b'\n{"time": 1.0, "scan": ' + json.dumps(SCAN).encode() + b"}",
            2,
            "times of one name",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path, content, line, message):
    with pytest.raises(LogError) as error:
        read(tmp_path, content)
    assert message in str(error.value)
    assert error.value.line == line
