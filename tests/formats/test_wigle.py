import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import wigle

from .samples import WIGLE


def read(folder, content):
    path = folder / "office.csv"
    path.write_bytes(content)
    return wigle.read(path)


def without(*columns):
    """The sample as a writer that leaves out columns makes it."""
    mark, header, *rows = WIGLE.replace(b'"Cafe, ""Rose"""', b"Cafe").split(b"\n")
    keep = [k for k, name in enumerate(header.split(b",")) if name.decode() not in columns]
    lines = [b",".join(np.array(line.split(b","), dtype=object)[keep]) for line in (header, *rows) if line]
    return b"\n".join([mark, *lines])


def test_values_are_read_exactly(tmp_path):
    walk = read(tmp_path, WIGLE)
    assert (walk.name, walk.device, walk.motion) == ("office", "Google, LLC Pixel 7", None)
    np.testing.assert_array_equal(walk.wifi.scan_time_s, 1715936400 + np.array([0, 4, 8]))
    assert walk.wifi.transmitters == ("20:23:00:00:00:0a", "20:23:00:00:00:15")
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-60, -63, -61, -64])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2437, 5180, 2437, 5180])
    assert walk.ble.transmitters == ("db:08:d3:33:38:ef",)
    assert walk.notes == ("1 readings of hidden networks, _nomap or _optout left out", "1 rows without a position")


def test_positions_are_the_reference_with_the_accuracy_told(tmp_path):
    reference = read(tmp_path, WIGLE).reference
    assert reference.origin_wgs84 == (48.1, 11.5)
    np.testing.assert_array_equal(reference.time_s, 1715936400 + np.array([0, 2, 4, 8]))
    east = 1e-4 * 111_320 * np.cos(np.radians(48.1))
    np.testing.assert_allclose(reference.positions_xy[:, 0], [0, east / 2, east, east], rtol=5e-3, atol=1e-6)
    assert reference.sigma_m == pytest.approx(3.0, rel=1e-3)


def test_columns_may_be_missing(tmp_path):
    bare = without("SSID", "AuthMode", "Channel", "Frequency", "AltitudeMeters", "RCOIs", "MfgrId", "AccuracyMeters")
    walk = read(tmp_path, bare)
    assert np.isnan(walk.wifi.frequency_mhz).all()
    assert walk.reference.sigma_m is None
    assert "20:23:00:00:00:99" in walk.wifi.transmitters  # nobody told its name


def test_without_types_all_rows_are_wifi_and_without_positions_there_is_no_reference(tmp_path):
    rows = [
        line for line in without("Type", "CurrentLatitude", "CurrentLongitude").split(b"\n") if b"310260" not in line
    ]
    walk = read(tmp_path, b"\n".join(rows))
    assert (walk.ble, walk.reference) == (None, None)
    assert "db:08:d3:33:38:ef" not in walk.wifi.transmitters  # its name is empty: hidden
    assert walk.wifi.reading_count == 4


def test_the_line_of_the_program_may_be_missing(tmp_path):
    walk = read(tmp_path, WIGLE.split(b"\n", 1)[1])
    assert (walk.device, walk.wifi.reading_count) == ("", 4)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b",-63,", b",63,", 4, "RSS in [-127, 0) dBm, found 63"),
        (b",-63,", b",x,", 4, "a finite number as rssi"),
        (b"20:23:00:00:00:15", b"20:23", 4, "a BSSID such as aa:bb:cc:dd:ee:ff"),
        (b"2024-05-17 09:00:04", b"yesterday", 7, "a time such as 2024-05-17 09:30:00"),
        (b"48.1,11.5,500", b"148.1,11.5,500", 3, "a latitude and longitude"),
        (b'""Rose"""', b'""Rose""', None, "CSV with cells in whole quotes"),
        (b",[ESS],2024-05-17 09:00:00", b",2024", 4, "14 columns as the header has, found 13 columns"),
        (b"RSSI", b"Level", 2, "found none called rssi"),
        (b"Channel", b"SSID", 2, "column names, each once"),
    ],
)
def test_the_message_names_the_bad_line(tmp_path, old, new, line, message):
    assert old in WIGLE
    with pytest.raises(LogError) as error:
        read(tmp_path, WIGLE.replace(old, new, 1))
    assert message in str(error.value)
    assert line is None or error.value.line == line
