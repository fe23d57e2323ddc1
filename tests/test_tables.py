"""Tables for the terminal."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from radioslam import tables
from tests.crowds import office_result, office_walks


def printed(table: object) -> str:
    console = Console(width=200, file=None, record=True, quiet=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def test_every_walk_and_the_total_have_a_row_with_both_errors() -> None:
    summary = office_result(starts="known").summary()
    text = printed(tables.summary_table({**summary, "peak_memory_mb": 12.3}))
    total = summary["total"]
    assert all(walk.name in text for walk in office_walks())
    assert f"{total['error']['odometry']['mean']:.2f}" in text
    assert f"{total['error']['estimate']['mean']:.2f}" in text
    assert "peak memory 12 MB" in text


def test_without_truth_the_error_columns_go() -> None:
    bare = replace(office_result(), references=(None,) * len(office_walks()))
    assert "estimate" not in printed(tables.summary_table(bare.summary()))


def test_a_solver_that_gave_up_and_what_was_left_out_are_said() -> None:
    result = office_result()
    gave_up = replace(
        result,
        solver=replace(result.solver, converged=False),
        skipped=(("a.txt", "a.txt: expected scans, found none"),),
    )
    summary = {**gave_up.summary(), "untied": ["office-05"]}
    text = printed(tables.summary_table(summary))
    assert "DID NOT CONVERGE" in text
    assert "skipped a.txt" in text
    assert "not tied" in text
    assert "office-05" in text


def test_names_are_no_markup() -> None:
    result = office_result()
    odd = ("[bold]x[/bold]", *result.walks[1:])
    named = replace(result, radio_map=replace(result.radio_map, walks=odd))
    assert "[bold]x[/bold]" in printed(tables.summary_table(named.summary()))


def test_facts_tell_rates_and_gaps() -> None:
    walk = office_walks()[0]
    facts = tables.walk_facts(walk)
    assert facts["readings"] == walk.wifi.reading_count
    assert abs(facts["streams"]["odometry"]["rate_hz"] - 1.0) < 0.05
    text = printed(tables.facts_table({"path": "office-00", **facts}))
    assert "longest gap" in text
    assert str(len(walk.wifi)) in text
