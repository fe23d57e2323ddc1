"""Health, coverage, export, merging and georeference of radio maps, and their commands."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from typer.testing import CliRunner

from radioslam.cli import app
from radioslam.config import load_config
from radioslam.coverage import cover, walk_next
from radioslam.errors import ResultError
from radioslam.formats import read_walks
from radioslam.georeference import georeferenced, parse_point, to_wgs84
from radioslam.heat_maps import heat_map_figure
from radioslam.map_export import export_map, merge
from radioslam.map_geojson import geojson
from radioslam.map_health import find_unhealthy, locally_administered, trust
from radioslam.radio_map import RadioMap
from radioslam.slam import map_walks
from tests.radio import hall, scan_of

SAMPLES, TRUTH = hall(np.random.default_rng(0), 300)


def with_access_point(positions_xy, strong):
    """A corridor of 12 walks, heard strongly in the rows ``strong``."""
    n = len(positions_xy)
    rss = sparse.csr_array(np.where(strong, -45.0, 0.0)[:, None])
    poses = np.column_stack([positions_xy, np.zeros(n)])
    walk = np.arange(n) // (n // 12)
    names = tuple(f"w{k:02}" for k in range(12))
    return RadioMap(names, walk, np.arange(float(n)), poses, np.ones(n), np.zeros(n, int), rss, ("ap",))


CORRIDOR = np.tile(np.column_stack([np.arange(0, 120, 4.0), np.zeros(30)]), (12, 1))
NUMBER = np.arange(len(CORRIDOR)) // 30


@pytest.mark.parametrize(
    ("kind", "strong"),
    [
        ("moved", np.abs(CORRIDOR[:, 0] - np.where(NUMBER < 6, 10, 100)) < 6),
        ("travels", NUMBER == 3),
        ("vanished", (np.abs(CORRIDOR[:, 0] - 60) < 6) & (NUMBER < 4)),
    ],
)
def test_unhealthy_access_points_are_found_with_their_reason(kind, strong):
    (finding,) = find_unhealthy(with_access_point(CORRIDOR, strong))
    assert finding.kind == kind
    assert finding.reason


@pytest.mark.parametrize("reach_m", [6, 60])
def test_an_access_point_that_stays_is_healthy_however_far_it_is_strong(reach_m):
    assert not find_unhealthy(with_access_point(CORRIDOR, np.abs(CORRIDOR[:, 0] - 60) < reach_m))


def test_clocks_that_all_begin_at_zero_tell_no_earlier_and_later():
    moved = with_access_point(CORRIDOR, np.abs(CORRIDOR[:, 0] - np.where(NUMBER < 6, 40, 70)) < 6)
    assert [finding.kind for finding in find_unhealthy(moved)] == ["moved"]
    assert not find_unhealthy(replace(moved, time_s=moved.time_s % 30))


@pytest.mark.real_data
def test_no_access_point_of_a_mall_is_set_aside_until_one_is_moved(data_folder):
    """Two access points of one name, one heard by the earlier walks, the other by the later ones."""
    samples = map_walks(
        read_walks([data_folder / "indoor-location-20" / "site1" / "F4"]),
        load_config(overrides=["merging.starts=known", "optimizer.standard_deviations=false"], environment={}),
    ).radio_map
    assert not find_unhealthy(samples)
    one, other = (samples.transmitters.index(name) for name in ("1e:74:9c:2e:ad:eb", "1e:74:9c:2e:b0:a3"))
    late = samples.time_s > np.median(samples.time_s)
    columns = samples.rss_dbm.tolil()
    columns[late, one] = columns[late, other]
    moved = replace(samples, rss_dbm=columns.tocsr())
    assert [finding.transmitter for finding in find_unhealthy(moved)] == [samples.transmitters[one]]


def test_local_addresses_are_weighed_not_dropped():
    assert locally_administered("02:00:00:00:00:01")
    assert not locally_administered("00:1a:2b:3c:4d:5e")
    assert not locally_administered("ap7")
    assert np.all(trust(SAMPLES, (), 0.5) == 0.5)


def test_the_strongest_access_point_is_mostly_the_nearest():
    coverage = cover(SAMPLES)
    inside = np.all((coverage.positions_xy > 2) & (coverage.positions_xy < [38, 28]), axis=1)
    nearest = TRUTH(coverage.positions_xy).argmax(axis=1)
    assert np.mean(coverage.strongest[inside] == nearest[inside]) > 0.7


def test_one_should_walk_where_nobody_was():
    left = SAMPLES.select(SAMPLES.poses[:, 0] < 20)
    assert all(min(abs(x), abs(y), abs(y - 30), 20 - x) < 8 for x, y, _ in walk_next(left))


def test_maps_are_merged_and_later_walks_win():
    other = replace(hall(np.random.default_rng(1), 100)[0], walks=tuple(f"new-{k}" for k in range(8)))
    both = merge([SAMPLES, other])
    assert len(both) == 400
    again = merge([both, SAMPLES])
    assert len(again) == 400
    assert again.transmitters == SAMPLES.transmitters


def test_merged_floors_survive_saving(tmp_path):
    merge([SAMPLES, SAMPLES], ["0", "1"]).save(tmp_path / "m.parquet")
    loaded = RadioMap.load(tmp_path / "m.parquet")
    assert set(loaded.floor_of_sample) == {"0", "1"}
    with pytest.raises(ResultError, match="expected a floor for each of 2 maps, found 1"):
        merge([SAMPLES, SAMPLES], ["0"])


POINTS = ["0,0,53.0,71.0", "40,0,53.0,71.000597", "0,30,53.00027,71.0"]


def test_a_georeferenced_map_knows_latitude_and_longitude(tmp_path):
    tied = georeferenced(SAMPLES, [parse_point(text) for text in POINTS])
    np.testing.assert_allclose(to_wgs84(tied, np.array([[40.0, 0.0]])), [[53.0, 71.000597]], atol=3e-6)
    longitude, latitude = geojson(tied)["features"][0]["geometry"]["coordinates"]
    assert (round(latitude), round(longitude)) == (53, 71)
    tied.save(tmp_path / "m.parquet")
    assert RadioMap.load(tmp_path / "m.parquet").georeference == tied.georeference


@pytest.mark.parametrize(
    ("points", "message"),
    [(POINTS[:1], "two or more"), ([POINTS[0], "40,0,71.0,53.0"], "check the order"), (["1,2"], "X,Y,LAT,LON")],
)
def test_bad_known_points_are_one_clear_error(points, message):
    with pytest.raises(ResultError, match=message):
        georeferenced(SAMPLES, [parse_point(text) for text in points])


def test_exports_hold_every_reading(tmp_path):
    for kind in ("csv", "geojson", "parquet", "png"):
        export_map(SAMPLES, tmp_path / f"m.{kind}")
    with (tmp_path / "m.csv").open() as file:
        assert len(list(csv.DictReader(file))) == SAMPLES.rss_dbm.nnz
    page = json.loads((tmp_path / "m.geojson").read_text())
    assert page["frame"] == "local metres"
    samples = [f["properties"] for f in page["features"] if f["properties"]["kind"] == "sample"]
    assert sum(len(sample["rssi_dbm"]) for sample in samples) == SAMPLES.rss_dbm.nnz
    assert (tmp_path / "m.png").stat().st_size > 10_000
    with pytest.raises(ResultError, match="expected an ending"):
        export_map(SAMPLES, tmp_path / "m.xls")


def test_the_reports_heat_map_has_a_chooser():
    assert len(heat_map_figure(SAMPLES).layout.updatemenus[0].buttons) == len(SAMPLES.transmitters)


def test_the_commands_locate_and_merge(tmp_path):
    SAMPLES.save(tmp_path / "m.parquet")
    (tmp_path / "scan.json").write_text(json.dumps(scan_of(SAMPLES, 3)))
    answer = CliRunner().invoke(app, ["locate", str(tmp_path / "m.parquet"), str(tmp_path / "scan.json")])
    assert json.loads(answer.stdout)["here"]
    files = [str(tmp_path / name) for name in ("m.parquet", "m.parquet")]
    done = CliRunner().invoke(app, ["merge-maps", *files, "--out", str(tmp_path / "both.parquet"), "--floors", "0,1"])
    assert done.exit_code == 0
    assert len(RadioMap.load(tmp_path / "both.parquet")) == 2 * len(SAMPLES)
    for command in ("health", "coverage"):
        assert CliRunner().invoke(app, [command, str(tmp_path / "m.parquet")]).exit_code == 0
