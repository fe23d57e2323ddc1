"""One HTML page about a mapping run, readable without network: figures, tables, and what to make of them.

Everything that a log could have brought in (names, paths, identities of access points) is escaped.
"""

from __future__ import annotations

import importlib.resources
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from radioslam.results import SlamResult
from radioslam.tables import untied_walks

ERROR_COLUMNS = {"mean": "mean", "median": "median", "p95": "95 %", "max": "max"}
LISTED_ACCESS_POINTS = 50


def write_report(result: SlamResult, path: Path, summary: Mapping[str, Any]) -> None:
    """Write the page.

    Args:
        result: what was found.
        path: the file, replaced if it exists.
        summary: what ``results.summarize`` tells; parts that are missing are left out.
    """
    from plotly.offline import get_plotlyjs

    title, pages = "RadioSLAM report", importlib.resources.files("radioslam") / "pages"
    style, script = ((pages / name).read_text("utf-8") for name in ("report.css", "report.js"))
    sections = (
        _lead,
        _facts,
        _paths,
        _uncertainty,
        _coverage,
        _heat_maps,
        _access_points,
        _walks,
        _run,
        _configuration,
    )
    body = "\n".join(section(result, summary) for section in sections)
    path.write_text(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,">\n<style>{style}</style>\n<script>{get_plotlyjs()}</script>\n</head>\n'
        f"<body>\n<header><h1>{title}</h1></header>\n<main>\n{body}\n</main>\n{_footer(summary)}\n"
        f"<script>{script}</script>\n</body>\n</html>\n",
        "utf-8",
    )


# In words -------------------------------------------------------------------------------------------------------


def _lead(result: SlamResult, summary: Mapping[str, Any]) -> str:
    total, loops = summary.get("total", {}), summary.get("loops", {})
    maps = len(summary.get("maps", [0]))
    became = "were joined into one map" if maps == 1 else f"fell into {maps} maps that nothing ties together"
    text = (
        f"{count(len(result.walks), 'walk')} with {count(len(result.radio_map), 'radio scan')} "
        f"over {length(total.get('length_m'))} {became}: {count(loops.get('kept'), 'loop')} of "
        f"{count(loops.get('candidates'), 'candidate')} say where people came to one place. "
        f"The positions have a mean standard deviation of {metres(total.get('sigma_m'))} per axis by the "
        f"method's own account. {_verdict(total.get('error'))}"
    )
    return f'<p class="lead">{text}</p>\n' + "".join(f'<p class="warning">{w}</p>\n' for w in _warnings(summary))


def _verdict(error: Mapping[str, Any] | None) -> str:
    if not error:
        return "The logs hold no true positions to compare with."
    estimate, odometry = error["estimate"]["mean"], error["odometry"]["mean"]
    against = f"Against the true positions in the logs it errs {metres(estimate)} on average"
    if estimate <= odometry:
        return f"{against}; odometry alone errs {metres(odometry)}."
    return f"{against}, which is more than the {metres(odometry)} of odometry alone."


def _warnings(summary: Mapping[str, Any]) -> Iterable[str]:
    if not summary.get("solver", {}).get("converged", True):
        yield "The optimization did not converge: take these paths with care, or allow more iterations."
    if untied := untied_walks(summary):
        yield f"Not tied to the largest map, each part in a frame of its own: {escape(', '.join(untied))}."
    for log in summary.get("skipped", []):
        yield f"Skipped: {escape(str(log.get('path')))}: {escape(str(log.get('reason')))}"


def _facts(result: SlamResult, summary: Mapping[str, Any]) -> str:
    total = summary.get("total", {})
    error = total.get("error") or {}
    facts = {
        "walks": number(len(result.walks)),
        "maps": number(len(summary.get("maps", [0]))),
        "walked": length(total.get("length_m")),
        "scans": number(len(result.radio_map)),
        "access points": number(summary.get("access_points")),
        "loops": number(summary.get("loops", {}).get("kept")),
        "mean error": metres(error.get("estimate", {}).get("mean")),
        "odometry alone": metres(error.get("odometry", {}).get("mean")),
    }
    items = "".join(f"<div><dt>{k}</dt><dd>{v}</dd></div>" for k, v in facts.items() if v != MISSING)
    return f'<dl class="facts">{items}</dl>'


# Figures --------------------------------------------------------------------------------------------------------


