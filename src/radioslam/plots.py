"""Interactive figures of a mapping run for the report (Plotly, imported late because it is slow to import).

Names of walks and access points are what users typed or what somebody's router says, so they are escaped here.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.accuracy import alignment_pose
from radioslam.results import ALIGNMENT_OF_STARTS, SlamResult
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Of middle lightness, so that they read on white and on black.
COLOURS = (
    "#3b7dd8",
    "#e8743b",
    "#1fa774",
    "#b0479a",
    "#c9a227",
    "#d64550",
    "#5a9bd4",
    "#8a6fdf",
    "#6b8e23",
    "#d4699e",
    "#2a9d9d",
    "#a0693b",
)
ODOMETRY_GREY = "#9a9a9a"
INK = "ink"
"""``meta`` of traces whose colour is that of the text, black or white; the page sets it."""

MOST_HEARD = 30
MANY_POINTS = 3000
"""Beyond so many points SVG gets slow and WebGL draws."""
MOST_CIRCLES = 3000
CIRCLE = np.append(np.exp(2j * np.pi * np.arange(17) / 16), np.nan)


def colour_of_walk(k: int) -> str:
    """The colour of walk number k, in every figure and table; it comes again every ``len(COLOURS)`` walks."""
    return COLOURS[k % len(COLOURS)]


def reference_in_map(result: SlamResult) -> Array:
    """The true positions (n, 2) in the frame of map 0, aligned as the errors are; NaN where unknown."""
    here = result.radio_map.map == 0
    walk = result.radio_map.walk[here]
    starts = np.concatenate([[True], walk[1:] != walk[:-1]])
    how = ALIGNMENT_OF_STARTS[result.config.merging.starts]
    pose = alignment_pose(result.radio_map.poses[here, :2], result.reference_xy[here], how, starts)
    return np.where(here[:, None], planar.transform(planar.inverse(pose), result.reference_xy), np.nan)


def line_rows(rows: Integers, walk: Integers) -> Integers:
    """``rows`` with -1 between two walks: indices into arrays that end with NaN, so that lines break there."""
    return np.insert(rows, np.flatnonzero(np.diff(walk[rows])) + 1, -1)


def with_gap(columns: Array) -> Array:
    """The rows and one more of NaN."""
    return np.vstack([columns, np.full((1, columns.shape[1]), np.nan)])


# The plan -------------------------------------------------------------------------------------------------------


def paths_figure(result: SlamResult) -> Any:
    """Paths before, after and true, loops and standard deviations on one plan; the legend toggles the layers."""
    import plotly.graph_objects as go

    layers = (_odometry, _loops, _estimate, _reference, _sigma, _untied)
    traces = [trace for layer in layers for trace in layer(result)]
    many = sum(len(trace["x"]) for trace in traces) > MANY_POINTS
    figure = go.Figure([(go.Scattergl if many else go.Scatter)(trace) for trace in traces])
    here = result.radio_map.map == 0
    return figure.update_layout(**_plan_layout(np.vstack([result.radio_map.poses[here], result.odometry_poses[here]])))


def _path_trace(result: SlamResult, layer: str, positions_xy: Array, rows: Integers, **style: Any) -> dict[str, Any]:
    """One trace for the walks of ``rows``; hovering shows walk, time and standard deviation."""
    samples = result.radio_map
    line = line_rows(rows, samples.walk)
    x, y = with_gap(positions_xy)[line].T.astype(np.float32)
    return {
        "x": x,
        "y": y,
        "name": layer,
        "legendgroup": layer,
        "text": [hover if k >= 0 else "" for k, hover in zip(line, _hover_texts(result, line), strict=True)],
        "hovertemplate": "%{text}<br>x %{x:.1f} m, y %{y:.1f} m<extra>" + layer + "</extra>",
        **style,
    }


def _hover_texts(result: SlamResult, rows: Integers) -> Iterator[str]:
    samples = result.radio_map
    names = [plain(name) for name in samples.walks]
    first = np.searchsorted(samples.walk, np.arange(len(names)))
    since = samples.time_s - samples.time_s[first][samples.walk]
    for k in rows:
        yield f"{names[samples.walk[k]]}<br>{since[k]:.0f} s, σ {samples.sigma_m[k]:.1f} m"


def plain(text: str) -> str:
    """Text that Plotly shows as it is, instead of reading marks in it."""
    return html.escape(text, quote=False)


def _estimate(result: SlamResult) -> list[dict[str, Any]]:
    """A trace per colour, not per walk, so that hundreds of walks stay fluent."""
    samples = result.radio_map
    traces: list[dict[str, Any]] = []
    colour = samples.walk % len(COLOURS)
    for k in np.unique(colour[samples.map == 0]):
        rows = np.flatnonzero((colour == k) & (samples.map == 0))
        style = {"line": {"color": COLOURS[k], "width": 2}, "marker": {"color": COLOURS[k], "size": 4}}
        trace = _path_trace(result, "estimate, a colour per walk", samples.poses[:, :2], rows, **style)
        traces.append({**trace, "mode": "lines+markers", "showlegend": not traces, "legendrank": 1})
    return traces


def _odometry(result: SlamResult) -> list[dict[str, Any]]:
    rows = np.flatnonzero(result.radio_map.map == 0)
    style = {"mode": "lines", "line": {"color": ODOMETRY_GREY, "width": 1}, "opacity": 0.8}
    return [_path_trace(result, "odometry alone", result.odometry_poses[:, :2], rows, **style)]


def _reference(result: SlamResult) -> list[dict[str, Any]]:
    positions_xy = reference_in_map(result)
    rows = np.flatnonzero(np.isfinite(positions_xy).all(axis=1))
    style = {"mode": "lines", "line": {"color": "#222222", "width": 1}, "meta": INK, "opacity": 0.7}
    return [_path_trace(result, "reference", positions_xy, rows, **style)] if len(rows) else []


def _untied(result: SlamResult) -> list[dict[str, Any]]:
    """Walks of the other maps: their place on this plan means nothing, so they are hidden at first."""
    rows = np.flatnonzero(result.radio_map.map > 0)
    style = {"mode": "lines", "line": {"color": "#d64550", "width": 1.5, "dash": "dot"}, "visible": "legendonly"}
    label = "walks not tied, own frames"
    return [_path_trace(result, label, result.radio_map.poses[:, :2], rows, **style)] if len(rows) else []


def _loops(result: SlamResult) -> list[dict[str, Any]]:
    """Segments in steps of similarity (a line has one colour), and their middles for hovering and the scale."""
    samples, kept = result.radio_map, result.loops.kept
    kept = kept.select(samples.map[kept.i] == 0)
    if not len(kept):
        return []
    low = np.floor(kept.similarity.min() * 20) / 20
    step = np.clip(((kept.similarity - low) / max(1 - low, 1e-9) * 5).astype(int), 0, 4)
    base = {"legendgroup": "loops", "name": "loops, coloured by similarity", "visible": "legendonly"}
    traces: list[dict[str, Any]] = []
    for k in np.unique(step):
        some = kept.select(step == k)
        ends = np.stack([samples.poses[some.i, :2], samples.poses[some.j, :2], np.full((len(some), 2), np.nan)], axis=1)
        x, y = ends.reshape(-1, 2).T.astype(np.float32)
        line = {"color": _viridis((k + 0.5) / 5), "width": 1}
        traces.append({**base, "x": x, "y": y, "mode": "lines", "line": line, "hoverinfo": "skip", "showlegend": False})
    return [*traces, {**base, **_loop_middles(result, kept.i, kept.j, kept.similarity, low)}]


def _loop_middles(result: SlamResult, i: Integers, j: Integers, similarity: Array, low: float) -> dict[str, Any]:
    samples = result.radio_map
    middle = ((samples.poses[i, :2] + samples.poses[j, :2]) / 2).astype(np.float32)
    names = [plain(name) for name in samples.walks]
    bar = {"title": {"text": "similarity", "side": "right"}, "thickness": 12, "len": 0.7}
    scale = {"colorscale": "Viridis", "cmin": low, "cmax": 1.0, "colorbar": bar, "showscale": True}
    return {
        "x": middle[:, 0],
        "y": middle[:, 1],
        "mode": "markers",
        "marker": {"color": similarity.astype(np.float32), "size": 4, "symbol": "diamond", **scale},
        "text": [f"{names[samples.walk[a]]}<br>{names[samples.walk[b]]}" for a, b in zip(i, j, strict=True)],
        "hovertemplate": "%{text}<br>similarity %{marker.color:.2f}<extra>loop</extra>",
    }


def _sigma(result: SlamResult) -> list[dict[str, Any]]:
    """Circles of radius σ; evenly fewer of them where there are very many scans."""
    samples = result.radio_map
    rows = np.flatnonzero((samples.map == 0) & np.isfinite(samples.sigma_m))
    rows = rows[:: max(1, -(-len(rows) // MOST_CIRCLES))]
    centre = samples.poses[rows, 0] + 1j * samples.poses[rows, 1]
    circles = (centre[:, None] + samples.sigma_m[rows, None] * CIRCLE).ravel()
    return [
        {
            "x": circles.real.astype(np.float32),
            "y": circles.imag.astype(np.float32),
            "mode": "lines",
            "line": {"color": "#3b7dd8", "width": 0.7},
            "name": "σ of each position",
            "opacity": 0.45,
            "hoverinfo": "skip",
            "visible": "legendonly",
        }
    ]


def _viridis(part: float) -> str:
    from plotly.colors import sample_colorscale

    return str(sample_colorscale("Viridis", [part])[0])


def _plan_layout(poses: Array) -> dict[str, Any]:
    """Equal axes, and a height that suits the building on a page about 1100 px wide."""
    width, depth = np.maximum(np.ptp(poses[:, :2], axis=0), 1.0)
    axis = {"ticksuffix": " m", "zeroline": False, "constrain": "domain"}
    legend = {"orientation": "h", "x": 0, "y": 1.01, "yanchor": "bottom", "itemsizing": "constant"}
    return {
        "xaxis": axis,
        "yaxis": {**axis, "scaleanchor": "x"},
        "height": int(np.clip(110 + 960 * depth / width, 440, 900)),
        "legend": legend,
        "hovermode": "closest",
        "margin": {"l": 60, "r": 20, "t": 60, "b": 40},
    }


# Radio and uncertainty ------------------------------------------------------------------------------------------


def coverage_figure(result: SlamResult) -> Any:
    """What was heard along the track, with a menu: number of access points, strongest, each of the most heard."""
    import plotly.graph_objects as go

    samples = result.radio_map
    rows = np.flatnonzero(samples.map == 0)
    rss = samples.rss_dbm[rows].tocsc()
    views = list(coverage_views(rss, samples.transmitters))
    trace = go.Scattergl if len(rows) > MANY_POINTS else go.Scatter
    x, y = samples.poses[rows, :2].T.astype(np.float32)
    track = {"x": x, "y": y, "mode": "markers", "marker": {"color": ODOMETRY_GREY, "size": 3}, "hoverinfo": "skip"}
    figure = go.Figure(trace(track, opacity=0.5))
    for k, (label, unit, here, values) in enumerate(views):
        bar = {"title": {"text": unit, "side": "right"}, "thickness": 12}
        marker = {"color": values, "size": 7, "colorscale": "Viridis", "colorbar": bar, "showscale": True}
        tell = f"{label}<br>%{{marker.color:.0f}} {unit}<extra></extra>"
        figure.add_trace(trace(x=x[here], y=y[here], mode="markers", marker=marker, hovertemplate=tell, visible=k == 0))
    return figure.update_layout(**_plan_layout(samples.poses[rows]), showlegend=False, updatemenus=[_menu(views)])


def coverage_views(rss: Any, transmitters: tuple[str, ...]) -> Iterator[tuple[str, str, Integers, Array]]:
    """(label, unit, rows where there is a value, values) from (n, m) CSC of RSS in dBm."""
    count = np.bincount(rss.indices, minlength=rss.shape[0])
    heard = np.flatnonzero(count)
    strongest = np.full(rss.shape[0], -np.inf)
    np.maximum.at(strongest, rss.indices, rss.data)
    yield "access points heard", "access points", np.arange(len(count)), count.astype(np.float32)
    yield "strongest access point", "dBm", heard, strongest[heard].astype(np.float32)
    scans = np.diff(rss.indptr)
    for column in np.argsort(-scans, kind="stable")[:MOST_HEARD]:
        if scans[column]:
            part = slice(rss.indptr[column], rss.indptr[column + 1])
            label = f"{plain(transmitters[column])} ({scans[column]} scans)"
            yield label, "dBm", rss.indices[part], rss.data[part].astype(np.float32)


def _menu(views: list[tuple[str, str, Integers, Array]]) -> dict[str, Any]:
    shown = np.eye(len(views), dtype=bool)
    buttons = [
        {"label": view[0], "method": "restyle", "args": [{"visible": [True, *shown[k].tolist()]}]}
        for k, view in enumerate(views)
    ]
    return {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom", "pad": {"b": 4}}


def uncertainty_figure(model: UncertaintyModel) -> Any:
    """σ over similarity above the number of samples behind it, the paper's figure 2b."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.68, 0.32], vertical_spacing=0.06)
    sigma, learned = np.sqrt(model.variance_m2), model.sample_count > 0
    tell = "similarity %{x:.2f}<br>σ %{y:.2f} m<extra></extra>"
    layers = (
        ("from neighbours", sigma, {"color": ODOMETRY_GREY, "dash": "dot", "width": 2}),
        ("learned", np.where(learned, sigma, np.nan), {"color": COLOURS[0], "width": 3}),
    )
    for name, y, line in layers:
        trace = go.Scatter(x=model.similarity, y=y, mode="lines", name=name, line=line, hovertemplate=tell)
        figure.add_trace(trace.update(showlegend=not learned.all()), row=1, col=1)
    tell = "similarity %{x:.2f}<br>%{y:,} samples<extra></extra>"
    bars = go.Bar(x=model.similarity, y=model.sample_count, marker_color=COLOURS[0], showlegend=False)
    figure.add_trace(bars.update(hovertemplate=tell), row=2, col=1)
    figure.update_yaxes(title_text="σ of the distance (m)", rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title_text="samples", row=2, col=1)
    figure.update_xaxes(range=[0, 1], zeroline=False)
    figure.update_xaxes(title_text="similarity", row=2, col=1)
    legend = {"orientation": "h", "x": 0, "y": 1.01, "yanchor": "bottom"}
    return figure.update_layout(height=440, bargap=0, legend=legend, margin={"l": 60, "r": 20, "t": 40, "b": 60})
