import io

import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats import read_tum, write_tum
from radioslam.formats.tum import yaw

from .samples import TUM


def test_planar_poses_are_read(tmp_path):
    path = tmp_path / "walk.tum"
    path.write_bytes(TUM)
    for source in (path, str(path), TUM, TUM.replace(b" ", b"  ").replace(b"\n", b"\r\n")):
        signal = read_tum(source)
        np.testing.assert_array_equal(signal.time_s, [0, 1])
        np.testing.assert_allclose(signal.values, [[0, 0, 0], [1.5, 0, np.pi / 2]])


def test_what_is_written_is_read(tmp_path):
    random = np.random.default_rng(1)
    time_s = 1.6e9 + np.arange(20) / 7
    poses = np.column_stack([random.normal(0, 50, (20, 2)), random.uniform(-np.pi, np.pi, 20)])
    write_tum(tmp_path / "a.tum", time_s, poses)
    again = read_tum(tmp_path / "a.tum")
    np.testing.assert_allclose(again.time_s, time_s, atol=1e-6, rtol=0)
    np.testing.assert_allclose(again.values, poses, atol=1e-6, rtol=0)
    handle = io.StringIO()
    write_tum(handle, time_s, poses)
    assert handle.getvalue().encode() == (tmp_path / "a.tum").read_bytes()


def test_written_lines():
    handle = io.StringIO()
    write_tum(handle, np.array([0.5]), np.array([[1.0, -1e-9, 0.0]]))
    assert handle.getvalue() == "0.500000 1.000000 0.000000 0 0 0 0.000000000 1.000000000\n"


def test_yaw_ignores_tilt():
    quaternion = np.array([[np.sin(0.2), 0, 0, np.cos(0.2)], [0, 0, 2 * np.sin(0.35), 2 * np.cos(0.35)]])
    np.testing.assert_allclose(yaw(quaternion), [0, 0.7])


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        (TUM + b"2 0 0 0 0 0 0\n", 4, "8 columns t x y z qx qy qz qw, found 7 columns"),
        (TUM + b"2 0 0 0 0 0 0 2\n", 4, "a unit quaternion"),
        (TUM + b"2 0 0 0 0 0 0 0\n", 4, "a unit quaternion"),
        (TUM + b"2 0 nan 0 0 0 0 1\n", 4, "a finite number as y"),
        (TUM + b"-5 0 0 0 0 0 0 1\n", 4, "do not go backwards"),
        (TUM.replace(b" ", b","), 2, "8 columns"),
    ],
)
def test_the_message_names_the_bad_line(content, line, message):
    with pytest.raises(LogError) as error:
        read_tum(content)
    assert error.value.line == line
    assert message in str(error.value)