def _paths(result: SlamResult, summary: Mapping[str, Any]) -> str:
    from radioslam.plots import paths_figure

    caption = (
        "Each coloured line is a walk after optimization; grey is where odometry alone would put it; the thin black "
        "line (white on a dark page) is the true path, where the logs tell it. A click in the legend shows or hides "
        "a layer, a double click shows it alone; drag to zoom, double click in the plan to return. Loops join two "
        "scans that are taken for one place; σ is drawn as a circle of that radius."
    )
    return _section("paths", "Paths", _figure(paths_figure(result), caption))


def _uncertainty(result: SlamResult, summary: Mapping[str, Any]) -> str:
    from radioslam.plots import uncertainty_figure

    caption = (
        "How far apart two scans are, given how alike they are: the standard deviation that each loop gets. It was "
        "learned from pairs of scans of the same walk, near enough in time for odometry to be trusted; below, the "
        "number of such pairs. Where there were too few, the curve is taken from its neighbours."
    )
    return _section("uncertainty", "Uncertainty model", _figure(uncertainty_figure(result.uncertainty), caption))


def _coverage(result: SlamResult, summary: Mapping[str, Any]) -> str:
    from radioslam.plots import coverage_figure

    caption = (
        "The radio map along the walks. The menu chooses what is shown: how many access points a scan heard, the "
        "strongest of them, or one of those heard most. Grey points are scans that did not hear it."
    )
    return _section("coverage", "Radio coverage", _figure(coverage_figure(result), caption))


def _heat_maps(result: SlamResult, summary: Mapping[str, Any]) -> str:
    from radioslam.heat_maps import heat_map_figure

    if not result.radio_map.rss_dbm.nnz:
        return ""
    caption = "The strength that the map expects at any place, of the access point chosen in the menu."
    return _section("heat-maps", "Radio field", _figure(heat_map_figure(result.radio_map), caption))


def _figure(figure: Any, caption: str) -> str:
    height = figure.layout.height
    figure.layout.template = None  # Plotly's own colours do not follow the page's; it is also 7 kB each time
    # "<" would let a name end the script element; in JSON it stands only within texts.
    data = figure.to_json().replace("<", "\\u003c")
    return (
        f'<figure>\n<div class="plot" style="height:{height}px"></div>\n'
        f'<script type="application/json">{data}</script>\n<figcaption>{caption}</figcaption>\n</figure>'
    )


# Tables ---------------------------------------------------------------------------------------------------------


def _walks(result: SlamResult, summary: Mapping[str, Any]) -> str:
    walks, total = summary.get("walks", []), summary.get("total", {})
    hidden = set() if len(summary.get("maps", [])) > 1 else {"map"}
    hidden |= set() if any(row.get("placed_sigma_m") is not None for row in walks) else {"placed to"}
    hidden |= set() if any(row.get("error") for row in walks) else ERROR_COLUMNS.keys()

    def line(name: str, row: Mapping[str, Any]) -> str:
        return _row([name] + [cell for column, cell in _walk_cells(row) if column not in hidden])

    columns = [column for column, _ in _walk_cells({}) if column not in hidden]
    groups, plain = "", sum(column not in ERROR_COLUMNS for column in columns) + 1
    if plain <= len(columns):
        kinds = ("error of the estimate", "error of odometry alone")
        groups = "".join(f'<th class="group" colspan="{len(ERROR_COLUMNS)}">{kind}</th>' for kind in kinds)
        groups = f'<tr><td colspan="{plain}"></td>{groups}</tr>'
    head = groups + _row(["walk"] + [ERROR_COLUMNS.get(column, column) for column in columns], "th")
    body = "".join(line(_name_cell(result, row), row) for row in walks)
    table = f"<table><thead>{head}</thead><tbody>{body}</tbody><tfoot>{line('all walks', total)}</tfoot></table>"
    return _section("walks", "Walks", f'<div class="scroll" tabindex="0">{table}</div>')


def _name_cell(result: SlamResult, row: Mapping[str, Any]) -> str:
    from radioslam.plots import colour_of_walk

    name = str(row.get("name", ""))
    swatch = ""
    if name in result.walks:
        swatch = f'<span class="swatch" style="background:{colour_of_walk(result.walks.index(name))}"></span>'
    return f'<span class="name" title="{escape(name)}">{swatch}{escape(name)}</span>'


