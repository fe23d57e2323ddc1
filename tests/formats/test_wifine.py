import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import wifine

from .samples import WIFINE


def read(folder, content):
    path = folder / "train_4_1.csv"
    path.write_bytes(content)
    return wifine.read(path)


def test_values_are_read_exactly(tmp_path):
    walk = read(tmp_path, WIFINE)
    assert (walk.name, walk.floor, walk.motion, walk.ble) == ("train_4_1", "0", None, None)
    assert walk.wifi.transmitters == ("ap0", "ap1", "ap2")
    np.testing.assert_array_equal(walk.wifi.scan_time_s, [0, 3.95])
    np.testing.assert_array_equal(walk.wifi.reading_scan, [0, 0, 1])
    np.testing.assert_array_equal(walk.wifi.reading_transmitter, [0, 2, 1])
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-38, -72.5, -50])
    np.testing.assert_array_equal(walk.reference.positions_xy, [[14.25, 0.5], [14.5, 0.75]])


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (b"timestamp", b"time", 1, "a header 0,1"),
        (b",0.5,", b",nan,", 2, "a finite number as y, found 'nan'"),
        (b",-50.0,", b",5,", 3, "RSS in [-127, 0) dBm, found 5"),
        (b",1.4,0\n-100", b"\n-100", 2, "found 7 columns"),
        (b"14.5,0.75", b"14.5,1e9", 3, "a position within"),
        (b",", b";", 1, "separate the columns by ','"),
    ],
)
def test_the_message_names_the_bad_line(tmp_path, old, new, line, message):
    assert old in WIFINE
    count = -1 if old == b"," else 1
    with pytest.raises(LogError) as error:
        read(tmp_path, WIFINE.replace(old, new, count))
    assert error.value.line == line
    assert message in str(error.value)


def test_a_header_alone_is_no_log(tmp_path):
    with pytest.raises(LogError, match="the header alone"):
        read(tmp_path, WIFINE.split(b"\n")[0])
