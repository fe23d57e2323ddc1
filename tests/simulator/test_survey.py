import pickle

import numpy as np
import pytest

from radioslam.errors import ConfigError
from radioslam.planar import path_length
from radioslam.simulator import SCENARIOS, simulate
from radioslam.simulator.calibration import PAPER_BSSIDS_PER_SCAN, bssids_per_scan, odometry_errors_m
from radioslam.walk import check_walk


@pytest.fixture(scope="module")
def campuses():
    return [simulate("campus", seed=seed) for seed in range(8)]


def identical(a, b):
    return pickle.dumps(a) == pickle.dumps(b)


def test_campus_has_the_papers_totals(campuses):
    for walks in campuses:
        assert [len(walk.wifi) for walk in walks] == [207, 170, 181, 190]
        assert sum(walk.duration_s for walk in walks) == pytest.approx(3740.0, abs=8.0)
        length = sum(path_length(walk.reference.positions_xy)[-1] for walk in walks)
        assert length == pytest.approx(1533.0, rel=0.01)
        assert len(set().union(*(walk.wifi.transmitters for walk in walks))) == 2211
        for walk in walks:
            np.testing.assert_allclose(np.diff(walk.wifi.scan_time_s), 5.0, atol=1e-6)
            np.testing.assert_allclose(np.diff(walk.odometry.time_s), 1.0, atol=1e-6)
            np.testing.assert_array_equal(walk.reference.positions_xy[0], walks[0].reference.positions_xy[0])


def test_campus_hears_as_many_bssids_as_the_paper(campuses):
    mean = np.mean([bssids_per_scan(walks) for walks in campuses], axis=0)
    np.testing.assert_allclose(mean, PAPER_BSSIDS_PER_SCAN, rtol=0.15)


def test_campus_tracker_errs_as_the_papers(campuses):
    errors = np.concatenate([odometry_errors_m(walk) for walks in campuses for walk in walks])
    assert 3.0 < errors.mean() < 7.0
    assert 10.0 < errors.max() < 45.0


@pytest.mark.parametrize("name", SCENARIOS)
def test_one_seed_gives_identical_walks_and_another_does_not(name):
    one, again, other = (simulate(name, seed=seed, walks=2) for seed in (7, 7, 8))
    assert identical(one, again)
    assert not identical(one, other)


@pytest.mark.parametrize("name", SCENARIOS)
def test_walks_can_be_mapped(name):
    for walk in simulate(name, seed=1, walks=2):
        check_walk(walk)
        assert walk.wifi.rss_dbm.max() < 0
        assert walk.reference.time_s[0] == walk.odometry.time_s[0]
        assert walk.odometry.time_s[-1] >= walk.wifi.scan_time_s[-1]
        np.testing.assert_array_equal(walk.odometry.values[0, :2], 0.0)


def test_more_walks_leave_the_first_ones_as_they_are():
    few, many = simulate("campus", seed=3), simulate("campus", seed=3, walks=6)
    assert [w.name for w in many] == [f"campus-{k:02d}" for k in range(6)]
    assert identical(few, many[:4])


def test_floors_devices_and_hours():
    walks = simulate("office", seed=2, walks=6, floors=2, devices=3, hours=10.0)
    assert [w.floor for w in walks] == ["F1", "F2"] * 3
    assert [w.device for w in walks] == ["phone-0", "phone-1", "phone-2"] * 2
    assert max(w.reference.time_s[0] for w in walks) > 2 * 3600.0
    upper = set(walks[1].wifi.transmitters) & set(walks[0].wifi.transmitters)
    assert upper, "access points are heard through a floor"


def test_a_floor_lies_between_its_storeys_and_the_next():
    walks = simulate("tower", seed=2, walks=6, floors=2)
    strength = [
        {
            name: walk.wifi.rss_dbm[walk.wifi.reading_transmitter == k].max()
            for k, name in enumerate(walk.wifi.transmitters)
        }
        for walk in walks
    ]
    same = [abs(strength[0][b] - strength[2][b]) for b in strength[0].keys() & strength[2].keys()]
    other = [abs(strength[0][b] - strength[1][b]) for b in strength[0].keys() & strength[1].keys()]
    assert np.mean(other) > np.mean(same) + 3.0


def test_scan_times_vary_where_the_phone_decides():
    gaps = np.diff(simulate("office", seed=1, walks=1)[0].wifi.scan_time_s)
    assert gaps.min() >= 3.0 - 1e-3
    assert gaps.max() <= 5.0 + 1e-3
    assert gaps.std() > 0.2


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"scenario": "castle"}, "expected one of office, campus, tower, found 'castle'"),
        ({"walks": 0}, "walks: expected at least 1, found 0"),
        ({"seed": -1}, "seed: expected at least 0, found -1"),
        ({"devices": -2}, "devices: expected at least 1, found -2"),
        ({"floors": 0}, "floors: expected at least 1, found 0"),
        ({"hours": 0.0}, "hours: expected a positive number, found 0.0"),
        ({"hours": float("nan")}, "hours: expected a positive number, found nan"),
    ],
)
def test_numbers_out_of_range_are_refused(wrong, message):
    with pytest.raises(ConfigError, match=message):
        simulate(**({"scenario": "office", "seed": 1} | wrong))
