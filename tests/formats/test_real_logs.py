"""The recordings that the package is measured on are read whole."""

import numpy as np
import pytest

from radioslam.formats import read_walk, read_walks, write_walk

pytestmark = pytest.mark.real_data


@pytest.mark.parametrize(
    ("folder", "walks", "readings", "beacon_walks"),
    [("F1", 106, 596_623, 105), ("F4", 109, 507_481, 97)],
)
def test_indoor_location(data_folder, folder, walks, readings, beacon_walks):
    read = read_walks([data_folder / "indoor-location-20" / "site1" / folder])
    assert len(read) == walks
    assert sum(walk.wifi.reading_count for walk in read) == readings
    assert sum(walk.ble is not None for walk in read) == beacon_walks
    assert {(walk.floor, walk.device, walk.notes) for walk in read} == {(folder, "OPPO PBCM10", ())}
    for walk in read:
        assert len(walk.inertial.accelerometer) == len(walk.inertial.rotation_vector)
        assert np.median(np.diff(walk.inertial.accelerometer.time_s)) == pytest.approx(0.02, abs=1e-3)
        assert np.all(walk.wifi.last_seen_s < walk.wifi.scan_time_s[walk.wifi.reading_scan])


def test_ipin(data_folder):
    walks = read_walks([data_folder / "ipin2023" / "floor0"])
    assert len(walks) == 20
    assert sum(walk.wifi.reading_count for walk in walks) == 23_228
    assert {walk.device for walk in walks} == {"samsung SM-A520F", "samsung SM-G930F"}
    assert {(walk.floor, walk.notes) for walk in walks} == {("0", ())}
    assert sum(len(walk.reference) for walk in walks) == 280
    assert {walk.reference.origin_wgs84 for walk in walks} == {(49.461316433032, 11.11096444258)}
    assert max(np.abs(walk.reference.positions_xy).max() for walk in walks) < 100


def test_wifine(data_folder):
    walks = read_walks([data_folder / "wifine"], check=False)
    assert len(walks) == 80
    assert sum(len(walk.wifi) for walk in walks) == 14_591
    assert {walk.floor for walk in walks} == {"0", "1"}


def test_a_real_walk_survives_the_open_format(data_folder, tmp_path):
    log = next((data_folder / "ipin2023" / "floor0").glob("*Trial01_repetition01*"))
    walk = read_walk(log)
    again = read_walk(write_walk(walk, tmp_path) / "scans.csv")
    np.testing.assert_allclose(again.wifi.rss_dbm, walk.wifi.rss_dbm)
    np.testing.assert_allclose(again.inertial.gyroscope.values, walk.inertial.gyroscope.values)
    np.testing.assert_allclose(again.reference.positions_xy, walk.reference.positions_xy, atol=1e-6)
