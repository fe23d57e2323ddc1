from dataclasses import replace

import numpy as np
import pytest

from radioslam.formats import get_sensor_data, indoor_location, read_walk, write_walk
from radioslam.walk import RadioScans, Signal, Walk

from .samples import INDOOR, SENSOR


@pytest.fixture(params=["indoor", "sensor", "tracker"])
def walk(request, tmp_path):
    path = tmp_path / "walk7.txt"
    path.write_bytes(SENSOR if request.param == "sensor" else INDOOR)
    read = get_sensor_data.read if request.param == "sensor" else indoor_location.read
    walk = read(path)
    if request.param == "tracker":
        poses = np.array([[0, 0, 0], [1.25, -0.5, 3.0], [2.5, 0.125, -3.0]])
        odometry = Signal(walk.start_s + np.arange(3), poses)
        return replace(walk, odometry=odometry, inertial=None, ble=None, reference=None)
    return walk


def signals(walk: Walk):
    inertial = walk.inertial
    yield walk.odometry
    if inertial is not None:
        yield from (inertial.accelerometer, inertial.gyroscope, inertial.magnetometer, inertial.rotation_vector)


def assert_same_scans(a: RadioScans | None, b: RadioScans | None):
    assert (a is None) == (b is None)
    if a is None or b is None:
        return
    assert a.transmitters == b.transmitters
    for name in ("scan_time_s", "reading_scan", "reading_transmitter", "rss_dbm", "frequency_mhz", "last_seen_s"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=1e-6, rtol=0)


def test_what_is_written_is_read(walk, tmp_path):
    target = write_walk(walk, tmp_path / "out")
    assert target == tmp_path / "out" / "walk7"
    again = read_walk(target / "scans.csv")
    assert (again.name, again.device, again.floor) == (walk.name, walk.device, walk.floor)
    assert_same_scans(again.wifi, walk.wifi)
    assert_same_scans(again.ble, walk.ble)
    for ours, theirs in zip(signals(walk), signals(again), strict=True):
        assert (ours is None) == (theirs is None)
        if ours is not None and theirs is not None:
            np.testing.assert_allclose(theirs.time_s, ours.time_s, atol=1e-6, rtol=0)
            np.testing.assert_allclose(theirs.values, ours.values, atol=1e-6, rtol=0)
    assert (again.reference is None) == (walk.reference is None)
    if walk.reference is not None and again.reference is not None:
        assert again.reference.origin_wgs84 == walk.reference.origin_wgs84
        np.testing.assert_allclose(again.reference.positions_xy, walk.reference.positions_xy, atol=1e-6)


def test_same_walk_same_bytes(walk, tmp_path):
    first, second = write_walk(walk, tmp_path / "a"), write_walk(walk, tmp_path / "b")
    third = write_walk(read_walk(first / "scans.csv"), tmp_path / "c")
    names = sorted(path.name for path in first.iterdir())
    for other in (second, third):
        assert sorted(path.name for path in other.iterdir()) == names
        assert all((first / name).read_bytes() == (other / name).read_bytes() for name in names)


def test_partners_of_an_earlier_walk_do_not_stay(walk, tmp_path):
    write_walk(walk, tmp_path / "out")
    bare = Walk(walk.name, walk.wifi)
    target = write_walk(bare, tmp_path / "out")
    assert [path.name for path in target.iterdir()] == ["scans.csv"]


def test_samples_of_one_time_keep_their_number(walk, tmp_path):
    twice = Signal([0, 0, 1], [[1, 0, 0], [2, 0, 0], [3, 0, 0]])
    inertial = replace(indoor_inertial(), accelerometer=twice, gyroscope=Signal([0], [[4, 4, 4]]))
    target = write_walk(replace(walk, inertial=inertial), tmp_path / "out")
    again = read_walk(target / "scans.csv").inertial
    assert again is not None
    np.testing.assert_array_equal(again.accelerometer.values, twice.values)
    np.testing.assert_array_equal(again.gyroscope.values, [[4, 4, 4]])


def indoor_inertial():
    from radioslam.walk import Inertial

    return Inertial(Signal([0], [[0, 0, 9.81]]))


@pytest.mark.parametrize("name", ["", "..", "a/b"])
def test_a_name_that_is_no_folder(walk, tmp_path, name):
    with pytest.raises(ValueError, match="expected a walk name"):
        write_walk(replace(walk, name=name), tmp_path)
