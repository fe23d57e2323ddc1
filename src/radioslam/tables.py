"""Tables for the terminal, from the dicts of ``summary.json``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from radioslam.walk import Walk


def summary_table(summary: Mapping[str, Any]) -> RenderableType:
    """A row per walk and the total; errors (m) of odometry alone beside the estimate where a reference exists."""
    has_errors = summary["total"]["error"] is not None
    table = Table(title="Walks", title_justify="left", header_style="bold")
    table.add_column("walk", overflow="fold")
    placed = any(row.get("placed_sigma_m") is not None for row in summary["walks"])
    columns = ["length m", "scans", "loops", "σ m", "map"] + (["placed σ m"] if placed else [])
    for name in columns + (["odometry m", "estimate m", "p95 m"] if has_errors else []):
        table.add_column(name, justify="right")
    for row in summary["walks"]:
        table.add_row(*_cells(row, has_errors, placed))
    table.add_section()
    table.add_row(*_cells(summary["total"], has_errors, placed), style="bold")
    return Group(table, *(Text(line) for line in _remarks(summary)))


def _cells(row: Mapping[str, Any], has_errors: bool, placed: bool) -> list[str]:
    number = "" if row["map"] is None else str(row["map"])
    cells = [escape(row["name"]), f"{row['length_m']:.0f}", str(row["scans"]), str(row["loops"])]
    cells += ["–" if row["sigma_m"] is None else f"{row['sigma_m']:.2f}", number]
    if placed:
        sigma_m = row.get("placed_sigma_m")
        cells.append("" if sigma_m is None else f"{sigma_m:.1f}")
    if has_errors and row["error"]:
        odometry, estimate = row["error"]["odometry"], row["error"]["estimate"]
        cells += [f"{odometry['mean']:.2f}", f"{estimate['mean']:.2f}", f"{estimate['p95']:.2f}"]
    return cells


def _remarks(summary: Mapping[str, Any]) -> list[str]:
    solver, loops = summary["solver"], summary["loops"]
    verdict = "converged" if solver["converged"] else "DID NOT CONVERGE"
    lines = [
        f"{summary['access_points']} access points; {loops['kept']} loops of {loops['candidates']} candidates; "
        f"optimizer {verdict} after {solver['iterations']} iterations",
        "seconds: " + ", ".join(f"{step} {seconds:.2f}" for step, seconds in summary["seconds"].items()),
    ]
    found = []
    if solver["radio_lag_s"] is not None:
        found.append(f"scans hold what was heard {solver['radio_lag_s']:.1f} s before")
    if solver["axis_rad"] is not None:
        found.append(f"the building's axes lie at {math.degrees(solver['axis_rad']):.0f}° from x")
    lines += ["; ".join(found)] if found else []
    if summary.get("peak_memory_mb"):
        lines.append(f"peak memory {summary['peak_memory_mb']:.0f} MB")
    if summary["untied"]:
        lines.append(
            f"not tied to the largest map, each part in a frame of its own: {'; '.join(untied_walks(summary))}"
        )
    lines += [f"skipped {skip['path']}: {skip['reason']}" for skip in summary["skipped"]]
    return lines


def untied_walks(summary: Mapping[str, Any]) -> list[str]:
    """Names of the walks that are not in the largest map, those of one reason together with it."""
    reason = {row["name"]: row.get("reason") or "" for row in summary.get("walks", [])}
    together: dict[str, list[str]] = {}
    for name in summary.get("untied") or []:
        together.setdefault(reason.get(name, ""), []).append(name)
    return [", ".join(names) + (f" ({why})" if why else "") for why, names in together.items()]


def walk_facts(walk: Walk) -> dict[str, Any]:
    """What is in a log: counts, durations, rates and gaps, ready for JSON."""
    import numpy as np

    inertial, scans = walk.inertial, walk.wifi
    streams = {"odometry": walk.odometry}
    for name in ("accelerometer", "gyroscope", "magnetometer", "rotation_vector"):
        streams[name] = getattr(inertial, name) if inertial else None
    gaps = np.diff(scans.scan_time_s)
    return {
        "name": walk.name,
        "device": walk.device,
        "floor": walk.floor,
        "duration_s": walk.duration_s,
        "scans": len(scans),
        "access_points": len(scans.transmitters),
        "readings": scans.reading_count,
        "readings_per_scan": scans.reading_count / max(len(scans), 1),
        "scan_interval_s": float(np.median(gaps)) if len(gaps) else None,
        "longest_scan_gap_s": float(gaps.max()) if len(gaps) else None,
        "beacons": len(walk.ble.transmitters) if walk.ble else 0,
        "streams": {name: _stream_facts(s) for name, s in streams.items() if s is not None and len(s) > 1},
        "reference_fixes": len(walk.reference) if walk.reference else 0,
        "notes": list(walk.notes),
    }


def _stream_facts(stream: Any) -> dict[str, float]:
    import numpy as np

    steps = np.diff(stream.time_s)
    return {"samples": len(stream), "rate_hz": float(1 / np.median(steps)), "longest_gap_s": float(steps.max())}


def facts_table(facts: Mapping[str, Any]) -> RenderableType:
    """One log's facts as a table of two columns."""
    table = Table(title=escape(str(facts["path"])), title_justify="left", show_header=False)
    for key in ("device", "floor"):
        table.add_row(key, escape(facts[key]) or "unknown")
    table.add_row("duration", f"{facts['duration_s']:.1f} s")
    scan = f"{facts['scans']}, {facts['readings_per_scan']:.1f} readings each"
    if facts["scan_interval_s"] is not None:
        scan += f", every {facts['scan_interval_s']:.1f} s, longest gap {facts['longest_scan_gap_s']:.1f} s"
    table.add_row("WiFi scans", scan)
    table.add_row("access points", str(facts["access_points"]))
    table.add_row("beacons", str(facts["beacons"]))
    for name, stream in facts["streams"].items():
        rate = f"{stream['samples']} samples, {stream['rate_hz']:.1f} Hz, longest gap {stream['longest_gap_s']:.2f} s"
        table.add_row(name.replace("_", " "), rate)
    table.add_row("reference fixes", str(facts["reference_fixes"]))
    for note in facts["notes"]:
        table.add_row("note", escape(note))
    return table


def formats_table(rows: list[tuple[str, str]]) -> RenderableType:
    """Name and title of every log format."""
    table = Table(title="Log formats (--format NAME; auto looks at the content)", title_justify="left")
    table.add_column("name", style="bold")
    table.add_column("what it is")
    for name, title in rows:
        table.add_row(name, escape(title))
    return table


def access_point_table(rows: Sequence[Mapping[str, str]]) -> RenderableType:
    """A row per access point, as ``access_points.as_rows`` gives them."""
    placed = sum(row["position"] == "found" for row in rows)
    table = Table(title=f"{len(rows)} access points, {placed} of known position", title_justify="left")
    for name in rows[0] if rows else ():
        table.add_column(name, justify="left" if name in ("bssid", "floor", "health", "position") else "right")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row.values()))
    return table


def written(folder: Path) -> str:
    """Where to look next."""
    return f"result in {folder}; open {folder / 'report.html'}"
