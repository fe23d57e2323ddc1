"""What a map of walks with unknown starts tells outside: folder, table, page, evaluation, command line."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rich.console import Console

from radioslam import cli, evaluation_tables, tables
from radioslam.config import load_config
from radioslam.evaluation import evaluate
from radioslam.formats import write_walk
from radioslam.looks import ALONE
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.walk import Walk

from .crowds import office_result, short_walks


@cache
def walks() -> tuple[Walk, ...]:
    """Nine of one office, and one that hears nothing they hear."""
    *crowd, last = short_walks("office", 1, 40, 80.0, 30)[:10]
    strange = replace(last.wifi, transmitters=tuple("x" + name for name in last.wifi.transmitters))
    return (*crowd, replace(last, name="lost", wifi=strange))


@cache
def result() -> SlamResult:
    return map_walks(walks(), load_config(overrides=["merging.starts=unknown"], environment={}))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return result().save(tmp_path_factory.mktemp("found") / "r")


def test_the_summary_tells_confidence_and_reason_of_every_walk(folder):
    rows = {row["name"]: row for row in json.loads((folder / "summary.json").read_text())["walks"]}
    assert rows["lost"]["reason"] == ALONE
    assert rows["lost"]["placed_sigma_m"] is None
    tied = [row for name, row in rows.items() if name != "lost"]
    assert all(row["reason"] is None and row["placed_sigma_m"] >= 0 and row["map"] == 0 for row in tied)


def test_a_folder_read_again_is_the_same(folder):
    again = SlamResult.load(folder)
    assert again.untied_reason == result().untied_reason
    np.testing.assert_allclose(again.placed_sigma_m, result().placed_sigma_m)
    assert again.summary()["walks"] == result().summary()["walks"]


def test_results_whose_starts_were_given_say_nothing_of_it(tmp_path):
    again = SlamResult.load(office_result().save(tmp_path / "r"))
    assert again.placed_sigma_m == ()
    assert again.untied_reason == ()


def test_walks_that_are_not_tied_are_not_judged():
    evaluation = evaluate(result())
    assert (evaluation.tied, evaluation.walks) == (9, 10)
    assert "lost" not in [row.name for row in evaluation.rows]
    assert evaluation.as_dict()["tied"] == {"walks": 9, "of": 10}
    assert any("9 of 10 walks (90 %)" in line for line in evaluation_tables.remarks(evaluation))
    summary = result().summary()
    assert summary["total"]["error"]["estimate"]["mean"] == pytest.approx(evaluation.total.errors["estimate"].mean)


def test_the_table_tells_confidence_and_reason():
    console = Console(width=200)
    with console.capture() as capture:
        console.print(tables.summary_table(result().summary()))
    assert "placed σ m" in capture.get()
    assert f"lost ({ALONE})" in capture.get()


def test_the_page_tells_confidence_and_reason(folder):
    page = (folder / "report.html").read_text("utf-8")
    assert f"lost ({ALONE})" in page
    assert "placed to" in page


@pytest.mark.parametrize("starts", ["unknown", "mixed"])
def test_the_command_line_places_walks(starts, tmp_path, capsys, monkeypatch):
    for walk in walks():
        write_walk(walk, tmp_path / "logs")
    arguments = ["map", tmp_path / "logs", "--starts", starts, "--out", tmp_path / "r"]
    monkeypatch.setattr(sys, "argv", ["radioslam", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert not stop.value.code
    assert "optimizer converged" in capsys.readouterr().out
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert summary["alignment"] == {"unknown": "rigid", "mixed": "none"}[starts]
    assert "placement" in summary["seconds"]