def _walk_cells(row: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(column, text) of a walk, but for its name."""
    error = row.get("error") or {}
    return [
        ("map", number(row.get("map"))),
        ("length", length(row.get("length_m"))),
        ("duration", duration(row.get("duration_s"))),
        ("scans", number(row.get("scans"))),
        ("loops", number(row.get("loops"))),
        ("mean σ", metres(row.get("sigma_m"))),
        ("placed to", metres(row.get("placed_sigma_m"))),
        *((key, metres(error.get(of, {}).get(key))) for of in ("estimate", "odometry") for key in ERROR_COLUMNS),
    ]


def _access_points(result: SlamResult, summary: Mapping[str, Any]) -> str:
    """Those heard most; all of them come from ``radioslam access-points``."""
    from radioslam.access_points import COLUMNS, as_rows
    from radioslam.heat_maps import most_heard

    rows = as_rows(most_heard(result.radio_map, LISTED_ACCESS_POINTS))
    if not rows:
        return ""
    titles = {"strongest_dbm": "strongest, dBm", "x_m": "x, m", "y_m": "y, m", "sigma_m": "σ, m"}
    columns = [name for name in COLUMNS if any(row[name] for row in rows)]
    head = _row([titles.get(name, name) for name in columns], "th")
    body = "".join(_row([escape(row[name]) for name in columns]) for row in rows)
    note = (
        f"<p>The {count(len(rows), 'access point')} heard most. Where each stands is estimated from how its strength "
        "falls with distance; σ is the standard deviation per axis.</p>"
    )
    table = f'<div class="scroll" tabindex="0"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'
    return _section("access-points", "Access points", note + table)


def _run(result: SlamResult, summary: Mapping[str, Any]) -> str:
    loops, solver = summary.get("loops", {}), summary.get("solver", {})
    rejected: Mapping[str, int] = loops.get("rejected", {})
    steps: Mapping[str, float] = summary.get("seconds", {})
    loop_rows = [["kept", number(loops.get("kept"))], *([escape(k), number(v)] for k, v in rejected.items())]
    step_rows = [[escape(k), seconds(v)] for k, v in steps.items()]
    status = {
        "converged": "yes" if solver.get("converged") else "no",
        "iterations": number(solver.get("iterations")),
        "cost before": significant(solver.get("cost_before")),
        "cost after": significant(solver.get("cost_after")),
        "time": seconds(solver.get("seconds")),
    }
    tables = (
        _table("Loop candidates", loop_rows, ["all", number(loops.get("candidates"))]),
        _table("Time per step", step_rows, ["all", seconds(sum(steps.values()))]),
        _table("Last optimization", [[k, v] for k, v in status.items()]),
    )
    return _section("run", "The run", f'<div class="columns">{"".join(f"<div>{t}</div>" for t in tables)}</div>')


def _configuration(result: SlamResult, summary: Mapping[str, Any]) -> str:
    text = escape(result.config.to_toml())
    inner = f"<details><summary>Effective configuration (TOML)</summary><pre><code>{text}</code></pre></details>"
    return _section("configuration", "Configuration", inner)


def _footer(summary: Mapping[str, Any]) -> str:
    parts = [f"{escape(str(k))} {escape(str(v))}" for k, v in summary.get("versions", {}).items()]
    if memory := summary.get("peak_memory_mb"):
        parts.append(f"peak memory {memory:,.0f} MB")
    return f"<footer><p>{' · '.join(parts)}</p></footer>"


def _section(identity: str, title: str, inner: str) -> str:
    return f'<section id="{identity}">\n<h2>{title}</h2>\n{inner}\n</section>'


def _row(cells: Sequence[str], element: str = "td") -> str:
    scope = ' scope="col"' if element == "th" else ""
    return "<tr>" + "".join(f"<{element}{scope}>{cell}</{element}>" for cell in cells) + "</tr>"


def _table(title: str, rows: Sequence[Sequence[str]], total: Sequence[str] = ()) -> str:
    foot = f"<tfoot>{_row(total)}</tfoot>" if total else ""
    body = "".join(_row(row) for row in rows)
    return f"<h3>{title}</h3><table><tbody>{body}</tbody>{foot}</table>"


# Numbers with units ---------------------------------------------------------------------------------------------

MISSING = "–"


def _or_missing(form: Callable[[float], str]) -> Callable[[float | None], str]:
    def show(value: float | None) -> str:
        return form(value) if value is not None and np.isfinite(value) else MISSING

    return show


number = _or_missing(lambda value: f"{value:,.0f}")
metres = _or_missing(lambda value: f"{value:.1f} m")
length = _or_missing(lambda value: f"{value / 1000:.2f} km" if value >= 1000 else f"{value:.0f} m")
seconds = _or_missing(lambda value: f"{value:.2f} s")
duration = _or_missing(lambda value: f"{int(value + 0.5) // 60}:{int(value + 0.5) % 60:02d} min")
significant = _or_missing(lambda value: f"{value:,.4g}")


def count(value: float | None, noun: str) -> str:
    """``1 walk``, ``2 walks``."""
    return f"{number(value)} {noun}{'' if value == 1 else 's'}"
