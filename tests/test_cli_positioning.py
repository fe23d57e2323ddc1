"""The commands that use a map, as people type them; bad input is one clear line and exit code 1."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from radioslam.formats import write_walk
from radioslam.radio_map import SCHEMA, RadioMap
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from tests.command_line import run
from tests.radio import STATIONS, hall, scan_of

SAMPLES, _ = hall(np.random.default_rng(0), 300)
POINTS = ("--point", "0,0,53.0,71.0", "--point", "40,0,53.0,71.000597", "--point", "0,30,53.00027,71.0")


@pytest.fixture(scope="module")
def hall_map(tmp_path_factory):
    path = tmp_path_factory.mktemp("hall") / "map.parquet"
    SAMPLES.save(path)
    return path


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    """A result of five walks in the frame of the office, and the folder of two new walks."""
    folder = tmp_path_factory.mktemp("office")
    for name, walks in (
        ("old", simulate("office", seed=1, walks=7)[:5]),
        ("new", simulate("office", seed=1, walks=7)[5:]),
    ):
        (folder / name).mkdir()
        for walk in walks:
            write_walk(walk, folder / name)
    return folder


@pytest.fixture
def mapped(office, capsys):
    out = office / "result"
    if not out.exists():
        assert run(capsys, "map", office / "old", "--starts", "known", "--out", out, "--quiet") == (0, "", "")
    return out


def refused(answer, *words):
    code, out, err = answer
    assert (code, out) == (1, "")
    assert len(err.splitlines()) == 1
    assert all(word in err for word in words), err


def test_a_walk_is_tracked_through_a_result(mapped, office, capsys):
    log = office / "new" / "office-05"
    code, out, _ = run(capsys, "track", mapped, log)
    rows = list(csv.DictReader(io.StringIO(out)))
    truth = next(walk for walk in simulate("office", seed=1, walks=7) if walk.name == "office-05").reference
    xy = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    errors = np.hypot(*(xy - truth.at(np.array([float(row["time_s"]) for row in rows]))).T)
    assert code == 0
    assert np.nanmedian(errors) < 4.0
    assert all(float(row["sigma_m"]) > 0 for row in rows)


def test_a_walk_of_another_building_is_not_tracked(hall_map, office, capsys):
    log = office / "new" / "office-05"
    refused(run(capsys, "track", hall_map, log), "expected scans that belong to the map", "is it of this place?")


def test_new_walks_are_mapped_into_a_result(mapped, office, tmp_path, capsys):
    code, out, _ = run(capsys, "map", office / "new", "--into", mapped, "--out", tmp_path / "both", "--json")
    rows = {row["name"]: row for row in json.loads(out)["walks"]}
    assert code == 0
    assert len(rows) == 7
    assert all(row["map"] == 0 for row in rows.values())
    assert rows["office-05"]["placed_sigma_m"] > 0
    assert rows["office-00"]["placed_sigma_m"] is None
    assert max(row["error"]["estimate"]["mean"] for row in rows.values()) < 5.0
    assert len(SlamResult.load(tmp_path / "both").walks) == 7


def test_into_a_map_starts_are_found_not_given(mapped, office, tmp_path, capsys):
    answer = run(capsys, "map", office / "new", "--into", mapped, "--starts", "known", "--out", tmp_path / "both")
    refused(answer, "expected --starts unknown", "--into")


def test_access_points_are_listed_with_place_and_health(hall_map, tmp_path, capsys):
    code, out, _ = run(capsys, "access-points", hall_map)
    assert code == 0
    assert f"{len(STATIONS)} access points" in out
    assert run(capsys, "access-points", hall_map, "--csv", tmp_path / "ap.csv") == (0, "", "")
    with (tmp_path / "ap.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["bssid"] for row in rows} == set(SAMPLES.transmitters)
    assert all(row["health"] == "good" for row in rows)
    for row in rows:
        station = STATIONS[SAMPLES.transmitters.index(row["bssid"])]
        assert row["position"] == "found"
        assert np.hypot(float(row["x_m"]) - station[0], float(row["y_m"]) - station[1]) < 3 * float(row["sigma_m"])


def test_every_kind_of_export(hall_map, tmp_path, capsys):
    for kind in ("csv", "geojson", "parquet", "png"):
        assert run(capsys, "export", hall_map, "--out", tmp_path / f"m.{kind}") == (0, "", "")
    assert len(RadioMap.load(tmp_path / "m.parquet")) == len(SAMPLES)
    assert len((tmp_path / "m.csv").read_text().splitlines()) == SAMPLES.rss_dbm.nnz + 1
    features = json.loads((tmp_path / "m.geojson").read_text())["features"]
    kinds = [feature["properties"]["kind"] for feature in features]
    assert (kinds.count("sample"), kinds.count("access point")) == (len(SAMPLES), len(STATIONS))


def test_the_field_is_exported_with_the_strongest_access_point_of_each_place(hall_map, tmp_path, capsys):
    for kind in ("csv", "geojson"):
        assert run(capsys, "export", hall_map, "--form", "field", "--out", tmp_path / f"f.{kind}") == (0, "", "")
    with (tmp_path / "f.csv").open() as file:
        strongest = [row for row in csv.DictReader(file) if row["strongest"] == "1"]
    places = np.array([[float(row["x_m"]), float(row["y_m"])] for row in strongest])
    assert len(np.unique(places, axis=0)) == len(places)
    inside = np.all((places > 2) & (places < [38, 28]), axis=1)
    nearest = np.hypot(*(places[:, None] - STATIONS[None]).transpose(2, 0, 1)).argmin(axis=1)
    named = [SAMPLES.transmitters.index(row["transmitter"]) for row in strongest]
    assert np.mean((named == nearest)[inside]) > 0.7
    features = json.loads((tmp_path / "f.geojson").read_text())["features"]
    told = [f["properties"]["strongest"] for f in features if f["properties"]["kind"] == "place"]
    assert sum(name is not None for name in told) == len(strongest)


def test_a_heat_map_is_of_the_chosen_access_point_and_form(hall_map, tmp_path, capsys):
    pictures = set()
    for name in SAMPLES.transmitters[:2]:
        for form in ("samples", "field"):
            out = tmp_path / f"{name[-1]}-{form}.png"
            assert run(capsys, "export", hall_map, "--ap", name, "--form", form, "--out", out) == (0, "", "")
            pictures.add(out.read_bytes())
    assert len(pictures) == 4


def test_exports_that_make_no_sense_are_refused_and_write_nothing(hall_map, tmp_path, capsys):
    def export(name, *options):
        return run(capsys, "export", hall_map, "--out", tmp_path / name, *options)

    refused(export("m.png", "--ap", "aa:bb"), "expected an access point of the map, found 'aa:bb'")
    refused(export("m.xls"), "expected an ending of .parquet, .csv, .geojson, .png")
    refused(export("m.parquet", "--form", "field"), "--form samples")
    refused(export("m.csv", "--form", "fields"), "unknown form 'fields'")
    refused(export("nowhere/m.csv"), "could not be written")
    assert not list(tmp_path.iterdir())


def test_georeference_and_export_in_degrees(hall_map, tmp_path, capsys):
    tied = tmp_path / "tied.parquet"
    assert run(capsys, "georeference", hall_map, *POINTS, "--out", tied) == (0, "", "")
    assert run(capsys, "export", tied, "--out", tmp_path / "m.geojson") == (0, "", "")
    page = json.loads((tmp_path / "m.geojson").read_text())
    degrees = np.array([feature["geometry"]["coordinates"] for feature in page["features"]])
    assert page["frame"] == "WGS84"
    np.testing.assert_allclose(degrees, [[71.0, 53.0]] * len(degrees), atol=0.001)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (POINTS[:2], "two or more"),
        ((*POINTS[:2], "--point", "40,0,71.0,53.0"), "check the order"),
        (("--point", "1,2"), "X,Y"),
    ],
)
def test_known_points_that_cannot_be_are_refused(points, message, hall_map, tmp_path, capsys):
    refused(run(capsys, "georeference", hall_map, *points, "--out", tmp_path / "t.parquet"), message)
    assert not list(tmp_path.iterdir())


# Bad scans -------------------------------------------------------------------------------------------------------


def locate(capsys, map_path, folder, text):
    (folder / "scan.json").write_text(text)
    return run(capsys, "locate", map_path, folder / "scan.json")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{}", ("expected at least one access point, found none", "scan again")),
        ('{"aa": 67}', ("expected RSS in [-127, 0) dBm, found 67", "such as -67")),
        ('{"aa": 2e-07}', ("expected RSS in [-127, 0) dBm, found 2e-07", "dBm, such as -67")),
        ('{"aa": NaN}', ("expected RSS in [-127, 0) dBm, found nan",)),
        ('{"aa": null}', ("scan.json: expected JSON of access point -> RSS in dBm",)),
        ('["aa", -50]', ("scan.json: expected JSON",)),
        ('{"aa": -50', ("scan.json: expected JSON",)),
    ],
)
def test_what_is_no_scan_is_refused(text, words, hall_map, tmp_path, capsys):
    refused(locate(capsys, hall_map, tmp_path, text), *words)


def test_unknown_access_points_only_are_not_here(hall_map, tmp_path, capsys):
    code, out, _ = locate(capsys, hall_map, tmp_path, '{"aa:bb": -50, "cc:dd": -60}')
    answer = json.loads(out)
    assert code == 0
    assert not answer["here"]
    assert answer["reason"] == "not here: no access point in common with the map"


# Bad maps --------------------------------------------------------------------------------------------------------


@pytest.fixture(params=["cut short", "newer", "other table", "no table", "missing"])
def bad_map(request, hall_map, tmp_path):
    path, whole = tmp_path / "bad.parquet", hall_map.read_bytes()
    table = pq.read_table(hall_map)
    if request.param == "cut short":
        path.write_bytes(whole[: len(whole) // 2])
    elif request.param == "newer":
        pq.write_table(table.replace_schema_metadata({"radioslam_radio_map": "3"}), path)
    elif request.param == "other table":
        pq.write_table(table.select(SCHEMA.names[:2]).replace_schema_metadata(None), path)
    elif request.param == "no table":
        path.write_text("walk,time_s\n")
    return path, request.param


def test_a_bad_map_is_refused_by_every_command(bad_map, office, tmp_path, capsys):
    path, what = bad_map
    (tmp_path / "scan.json").write_text(json.dumps(scan_of(SAMPLES, 3)))
    log = office / "new" / "office-05"
    expected = "found version 3; update radioslam" if what == "newer" else "a radio map"
    for command in (
        ("locate", path, tmp_path / "scan.json"),
        ("track", path, log),
        ("health", path),
        ("coverage", path),
        ("access-points", path),
        ("export", path, "--out", tmp_path / "m.csv"),
        ("merge-maps", path, "--out", tmp_path / "m.parquet"),
        ("georeference", path, *POINTS, "--out", tmp_path / "m.parquet"),
        ("map", office / "new", "--into", path, "--out", tmp_path / "both"),
    ):
        refused(run(capsys, *command), "bad.parquet", expected)
