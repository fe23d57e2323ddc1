"""Positioning as an experiment: what is asked for is done, or refused."""

from __future__ import annotations

import csv

import pytest

from radioslam.experiments import Runs, only, source_of
from radioslam.into_experiment import INTO, run_into
from radioslam.positioning_experiment import POSITIONING, run_positioning
from radioslam.two_phones_experiment import run_two_phones, two_phones
from tests.command_line import run

OFFICE = source_of(["office"], "known")


def test_methods_and_seeds_are_those_asked_for():
    chosen = only(POSITIONING, ["knn", "locate surveyed"])
    outcomes = run_positioning(chosen, Runs(OFFICE, ("paper", "default"), (1, 2), jobs=1))
    asked = [(p, v, s) for p in ("paper", "default") for s in (1, 2) for v in ("knn", "locate surveyed")]
    assert [(o.preset, o.variant, o.seed) for o in outcomes] == asked
    figures = {(o.preset, o.variant, o.seed): o.figures for o in outcomes}
    assert figures["default", "knn", 1]["mean"] != figures["default", "knn", 2]["mean"]
    assert figures["default", "knn", 1]["mean"] != figures["paper", "knn", 1]["mean"]
    assert 0 < figures["default", "locate surveyed", 1]["inside %"] <= 100
    assert all(o.figures["median"] <= o.figures["p75"] <= o.figures["p95"] for o in outcomes)


def test_workers_change_nothing():
    chosen = only(POSITIONING, ["locate", "locate surveyed"])
    one, two = (run_positioning(chosen, Runs(OFFICE, ("default",), (1,), jobs=jobs)) for jobs in (1, 2))
    assert one == two
    ours, survey = one
    assert ours.figures["a/b"] == ours.figures["mean"] / survey.figures["mean"]


def test_each_phone_is_located_in_the_map_of_the_others():
    chosen = two_phones(OFFICE, seed=1)
    phones = {variant.label.rpartition(": ")[0] for variant in chosen.variants}
    outcomes = run_two_phones(chosen, Runs(OFFICE, ("default",), (1,), jobs=1))
    assert len(phones) == 2
    assert [o.variant for o in outcomes] == [variant.label for variant in chosen.variants]
    means = {o.variant: o.figures["mean"] for o in outcomes}
    assert all(means[f"{phone}: locate"] != means[f"{phone}: locate without offset"] for phone in phones)


def test_new_walks_are_judged_by_every_way_of_finding_them():
    outcomes = run_into(INTO, Runs(OFFICE, ("default",), (1,), jobs=1))
    figures = {o.variant: o.figures for o in outcomes}
    assert list(figures) == ["into", "mixed", "known"]
    assert figures["known"]["tied %"] == 100
    assert figures["known"]["mean"] < figures["into"]["mean"] < 8.0


def test_the_command_writes_what_other_experiments_write(tmp_path, capsys):
    options = ("--seeds", 1, "--presets", "default", "--values", "knn,knn surveyed", "--jobs", 1, "--out", tmp_path)
    assert run(capsys, "experiment", "positioning", "office", *options, "--quiet") == (0, "", "")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        f"positioning-office.{end}" for end in ("csv", "md", "png")
    ]
    with (tmp_path / "positioning-office.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["preset"], row["variant"], row["seed"]) for row in rows] == [
        ("default", "knn", "0"),
        ("default", "knn surveyed", "0"),
    ]
    assert "| default | knn surveyed |" in (tmp_path / "positioning-office.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("positioning", "office", "--values", "kmm"), "expected values of knn, knn surveyed, locate"),
        (("positions", "office"), "unknown experiment 'positions'"),
        (("two-phones", "campus", "--walks", "1"), "expected walks of two or more phones"),
    ],
)
def test_what_cannot_be_run_is_refused(arguments, message, capsys):
    code, out, err = run(capsys, "experiment", *arguments)
    assert (code, out) == (1, "")
    assert message in err
