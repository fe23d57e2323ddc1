"""A radio map of scans at known positions, and locating in it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.georeference import to_wgs84
from radioslam.positioning import Positioner
from radioslam.radio_map import RadioMap
from radioslam.surveying import survey_map
from radioslam.walk import Reference, Walk

from .builders import scans_of
from .command_line import run
from .crowds import office_walks

CONFIG = load_config().fingerprints


def walk_of(name, reference, floor="", times_s=(0.0, 5.0, 10.0)):
    rows = [(t, ap, -50.0 - k - j) for k, t in enumerate(times_s) for j, ap in enumerate(("a", "b"))]
    return Walk(name, scans_of(*rows), reference=reference, floor=floor)


def test_scans_lie_between_the_reference_positions():
    reference = Reference(np.array([0.0, 8.0]), np.array([[0.0, 0.0], [8.0, 4.0]]), sigma_m=2.0)
    one = survey_map([walk_of("w", reference), walk_of("v", None)], CONFIG)
    assert (one.walks, one.transmitters, one.georeference) == (("w",), ("a", "b"), None)
    np.testing.assert_allclose(one.poses, [[0, 0, 0], [5, 2.5, 0]])  # the third scan is after the last position
    np.testing.assert_array_equal(one.rss_dbm.toarray(), [[-50, -51], [-51, -52]])
    np.testing.assert_array_equal(one.sigma_m, [2, 2])


def test_floors_and_origin_are_kept(tmp_path):
    at = Reference(np.array([0.0, 10.0]), np.array([[0.0, 0.0], [10.0, 0.0]]), (48.1, 11.5))
    survey_map([walk_of("w", at, "0"), walk_of("v", at, "1")], CONFIG).save(tmp_path / "map.parquet")
    one = RadioMap.load(tmp_path / "map.parquet")
    assert [floor for floor, _ in one.by_floor()] == ["0", "1"]
    np.testing.assert_allclose(to_wgs84(one, np.zeros((1, 2))), [[48.1, 11.5]])


def test_what_is_no_survey():
    far = Reference(np.array([0.0, 5.0, 500.0]), np.zeros((3, 2)), (48.1, 11.5))
    with pytest.raises(MappingError, match="use `radioslam map`"):
        survey_map([walk_of("w", None), walk_of("v", far, times_s=(100.0, 200.0))], CONFIG)
    with pytest.raises(MappingError, match="expected references in one frame"):
        survey_map([walk_of("w", far), walk_of("v", replace(far, origin_wgs84=None))], CONFIG)


def test_strangers_are_located_in_a_survey():
    *others, stranger = (replace(walk, odometry=None, inertial=None) for walk in office_walks())
    positioner = Positioner.of(survey_map(others, CONFIG))
    truth = stranger.reference.at(stranger.wifi.scan_time_s)
    known = np.isfinite(truth[:, 0])
    found = positioner.locate_many(stranger.wifi.as_dicts())
    errors = [np.hypot(*(np.array(one.position_xy) - at)) for one, at in zip(found, truth, strict=True) if one.here]
    assert len(errors) > 0.8 * known.sum()
    assert np.median(errors) < 4


WIGLE_HEAD = "WigleWifi-1.6,brand=Google,model=Pixel 7\nMAC,FirstSeen,RSSI,CurrentLatitude,CurrentLongitude,Type\n"


@pytest.fixture
def wigle_logs(tmp_path):
    """Two walks to and fro along 60 m, past five access points."""
    rng = np.random.default_rng(0)
    for name in ("a", "b"):
        rows = []
        for k in range(30):
            away = np.abs(2.0 * k - np.arange(5) * 15) + 3
            rss = np.round(-40 - 25 * np.log10(away) + rng.normal(0, 2, 5))
            fix = f"48.1,{11.5 + 2.0 * k / 74_460:.8f}"
            rows += [
                f"20:23:00:00:00:0{j},2024-05-17 09:0{k // 12}:{5 * (k % 12):02},{rss[j]:g},{fix},WIFI"
                for j in range(5)
            ]
        (tmp_path / f"{name}.csv").write_text(WIGLE_HEAD + "\n".join(rows) + "\n")
    return tmp_path


def test_from_wigle_logs_to_positions_on_the_command_line(capsys, wigle_logs):
    target = wigle_logs / "map.parquet"
    code, out, _ = run(capsys, "survey", wigle_logs / "a.csv", "--out", target)
    assert (code, out) == (0, f"60 scans of 5 access points in {target}\n".replace("60", "30"))
    code, out, _ = run(capsys, "locate", target, wigle_logs / "b.csv")
    answers = [json.loads(line) for line in out.splitlines()]
    assert code == 0
    assert [one["time_s"] - answers[0]["time_s"] for one in answers[:3]] == [0, 5, 10]
    errors = [abs(one["position_xy"][0] - 2.0 * k) for k, one in enumerate(answers) if one["here"]]
    assert len(errors) > 25
    assert np.median(errors) < 4


def test_mapping_says_what_is_missing_and_simulated_odometry_fills_it(capsys, wigle_logs):
    code, _, err = run(capsys, "map", wigle_logs, "--starts", "known", "--out", wigle_logs / "result", "--quiet")
    assert code == 1
    assert "expected motion" in err
    assert "radioslam survey" in err
    options = ("--starts", "known", "--simulate-odometry", 1, "--out", wigle_logs / "result", "--quiet")
    assert run(capsys, "map", wigle_logs, *options)[0] == 0
