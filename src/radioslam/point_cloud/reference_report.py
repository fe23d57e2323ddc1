"""One HTML page about reference paths, readable without network: the top view, and what was registered."""

from __future__ import annotations

import importlib.resources
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.plots import colour_of_walk, plain
from radioslam.point_cloud.reference import ReferenceResult
from radioslam.point_cloud.registration import ACCEPTED

Array = NDArray[np.float64]

CELL_M = 0.1
MOST_CELLS = 60_000


def write_report(result: ReferenceResult, summary: dict[str, Any], path: Path) -> None:
    """Write the page."""
    from plotly.offline import get_plotlyjs

    pages = importlib.resources.files("radioslam") / "pages"
    style, script = ((pages / name).read_text("utf-8") for name in ("report.css", "report.js"))
    title = "Reference paths"
    body = f"{_lead(summary)}\n{_top_view(result)}\n{_tables(summary)}"
    path.write_text(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,">\n<style>{style}</style>\n<script>{get_plotlyjs()}</script>\n</head>\n'
        f"<body>\n<header><h1>{title}</h1></header>\n<main>\n{body}\n</main>\n<script>{script}</script>\n</body>\n</html>\n",
        "utf-8",
    )


def _lead(summary: dict[str, Any]) -> str:
    tried = sum(counts["tried"] for counts in summary["loops"].values())
    accepted = sum(counts["accepted"] for counts in summary["loops"].values())
    text = (
        f"{len(summary['walks'])} walks with {sum(walk['clouds'] for walk in summary['walks'])} point clouds: "
        f"{accepted} of {tried} registrations of {summary['nodes']} clouds were accepted."
    )
    warnings = list(summary["warnings"])
    if not summary["converged"]:
        warnings.append("The optimization did not converge: take these paths with care.")
    if summary["parts"] > 1:
        warnings.append(f"{summary['parts']} parts are not tied to each other, each in a frame of its own.")
    return f'<p class="lead">{text}</p>\n' + "".join(f'<p class="warning">{escape(w)}</p>\n' for w in warnings)


def _top_view(result: ReferenceResult) -> str:
    from plotly.graph_objects import Figure

    figure = Figure(list(_traces(result)))
    axis = {"scaleanchor": "x", "title": "y (m)"}
    figure.update_layout(
        height=720, xaxis_title="x (m)", yaxis=axis, legend={"itemsizing": "constant"}, margin={"t": 20, "r": 10}
    )
    caption = (
        "From above: what the clouds hold between knee and head in dark grey, the paths in colour, odometry alone in "
        "grey, accepted registrations that are not neighbours along a walk in red. A click in the legend hides a layer."
    )
    drawn = figure.to_html(full_html=False, include_plotlyjs=False, config={"displaylogo": False})
    return (
        f'<section id="top"><h2>From above</h2>\n<figure>{drawn}<figcaption>{caption}</figcaption></figure></section>'
    )


def _traces(result: ReferenceResult) -> Iterator[Any]:
    from plotly.graph_objects import Scattergl

    x, y = occupied_cells(result).T
    yield Scattergl(x=x, y=y, mode="markers", name="clouds", marker={"size": 2, "color": "#667"}, hoverinfo="skip")
    for k, (recording, path) in enumerate(zip(result.recordings, result.paths, strict=True)):
        name = escape(plain(recording.name))
        for layer, T, style in (
            ("odometry", recording.T_odom_body, {"color": "#aaa", "width": 1}),
            (name, path, {"color": colour_of_walk(k), "width": 2}),
        ):
            label = f"{name}: odometry" if layer == "odometry" else name
            yield Scattergl(x=T[:, 0, 3], y=T[:, 1, 3], mode="lines", name=label, line=style)
    ends = _loop_ends(result)
    yield Scattergl(x=ends[:, 0], y=ends[:, 1], mode="lines", name="loops", line={"color": "#c22", "width": 1})


def _loop_ends(result: ReferenceResult) -> Array:
    """Lines (m, 2) from node to node with gaps between."""
    chosen = [a for a in result.attempts if a.reason == ACCEPTED and a.kind != "along the walk"]
    at = result.graph.T_map_body[:, :2, 3]
    return np.array([point for a in chosen for point in (at[a.i], at[a.j], [np.nan, np.nan])]).reshape(-1, 2)


def occupied_cells(result: ReferenceResult, cell_m: float = CELL_M) -> Array:
    """Middles (n, 2) of the cells of the plan with points of the clouds, floor and ceiling left out.

    What lies lower or higher than the sensor by more than 0.9 m is left out; cells are widened until there are no more
    than ``MOST_CELLS``.
    """
    nodes = result.nodes
    cells = []
    for T, mount, features in zip(result.graph.T_map_body, nodes.T_body_sensor, nodes.features, strict=True):
        sensor = T @ mount
        points = rigid.transform(sensor, features.surface.points)
        near = np.abs(points[:, 2] - sensor[2, 3]) < 0.9
        cells.append(np.unique(np.floor(points[near, :2] / cell_m), axis=0))
    found = np.unique(np.concatenate(cells), axis=0)
    return (found + 0.5) * cell_m if len(found) <= MOST_CELLS else occupied_cells(result, 2 * cell_m)


def _tables(summary: dict[str, Any]) -> str:
    header = ["walk", "clouds", "nodes", "length, m", "part", "odometry errs, m", "reference errs, m"]
    rows = []
    for walk in summary["walks"]:
        errors = walk["error_m"] or {}
        shown = [f"{errors[name]:.2f}" if name in errors else "–" for name in ("odometry", "reference")]
        rows.append([walk["name"], walk["clouds"], walk["nodes"], f"{walk['length_m']:.0f}", walk["part"], *shown])
    loops = [[kind, counts["tried"], counts["accepted"]] for kind, counts in summary["loops"].items()]
    rejected = [[reason, count] for reason, count in summary["rejected"].items()]
    return "\n".join(
        [
            _table("Walks", header, rows),
            _table("Registrations", ["pairs", "tried", "accepted"], loops),
            _table("Rejected", ["reason", "pairs"], rejected),
            _table("Left out", ["cloud"], [[text] for text in summary["skipped"]]) if summary["skipped"] else "",
        ]
    )


def _table(title: str, header: list[str], rows: list[list[Any]]) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>\n" for row in rows)
    return f"<section><h2>{title}</h2>\n<table><thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></section>"
