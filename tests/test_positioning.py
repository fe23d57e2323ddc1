from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam.calibration import TEMPERATURES
from radioslam.errors import PositioningError
from radioslam.map_export import merge
from radioslam.positioning import Positioner, read_scan
from tests.radio import hall, scan_of

SAMPLES, _ = hall(np.random.default_rng(0), 400)
ASKED, _ = hall(np.random.default_rng(1), 200)


@pytest.fixture(scope="module")
def positioner():
    return Positioner.of(SAMPLES)


def errors(positioner, offset_db=0.0):
    answers = positioner.locate_many([scan_of(ASKED, k, offset_db) for k in range(len(ASKED))])
    xy = np.array([answer.position_xy or (np.nan, np.nan) for answer in answers])
    return np.hypot(*(xy - ASKED.poses[:, :2]).T), np.array([answer.radius_m for answer in answers])


def test_scans_are_located_better_than_by_nearest_neighbours(positioner):
    floor = positioner.floors[0]
    similarity = floor.neighbours.similarity(ASKED.rss_dbm, np.zeros(len(ASKED)))
    nearest = np.hypot(*(floor.neighbours.locate(similarity, 5) - ASKED.poses[:, :2]).T)
    assert np.nanmean(errors(positioner)[0]) < nearest.mean()


def test_the_promised_radius_holds(positioner):
    error, radius = errors(positioner)
    here = np.isfinite(error)
    assert here.mean() > 0.95
    assert 0.9 <= np.mean(error[here] <= radius[here]) <= 1.0


def test_the_offset_of_another_phone_hardly_matters(positioner):
    assert np.nanmean(errors(positioner, -5.0)[0]) < 1.5 * np.nanmean(errors(positioner)[0])


def test_a_location_names_the_access_points_used(positioner):
    scan = scan_of(SAMPLES, 5)
    location = positioner.locate(scan)
    assert set(location.access_points) == set(scan)
    assert location.as_dict()["here"]


def test_unknown_access_points_only_are_not_here(positioner):
    location = positioner.locate({"aa:bb": -50.0, "cc:dd": -60.0})
    assert not location.here
    assert location.reason == "not here: no access point in common with the map"
    assert location.as_dict() == {"here": False, "reason": location.reason}


def test_another_building_with_one_common_access_point_is_not_here(positioner):
    scan = {"aa:bb": -40.0, "cc:dd": -45.0, "ee:ff": -50.0, SAMPLES.transmitters[0]: -80.0}
    assert "1 of 4 access points known" in positioner.locate(scan).reason


@pytest.mark.parametrize("value", [float("nan"), 30.0, 0.0, -200.0, float("inf")])
def test_what_is_no_rss_is_refused(positioner, value):
    with pytest.raises(PositioningError, match="expected RSS in"):
        positioner.locate({"aa:bb": value})


def test_an_empty_scan_is_refused_before_the_work():
    with pytest.raises(PositioningError, match="scan 1: expected at least one access point, found none"):
        SAMPLES.locate({})


@settings(deadline=None)
@given(st.dictionaries(st.sampled_from(SAMPLES.transmitters), st.floats(-127, -0.01), min_size=1))
def test_any_scan_gets_an_answer_of_finite_numbers_or_a_reason(scan):
    location = _POSITIONER.locate(scan)
    assert location.reason or np.isfinite([*location.position_xy, *location.sigma_xy, location.radius_m]).all()


_POSITIONER = Positioner.of(SAMPLES)


def test_the_floor_is_decided_first():
    above = hall(np.random.default_rng(3), 300, prefix="02:00:00:00:01")[0]
    both = Positioner.of(merge([SAMPLES, above], ["0", "1"]))
    location = both.locate(scan_of(above, 7))
    assert location.floor == "1"
    assert location.floor_probability > 0.9


def test_a_file_that_is_no_scan_is_one_clear_error(tmp_path):
    path = tmp_path / "scan.json"
    path.write_text("[1, 2")
    with pytest.raises(PositioningError, match=r"scan\.json: expected JSON"):
        read_scan(path)


@pytest.mark.real_data
def test_strangers_in_the_museum_are_located_better_than_by_nearest_neighbours(data_folder):
    from radioslam.config import load_config
    from radioslam.formats import read_walks
    from radioslam.positioning_experiment import surveyed
    from radioslam.slam import map_walks

    settings = ["merging.starts=known", "optimizer.standard_deviations=false"]
    config = load_config(overrides=settings, environment={})
    samples = surveyed(map_walks(read_walks([data_folder / "ipin2023" / "floor0"]), config))
    rest, held = samples.select(samples.walk % 4 != 0), samples.select(samples.walk % 4 == 0)
    floor = Positioner.of(rest, config).floors[0]
    ours, _ = floor.candidates.moments(floor.candidates.tempered(held.rss_dbm, floor.calibration.temperature))
    nearest = floor.neighbours.locate(floor.neighbours.similarity(held.rss_dbm, np.zeros(len(held))), 5)
    error, baseline = (np.hypot(*(xy - held.poses[:, :2]).T).mean() for xy in (ours, nearest))
    assert error < 0.85 * baseline
    assert TEMPERATURES[0] < floor.calibration.temperature < TEMPERATURES[-1]
