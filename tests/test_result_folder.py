from __future__ import annotations

import csv
import errno
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radioslam.config import Config
from radioslam.errors import ResultError
from radioslam.formats import read_tum
from radioslam.g2o import read_g2o
from radioslam.result_folder import check_target, whole_folder
from radioslam.results import SlamResult
from tests.crowds import office_result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return office_result().save(tmp_path_factory.mktemp("results") / "r", peak_memory_mb=123.0)


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_folder_holds_what_the_contract_says(folder):
    names = {path.name for path in folder.iterdir()}
    expected = {"trajectories.csv", "trajectories", "odometry.csv", "reference.csv", "loops.csv", "uncertainty.json"}
    assert names == expected | {"radio_map.parquet", "graph.g2o", "config.toml", "summary.json", "report.html"}


def test_trajectories_have_a_row_per_scan(folder):
    result, table = office_result(), rows(folder / "trajectories.csv")
    assert list(table[0]) == ["walk", "time_s", "x_m", "y_m", "heading_rad", "sigma_m", "map"]
    assert len(table) == len(result.radio_map)
    np.testing.assert_array_equal([float(row["x_m"]) for row in table], result.radio_map.poses[:, 0])


def test_tum_files_hold_the_same_poses(folder):
    samples = office_result().radio_map
    for k, name in enumerate(samples.walks):
        signal = read_tum(folder / "trajectories" / f"{name}.tum")
        np.testing.assert_allclose(signal.values, samples.poses[samples.walk == k], atol=1e-5)


def test_loops_name_walks_times_and_reasons(folder):
    table = rows(folder / "loops.csv")
    assert list(table[0]) == ["walk_i", "time_i_s", "walk_j", "time_j_s", "similarity", "sigma_m", "kept", "reason"]
    kept = [row for row in table if row["kept"] == "true"]
    assert len(kept) == len(office_result().loops.kept)
    assert all(row["reason"] == "" for row in kept)
    assert all(row["reason"] for row in table if row["kept"] == "false")


def test_the_graph_the_configuration_and_the_summary_can_be_read(folder):
    graph = read_g2o((folder / "graph.g2o").read_text())
    np.testing.assert_array_equal(graph.poses, office_result().graph.poses)
    assert Config.model_validate(tomllib.loads((folder / "config.toml").read_text())) == office_result().config
    assert json.loads((folder / "summary.json").read_text())["peak_memory_mb"] == 123.0


def test_an_existing_folder_needs_force(folder):
    before = (folder / "trajectories.csv").read_bytes()
    with pytest.raises(ResultError, match="--force"):
        office_result().save(folder)
    assert (folder / "trajectories.csv").read_bytes() == before


def earlier_result(tmp_path):
    target = tmp_path / "r"
    target.mkdir()
    (target / "summary.json").write_text("{}")
    (target / "old.txt").write_text("old")
    return target


def test_force_spares_what_others_wrote(tmp_path):
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "thesis.txt").write_text("precious")
    with pytest.raises(ResultError, match="other files"):
        office_result().save(tmp_path / "r", force=True)
    assert (tmp_path / "r" / "thesis.txt").read_text() == "precious"


def test_an_input_is_never_the_target(tmp_path):
    target = earlier_result(tmp_path)
    for source in (target, target / "old.txt", tmp_path / "r" / ".." / "r"):
        with pytest.raises(ResultError, match="apart from the input"):
            check_target(target, True, [source])


def test_a_swap_that_fails_puts_the_old_folder_back(tmp_path, monkeypatch):
    target = earlier_result(tmp_path)
    rename = Path.rename

    def refuse(self, other):
        if Path(other) == target and not self.name.endswith(".old"):
            raise OSError(errno.EIO, "Input/output error")
        return rename(self, other)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(ResultError, match="nothing was changed"):
        office_result().save(target, force=True)
    assert (target / "old.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


def test_force_replaces_the_folder_whole(tmp_path):
    target = earlier_result(tmp_path)
    office_result().save(target, force=True)
    assert not (target / "old.txt").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


@pytest.mark.parametrize("accident", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
def test_an_accident_while_writing_leaves_nothing_and_keeps_the_old(tmp_path, accident, monkeypatch):
    target = earlier_result(tmp_path)

    def strike(*_):
        raise accident

    monkeypatch.setattr("radioslam.g2o.write_g2o", strike)
    with pytest.raises((KeyboardInterrupt, ResultError)) as caught:
        office_result().save(target, force=True)
    if isinstance(accident, OSError):
        assert "No space left on device; nothing was changed" in str(caught.value)
    assert (target / "old.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


def test_a_folder_that_cannot_be_made_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match="could not be written"), whole_folder(tmp_path / "file" / "r", False):
        pass


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "r").write_text("mine")
    with pytest.raises(ResultError, match="found a file"):
        office_result().save(tmp_path / "r", force=True)
    assert (tmp_path / "r").read_text() == "mine"


@pytest.mark.parametrize("name", ["radio_map.parquet", "loops.csv", "summary.json", "graph.g2o", "odometry.csv"])
def test_a_damaged_result_is_one_clear_error(tmp_path, name):
    target = office_result().save(tmp_path / "r")
    content = (target / name).read_bytes()
    (target / name).write_bytes(content[: len(content) // 2])
    with pytest.raises(ResultError, match="expected"):
        SlamResult.load(target)


def test_what_is_no_result_is_one_clear_error(tmp_path):
    with pytest.raises(ResultError, match="expected a radio map"):
        SlamResult.load(tmp_path)


def test_names_with_commas_and_quotes_survive(tmp_path):
    result = office_result()
    odd = ('a,"b"', *result.walks[1:])
    renamed = replace(result, radio_map=replace(result.radio_map, walks=odd))
    assert SlamResult.load(renamed.save(tmp_path / "r")).walks == odd
