"""Judging results, with evo as an outside oracle."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radioslam import evaluation_tables
from radioslam.errors import ResultError
from radioslam.evaluation import evaluate, load_references, with_references, write_tum_pairs
from radioslam.formats import write_tum
from radioslam.result_folder import write_references
from radioslam.walk import Reference
from tests.crowds import office_result


@pytest.fixture(scope="module")
def judged():
    return evaluate(office_result(starts="known"))


def test_the_total_is_that_of_the_summary(judged):
    error = office_result(starts="known").summary()["total"]["error"]
    assert judged.total.errors["estimate"].as_dict() == pytest.approx(error["estimate"])
    assert judged.total.errors["odometry"].as_dict() == pytest.approx(error["odometry"])
    assert judged.total.ratio == pytest.approx(error["estimate"]["mean"] / error["odometry"]["mean"])


def test_every_walk_has_a_row_and_the_scans_add_up(judged):
    assert [row.name for row in judged.rows] == list(office_result().walks)
    assert sum(row.scans for row in judged.rows) == judged.total.scans
    assert judged.total.scans + judged.without_truth == len(office_result().radio_map)


def test_a_reference_that_is_the_estimate_leaves_no_error():
    result = office_result(starts="known")
    samples = result.radio_map
    own = {
        name: Reference(samples.time_s[samples.walk == k], samples.poses[samples.walk == k, :2])
        for k, name in enumerate(result.walks)
    }
    total = evaluate(with_references(result, own), "none").total
    assert total.errors["estimate"].max == 0.0
    assert total.ratio == 0.0
    assert total.size_ratio["estimate"] == pytest.approx(1.0)
    assert total.segments["estimate"][10.0] == 0.0


def test_rigid_alignment_never_errs_more_in_the_square_than_none(judged):
    rigid = evaluate(office_result(starts="known"), alignment="rigid")
    assert rigid.total.errors["estimate"].rmse <= judged.total.errors["estimate"].rmse + 1e-9


def test_fixes_too_far_apart_are_not_interpolated():
    result = office_result(starts="known")
    sparse = tuple(Reference(r.time_s[::20], r.positions_xy[::20]) for r in result.references if r)
    result = replace(result, references=sparse)
    judged = evaluate(result, max_gap_s=0.5)
    assert evaluate(result, max_gap_s=30.0).total.scans > 100
    at_fixes = sum(
        np.isin(r.time_s, result.radio_map.time_s[result.radio_map.walk == k]).sum() for k, r in enumerate(sparse)
    )
    assert judged.total.scans == at_fixes


def test_a_walk_without_truth_has_no_row():
    result = office_result(starts="known")
    judged = evaluate(replace(result, references=(None, *result.references[1:])))
    assert [row.name for row in judged.rows] == list(result.walks[1:])


def test_no_truth_at_all_is_one_clear_error():
    result = office_result()
    with pytest.raises(ResultError, match="--reference"):
        evaluate(replace(result, references=(None,) * len(result.walks)))


def test_a_reference_of_a_stranger_is_one_clear_error():
    with pytest.raises(ResultError, match="nobody"):
        with_references(office_result(), {"nobody": Reference(np.zeros(1), np.zeros((1, 2)))})


def test_references_are_read_from_csv_tum_and_folders(tmp_path: Path):
    result = office_result(starts="known")
    fixes = {name: r for name, r in zip(result.walks, result.references, strict=True) if r}
    write_references(tmp_path / "r.csv", fixes.items())
    for name, r in fixes.items():
        write_tum(tmp_path / f"{name}.tum", r.time_s, np.column_stack([r.positions_xy, np.zeros(len(r))]))
    for source in (tmp_path / "r.csv", tmp_path):
        loaded = load_references(source, result.walks)
        assert evaluate(with_references(result, loaded)).total.errors["estimate"].mean == pytest.approx(
            evaluate(result).total.errors["estimate"].mean, abs=1e-5
        )
    alone = load_references(tmp_path / f"{result.walks[2]}.tum", result.walks)
    assert list(alone) == [result.walks[2]]


def test_a_reference_of_another_walk_is_refused(tmp_path: Path):
    write_tum(tmp_path / "stranger.tum", np.arange(3.0), np.zeros((3, 3)))
    with pytest.raises(ResultError, match="stranger"):
        load_references(tmp_path / "stranger.tum", office_result().walks)
    with pytest.raises(ResultError, match=r"WALK\.tum"):
        load_references(tmp_path, office_result().walks)


def test_a_reference_table_without_its_columns_is_refused(tmp_path: Path):
    (tmp_path / "r.csv").write_text("walk,t,x,y\na,1,2,3\n")
    with pytest.raises(ResultError, match="walk,time_s,x_m,y_m"):
        load_references(tmp_path / "r.csv", office_result().walks)


@pytest.mark.parametrize("source", ["estimate", "odometry"])
@pytest.mark.parametrize("alignment", ["none", "rigid"])
def test_evo_finds_the_same_errors(tmp_path: Path, source: str, alignment: str):
    """evo judges the written pairs without alignment of its own; its figures are printed to six decimals."""
    result = office_result(starts="known")
    judged = evaluate(result, alignment=alignment)
    write_tum_pairs(result, judged, tmp_path)
    name = result.walks[1]
    evo_ape = Path(sys.executable).with_name("evo_ape")
    done = subprocess.run(
        [evo_ape, "tum", tmp_path / "reference" / f"{name}.tum", tmp_path / source / f"{name}.tum"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "HOME": str(tmp_path)},
    )
    found = dict(re.findall(r"(\w+)\t([\d.]+)", done.stdout))
    errors = judged.rows[1].errors[source]
    for key in ("mean", "median", "std", "rmse", "max"):
        assert float(found[key]) == pytest.approx(getattr(errors, key), abs=5e-6), key


def test_markdown_has_a_line_per_walk_and_source(judged):
    lines = evaluation_tables.markdown(judged).splitlines()
    rows = [line for line in lines if line.startswith("| office") or line.startswith("| all")]
    assert len(rows) == 2 * (len(judged.rows) + 1)
    assert f"{judged.total.errors['estimate'].mean:.2f}" in rows[-1]


def test_latex_escapes_names():
    result = office_result(starts="known")
    odd = ("a_b%", *result.walks[1:])
    renamed = replace(result, radio_map=replace(result.radio_map, walks=odd))
    text = evaluation_tables.latex(evaluate(renamed))
    assert r"a\_b\%" in text
    assert text.count(r"\toprule") == text.count(r"\bottomrule") == 1
