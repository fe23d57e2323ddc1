"""Figures as image files, for papers and READMEs; matplotlib comes with the extra ``radioslam[figures]``."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ResultError
from radioslam.experiments import Experiment, Outcome, gather
from radioslam.plots import COLOURS, colour_of_walk, coverage_views, line_rows, reference_in_map, with_gap
from radioslam.results import SlamResult
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]

IMAGE_DPI = 120


def save_paths_png(result: SlamResult, path: Path) -> None:
    """Odometry alone beside the estimate, each with the reference where there is one, 1440 px wide.

    Raises:
        ResultError: matplotlib is not installed.
    """
    samples, reference = result.radio_map, reference_in_map(result)
    here = np.flatnonzero(samples.map == 0)
    panels = (("odometry alone", result.odometry_poses), ("estimate", samples.poses))
    figure, axes = plan_axes(samples.poses[here], len(panels))
    for axis, (title, poses) in zip(axes, panels, strict=True):
        axis.set_title(title)
        axis.plot(
            *with_gap(reference)[line_rows(here, samples.walk)].T, color="black", linewidth=0.8, label="reference"
        )
        for k in np.unique(samples.walk[here]):
            axis.plot(*poses[samples.walk == k, :2].T, color=colour_of_walk(k), linewidth=1.1)
    if np.isfinite(reference).any():
        axes[0].legend(frameon=False)
    figure.savefig(path, dpi=IMAGE_DPI)


def save_map_png(result: SlamResult, path: Path) -> None:
    """The track coloured by number of access points heard and by the strongest, 1440 px wide.

    Raises:
        ResultError: matplotlib is not installed.
    """
    samples = result.radio_map
    rows = np.flatnonzero(samples.map == 0)
    views = coverage_views(samples.rss_dbm[rows].tocsc(), samples.transmitters)
    figure, axes = plan_axes(samples.poses[rows], 2)
    for axis, (label, unit, here, values) in zip(axes, views, strict=False):
        axis.set_title(label)
        dots = axis.scatter(*samples.poses[rows[here], :2].T, c=values, s=6, cmap="viridis")
        figure.colorbar(dots, ax=axis, label=unit, fraction=0.04)
    figure.savefig(path, dpi=IMAGE_DPI)


def save_uncertainty_png(models: Mapping[str, UncertaintyModel], path: Path) -> None:
    """σ over similarity with the number of samples, the paper's figure 2b, a line per named model, 720 × 480 px.

    Raises:
        ResultError: matplotlib is not installed.
    """
    figure = matplotlib_figure()(figsize=(6, 4), layout="constrained")
    axis, below = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k, (name, model) in enumerate(models.items()):
        axis.plot(model.similarity, np.sqrt(model.variance_m2), color=COLOURS[k], linewidth=2, label=name)
        below.step(model.similarity, model.sample_count, where="mid", color=COLOURS[k])
    axis.set(ylabel="σ (m)", ylim=(0, None))
    axis.legend(frameon=False)
    below.set(xlabel="similarity", ylabel="samples", ylim=(0, None))
    for each in (axis, below):
        each.grid(alpha=0.3)
    figure.savefig(path, dpi=IMAGE_DPI)


def save_error_cdf_png(errors_m: Mapping[str, Array], path: Path) -> None:
    """Share of scans (vertical) that err less than so many metres, a line per named array (n,), 720 × 480 px.

    NaN, a scan without truth, is left out.

    Raises:
        ResultError: matplotlib is not installed.
    """
    figure = matplotlib_figure()(figsize=(6, 4), layout="constrained")
    axis = figure.subplots()
    for (name, errors), colour in zip(errors_m.items(), ("0.5", *COLOURS), strict=False):
        ordered = np.sort(errors[np.isfinite(errors)])
        axis.plot(ordered, np.arange(1, len(ordered) + 1) / len(ordered), color=colour, linewidth=2, label=name)
    axis.set(xlabel="error (m)", ylabel="share of scans", xlim=(0, None), ylim=(0, 1))
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(path, dpi=IMAGE_DPI)


def save_sweep_png(experiment: Experiment, outcomes: Sequence[Outcome], path: Path) -> None:
    """First figure of the experiment's table over its variants, mean and spread over seeds, 720 × 480 px.

    Raises:
        ResultError: matplotlib is not installed.
    """
    figure = matplotlib_figure()(figsize=(6, 4), layout="constrained")
    axis, column = figure.subplots(), experiment.columns[0]
    for k, (preset, rows) in enumerate(itertools.groupby(gather(experiment, outcomes), key=lambda row: row[0])):
        shown = [(variant, *means[column]) for _, variant, means in rows if column in means]
        labels, mean, spread = zip(*shown, strict=True)
        names = any(" " in label for label in labels)
        line = "none" if names else "solid"
        axis.errorbar(labels, mean, spread, color=COLOURS[k], marker="o", linestyle=line, capsize=3, label=preset)
        if names:
            axis.set_xticks(range(len(labels)), labels, rotation=30, ha="right")
    axis.set(xlabel=experiment.name, ylabel="mean error (m)" if column == "mean" else column, ylim=(0, None))
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(path, dpi=IMAGE_DPI)


def plan_axes(poses: Array, count: int) -> tuple[Any, Any]:
    """A figure with ``count`` plans side by side, shaped for poses (n, 3)."""
    width, depth = np.maximum(np.ptp(poses[:, :2], axis=0), 1.0)
    height = float(np.clip(10.4 / count * depth / width + 0.9, 3, 12))
    figure = matplotlib_figure()(figsize=(12, height), layout="constrained")
    axes = figure.subplots(1, count, sharex=True, sharey=True)
    for axis in axes:
        axis.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
        axis.grid(alpha=0.3)
    return figure, axes


def matplotlib_figure() -> Callable[..., Any]:
    """Matplotlib's figure class, imported late.

    Raises:
        ResultError: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ResultError("images need matplotlib; install it with: pip install 'radioslam[figures]'") from None
    return Figure
