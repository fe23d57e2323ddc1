import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import iw_scan

from .samples import IW, TUM

STAMPS = (b"1715936400.25\n", b"1715936404.5\n")


def read(folder, content):
    path = folder / "walk.txt"
    path.write_bytes(content)
    return iw_scan.read(path)


def unstamped(content=IW):
    for stamp in STAMPS:
        content = content.replace(stamp, b"")
    return content


def test_values_are_read_exactly(tmp_path):
    walk = read(tmp_path, IW)
    assert walk.wifi.transmitters == ("20:23:00:00:00:0a", "20:23:00:00:00:15")
    np.testing.assert_array_equal(walk.wifi.scan_time_s, [1715936400.25, 1715936404.5])
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-52, -71, -55])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2437, 5180, 2437])
    np.testing.assert_allclose(walk.wifi.last_seen_s - 1715936400.25, [0, -2.5, 4.15], atol=1e-6)
    assert (walk.motion, walk.notes) == (None, ("1 readings of hidden networks, _nomap or _optout left out",))


def test_without_time_lines_a_scan_ends_where_a_network_comes_again(tmp_path):
    second = b"\tlast seen: 2808.000s [boottime]\n\tfreq: 2437\n\tsignal: -55"
    walk = read(tmp_path, unstamped().replace(b"\tfreq: 2437\n\tsignal: -55", second))
    np.testing.assert_array_equal(walk.wifi.scan_time_s, [2804, 2808])
    np.testing.assert_array_equal(walk.wifi.last_seen_s, [2804, 2801.5, 2808])


def test_one_scan_needs_no_clock(tmp_path):
    one = b"".join(line for line in unstamped().splitlines(keepends=True)[:17] if b"boottime" not in line)
    wifi = read(tmp_path, one).wifi
    np.testing.assert_array_equal(wifi.scan_time_s, [0])
    np.testing.assert_allclose(wifi.last_seen_s, [-0.052, -2.552])


def test_a_trajectory_beside_it_is_its_motion(tmp_path):
    (tmp_path / "walk.tum").write_bytes(TUM)
    assert len(read(tmp_path, IW).odometry) == 2


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b"\tsignal: -71.00 dBm\n", b"", 13, "signal: … dBm, found a network without it"),
        (b"-71.00", b"71", 13, "RSS in [-127, 0) dBm, found 71"),
        (b"-71.00", b"x", 16, "a finite number"),
        (b"BSS 20:23:00:00:00:15", b"BSS 20:23", 13, "BSS aa:bb:cc:dd:ee:ff(on …)"),
        (b"1715936404.5\n", b"", 24, "the time of each scan, found several scans and no clock"),
    ],
)
def test_the_message_names_the_bad_line(tmp_path, old, new, line, message):
    assert old in IW
    with pytest.raises(LogError) as error:
        read(tmp_path, IW.replace(old, new, 1))
    assert error.value.line == line
    assert message in str(error.value)


def test_text_without_networks_is_none(tmp_path):
    with pytest.raises(LogError, match="save what iw dev"):
        read(tmp_path, b"command failed: Device or resource busy (-16)\n")
