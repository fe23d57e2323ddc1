"""The summary of reference paths in a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def walks_table(summary: dict[str, Any]) -> Any:
    """A row per walk."""
    from rich.table import Table

    table = Table(title="Reference paths", title_justify="left")
    for name in ("walk", "clouds", "nodes", "length m", "part", "odometry m", "reference m"):
        table.add_column(name, justify="left" if name == "walk" else "right")
    for walk in summary["walks"]:
        errors = walk["error_m"] or {}
        shown = [f"{errors[name]:.2f}" if name in errors else "" for name in ("odometry", "reference")]
        part = "" if walk["part"] is None else str(walk["part"])
        table.add_row(walk["name"], str(walk["clouds"]), str(walk["nodes"]), f"{walk['length_m']:.0f}", part, *shown)
    return table


def loops_table(summary: dict[str, Any]) -> Any:
    """Registrations tried and accepted, by what proposed them."""
    from rich.table import Table

    table = Table(title="Registrations", title_justify="left")
    for name in ("pairs", "tried", "accepted"):
        table.add_column(name, justify="left" if name == "pairs" else "right")
    for kind, counts in summary["loops"].items():
        table.add_row(kind, str(counts["tried"]), str(counts["accepted"]))
    return table


def lines(summary: dict[str, Any]) -> Iterator[str]:
    """The rest in words."""
    rejected = ", ".join(f"{count} {reason}" for reason, count in summary["rejected"].items())
    yield f"rejected: {rejected or 'none'}"
    how = "in the plane" if summary["planar"] else "in space"
    yield f"optimizer {'converged' if summary['converged'] else 'DID NOT CONVERGE'} {how}"
    followed, clouds = (sum(walk[name] for walk in summary["walks"]) for name in ("followed", "clouds"))
    if followed:
        yield f"odometry corrected by {followed} of {clouds} clouds, against those before them"
    alone = [walk["name"] for walk in summary["walks"] if not walk["has_loops"] and not walk["followed"]]
    if alone:
        yield f"odometry alone, for nothing was registered: {', '.join(alone)}"
    if summary["parts"] > 1:
        yield f"{summary['parts']} parts that nothing ties together, each in a frame of its own"
    if summary["skipped"]:
        yield f"{len(summary['skipped'])} clouds left out, the first: {summary['skipped'][0]}"
    yield "seconds: " + ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in summary["seconds"].items())
