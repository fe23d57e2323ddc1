from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.tables import summary_table
from tests.crowds import office_result, office_walks


def test_the_summary_is_json_and_counts_right():
    summary = json.loads(json.dumps(office_result().summary()))
    assert [row["name"] for row in summary["walks"]] == [walk.name for walk in office_walks()]
    assert summary["total"]["scans"] == sum(len(walk.wifi) for walk in office_walks())
    assert summary["loops"]["kept"] + sum(summary["loops"]["rejected"].values()) == summary["loops"]["candidates"]
    assert summary["untied"] == []
    assert summary["maps"] == [{"map": 0, "walks": [walk.name for walk in office_walks()]}]


def test_the_length_of_a_walk_is_what_its_odometry_says():
    walk = office_walks()[0]
    assert walk.odometry is not None
    steps = np.hypot(*np.diff(walk.odometry.values[:, :2], axis=0).T)
    assert office_result().summary()["walks"][0]["length_m"] == pytest.approx(steps.sum(), rel=0.05)


def test_errors_are_those_of_the_arrays():
    result = office_result(starts="known")
    errors = np.hypot(*(result.radio_map.poses[:, :2] - result.reference_xy).T)
    assert result.summary()["total"]["error"]["estimate"]["mean"] == pytest.approx(np.nanmean(errors))


def test_without_reference_there_are_no_errors():
    result = replace(office_result(), references=(None,) * len(office_result().walks))
    summary = result.summary()
    assert summary["total"]["error"] is None
    assert summary["total"]["size_ratio"] is None


def test_each_map_is_aligned_for_itself():
    result = office_result()
    maps = (result.radio_map.walk == 2).astype(np.int64)
    shifted = result.radio_map.poses.copy()
    shifted[maps == 1, :2] += 1000.0
    apart = replace(result, radio_map=replace(result.radio_map, poses=shifted, map=maps))
    errors = np.hypot(*(apart.aligned(shifted[:, :2], "start") - result.reference_xy).T)
    assert np.nanmax(errors) < 50.0


def test_a_result_is_loaded_as_it_was_saved(tmp_path):
    result = office_result()
    loaded = SlamResult.load(result.save(tmp_path / "r"))
    np.testing.assert_array_equal(loaded.radio_map.poses, result.radio_map.poses)
    np.testing.assert_array_equal(loaded.odometry_poses, result.odometry_poses)
    np.testing.assert_array_equal(loaded.reference_xy, result.reference_xy)
    np.testing.assert_array_equal(loaded.loops.pairs.i, result.loops.pairs.i)
    np.testing.assert_array_equal(loaded.loops.reason, result.loops.reason)
    np.testing.assert_array_equal(loaded.uncertainty.variance_m2, result.uncertainty.variance_m2)
    assert loaded.config == result.config
    assert loaded.solver == result.solver
    assert {**loaded.summary(), "seconds": None} == {**result.summary(), "seconds": None}


def test_a_result_without_standard_deviations_is_whole(tmp_path):
    config = load_config("default", overrides=["optimizer.standard_deviations=false"], environment={})
    result = map_walks(office_walks(), config)
    assert np.isnan(result.radio_map.sigma_m).all()
    np.testing.assert_array_equal(result.radio_map.poses, office_result().radio_map.poses)
    summary = json.loads(json.dumps(result.summary(), allow_nan=False))
    assert summary["total"]["sigma_m"] is None
    assert np.isnan(SlamResult.load(result.save(tmp_path / "r")).radio_map.sigma_m).all()
    summary_table(summary | {"skipped": []})
