"""Sweeps over settings, presets and seeds, on a small simulated crowd."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from radioslam import experiments
from radioslam.config import load_config
from radioslam.errors import ConfigError
from radioslam.evaluation import evaluate
from radioslam.experiments import EXPERIMENTS, Runs, gather, only, run, source_of
from radioslam.formats import write_walk
from radioslam.images import save_sweep_png
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from tests.crowds import office_walks

THRESHOLDS = only(EXPERIMENTS["rss-threshold"], ["-90", "-45", "odometry"])


@pytest.fixture(scope="module")
def outcomes():
    return run(THRESHOLDS, Runs(source_of(["office"]), seeds=(1, 2), jobs=2))


def test_every_preset_variant_and_seed_is_run_in_order(outcomes):
    keys = [(o.preset, o.variant, o.seed) for o in outcomes]
    assert keys == [(p, v, s) for p in ("paper", "default") for v in ("-90", "-45", "odometry") for s in (1, 2)]


def test_a_run_gives_the_figures_of_mapping_by_hand(outcomes):
    settings = ["merging.starts=common", "fingerprints.rss_threshold_dbm=-90"]
    result = map_walks(simulate("office", seed=2), load_config("default", overrides=settings, environment={}))
    figures = next(o.figures for o in outcomes if (o.preset, o.variant, o.seed) == ("default", "-90", 2))
    assert figures["mean"] == evaluate(result).total.errors["estimate"].mean
    assert figures["loops"] == len(result.loops.kept)
    assert figures["bssids"] == pytest.approx(np.diff(result.radio_map.rss_dbm.indptr).mean())


def test_odometry_alone_does_not_depend_on_the_preset(outcomes):
    means = {(o.preset, o.seed): o.figures["mean"] for o in outcomes if o.variant == "odometry"}
    assert means["paper", 1] == means["default", 1]
    assert means["paper", 1] != means["paper", 2]


def test_stages_add_up_to_the_seconds(outcomes):
    figures = outcomes[0].figures
    stages = ("training_s", "closure_s", "screening_s", "optimization_s")
    assert figures["seconds"] == pytest.approx(sum(figures[name] for name in stages))


def test_the_spread_is_that_over_the_seeds(outcomes):
    means = {(preset, variant): figures for preset, variant, figures in gather(THRESHOLDS, outcomes)}
    values = [o.figures["mean"] for o in outcomes if (o.preset, o.variant) == ("default", "-90")]
    assert means["default", "-90"]["mean"] == (pytest.approx(np.mean(values)), pytest.approx(np.std(values)))


def test_nothing_heard_above_the_threshold_leaves_odometry():
    deaf = run(
        experiments.Experiment(
            "rss", "", (experiments.Variant("-1", ("fingerprints.rss_threshold_dbm=-1",)),), ("mean",)
        ),
        Runs(source_of(["office"]), ("default",), (1,), jobs=1),
    )
    assert deaf[0].figures["loops"] == 0
    assert deaf[0].figures["mean"] > 2.0


def test_the_papers_rows_stand_beside_ours_on_the_campus_only(outcomes):
    office = experiments.markdown(THRESHOLDS, source_of(["office"]), outcomes)
    campus = experiments.markdown(THRESHOLDS, source_of(["campus"]), outcomes)
    assert "*the paper*" not in office
    assert "| *the paper* | -70 | 1.74 | 0.89 |" in campus
    assert len(re.findall(r"^\| default \|", office, re.MULTILINE)) == 3


def test_every_run_is_a_row_of_the_csv(outcomes, tmp_path: Path):
    experiments.write_csv(outcomes, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(outcomes)
    assert float(rows[0]["mean"]) == outcomes[0].figures["mean"]


def test_the_sweep_is_drawn(outcomes, tmp_path: Path):
    save_sweep_png(THRESHOLDS, outcomes, tmp_path / "t.png")
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


def test_recorded_walks_are_drawn_by_the_seed(tmp_path: Path):
    for walk in office_walks():
        write_walk(walk, tmp_path)
    source = source_of([str(tmp_path)])
    drawn = [[walk.name for walk in source.make(seed, 3)] for seed in range(4)]
    assert all(len(set(names)) == 3 for names in drawn)
    assert drawn[0] == [walk.name for walk in source.make(0, 3)]
    assert len(set(map(tuple, drawn))) > 1
    assert len(source.make(0, None)) == len(office_walks())


def test_unknown_data_and_values_are_named():
    with pytest.raises(ConfigError, match="nowhere"):
        source_of(["nowhere"])
    with pytest.raises(ConfigError, match="-91"):
        only(EXPERIMENTS["rss-threshold"], ["-91"])


def test_every_experiment_of_the_paper_has_its_values():
    labels = ["-90", "-80", "-70", "-60", "-50", "-45", "odometry"]
    assert [v.label for v in EXPERIMENTS["rss-threshold"].variants] == labels
    thresholds = [float(v.label) for v in EXPERIMENTS["similarity-threshold"].variants]
    assert thresholds[0] == 0.98
    assert thresholds[-1] == 0.1
    assert [v.walks for v in EXPERIMENTS["crowd-size"].variants] == [4, 10, 20, 40]
