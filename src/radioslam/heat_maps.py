"""Heat maps of a radio map: PNG by matplotlib, and the report's figure with a chooser for the access point."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from radioslam.coverage import Form, cover
from radioslam.errors import ResultError
from radioslam.radio_map import RadioMap

SHOWN = 20
"""Access points in the report's chooser."""


def most_heard(samples: RadioMap, count: int) -> RadioMap:
    """The map with only the access points heard most, the most heard first."""
    heard = np.bincount(samples.rss_dbm.indices, minlength=len(samples.transmitters))
    columns = [k for k in np.argsort(-heard, kind="stable")[:count] if heard[k]]
    return _only(samples, columns)


def _only(samples: RadioMap, columns: list[int]) -> RadioMap:
    names = tuple(samples.transmitters[k] for k in columns)
    return replace(samples, rss_dbm=samples.rss_dbm[:, columns].tocsr(), transmitters=names)


def save_heat_map_png(samples: RadioMap, path: Path, transmitter: str | None = None, form: Form = "field") -> None:
    """Mean strength and probability of being heard of one access point, default the one heard most, 1440 px wide.

    Of a map of several floors the one that heard it most is shown.

    Raises:
        ResultError: matplotlib is not installed, or the map does not know the access point.
        MappingError: nothing was heard.
    """
    from radioslam.images import IMAGE_DPI, plan_axes

    if transmitter is not None and transmitter not in samples.transmitters:
        raise ResultError(f"expected an access point of the map, found {transmitter!r}; see radioslam access-points")
    one = most_heard(samples, 1) if transmitter is None else _only(samples, [samples.transmitters.index(transmitter)])
    floor, one = max(one.by_floor(), key=lambda part: part[1].rss_dbm.nnz)
    coverage = cover(one, step_m=1.0, form=form)
    figure, axes = plan_axes(one.poses, 2)
    views = (
        ("mean strength", coverage.mean_dbm[:, 0], "dBm"),
        ("probability of being heard", coverage.detection[:, 0], ""),
    )
    for axis, (title, values, unit) in zip(axes, views, strict=True):
        axis.set_title(f"{one.transmitters[0]}{floor and f', floor {floor}'}: {title}")
        dots = axis.scatter(*coverage.positions_xy.T, c=values, s=6, marker="s", linewidths=0, cmap="viridis")
        axis.scatter(*one.poses[:, :2].T, s=0.3, color="black")
        figure.colorbar(dots, ax=axis, label=unit, fraction=0.04)
    figure.savefig(path, dpi=IMAGE_DPI)


def heat_map_figure(samples: RadioMap) -> Any:
    """Plotly figure of the access points heard most, one shown at a time."""
    import html

    import plotly.graph_objects as go

    shown = most_heard(samples.select(samples.map == 0), SHOWN)
    coverage = cover(shown, step_m=2.0)
    x, y = coverage.positions_xy.T.astype(np.float32)
    figure = go.Figure()
    for k in range(len(shown.transmitters)):
        values = np.round(coverage.mean_dbm[:, k]).astype(np.float32)
        marker = {
            "color": values,
            "size": 7,
            "symbol": "square",
            "colorscale": "Viridis",
            "colorbar": {"title": {"text": "dBm"}},
        }
        tell = "%{marker.color:.0f} dBm<extra></extra>"
        figure.add_trace(go.Scattergl(x=x, y=y, mode="markers", marker=marker, visible=k == 0, hovertemplate=tell))
    switch = np.eye(len(shown.transmitters), dtype=bool)
    buttons = [
        {"label": html.escape(name), "method": "restyle", "args": [{"visible": switch[k].tolist()}]}
        for k, name in enumerate(shown.transmitters)
    ]
    menu = {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom", "pad": {"b": 4}}
    figure.update_yaxes(scaleanchor="x", title_text="y (m)").update_xaxes(title_text="x (m)")
    return figure.update_layout(
        height=640, showlegend=False, updatemenus=[menu], margin={"l": 60, "r": 20, "t": 60, "b": 60}
    )
