"""The figures show the result's own numbers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from radioslam import plots
from radioslam.config import load_config
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.slam import map_walks


@pytest.fixture(scope="module")
def result() -> SlamResult:
    return map_walks(simulate("office", seed=1), load_config("default", environment={}))


def with_two_maps(result: SlamResult) -> SlamResult:
    """The last walk alone in a second map."""
    samples = result.radio_map
    of_scan = (samples.walk == len(samples.walks) - 1).astype(np.int64)
    return replace(result, radio_map=replace(samples, map=of_scan))


def layer(figure: Any, name: str) -> list[Any]:
    return [trace for trace in figure.data if trace.legendgroup == name]


def points(traces: list[Any]) -> np.ndarray:
    """(n, 2) of all traces, without the gaps, in a fixed order."""
    xy = np.concatenate([np.column_stack([trace.x, trace.y]) for trace in traces])
    return sort_rows(xy[np.isfinite(xy).all(axis=1)])


def sort_rows(xy: np.ndarray) -> np.ndarray:
    xy = xy.astype(np.float32)
    return xy[np.lexsort(xy.T)]


def test_paths_are_those_of_the_result(result: SlamResult) -> None:
    figure = plots.paths_figure(result)
    estimate = layer(figure, "estimate, a colour per walk")
    np.testing.assert_array_equal(points(estimate), sort_rows(result.radio_map.poses[:, :2]))
    np.testing.assert_array_equal(points(layer(figure, "odometry alone")), sort_rows(result.odometry_poses[:, :2]))
    reference = plots.reference_in_map(result)
    known = np.isfinite(reference).all(axis=1)
    assert known.any()
    np.testing.assert_array_equal(points(layer(figure, "reference")), sort_rows(reference[known]))
    assert figure.layout.yaxis.scaleanchor == "x"


def test_each_layer_has_one_legend_entry(result: SlamResult) -> None:
    figure = plots.paths_figure(with_two_maps(result))
    shown = [trace.name for trace in figure.data if trace.showlegend is not False]
    assert len(shown) == len(set(shown)) == 6


def test_reference_is_aligned_as_the_errors_are(result: SlamResult) -> None:
    errors = np.hypot(*(plots.reference_in_map(result) - result.radio_map.poses[:, :2]).T)
    assert np.nanmean(errors) == pytest.approx(result.summary()["total"]["error"]["estimate"]["mean"])


def test_lines_break_between_walks(result: SlamResult) -> None:
    samples = result.radio_map
    trace = layer(plots.paths_figure(result), "odometry alone")[0]
    assert np.isnan(trace.x).sum() == len(samples.walks) - 1
    assert samples.walks[0] in trace.text[0]
    assert f"σ {samples.sigma_m[0]:.1f} m" in trace.text[0]


def test_loops_join_the_two_scans(result: SlamResult) -> None:
    kept, poses = result.loops.kept, result.radio_map.poses
    traces = layer(plots.paths_figure(result), "loops")
    lines = [trace for trace in traces if trace.mode == "lines"]
    ends = np.concatenate([poses[kept.i, :2], poses[kept.j, :2]])
    np.testing.assert_array_equal(points(lines), sort_rows(ends))
    np.testing.assert_array_equal(traces[-1].marker.color, kept.similarity.astype(np.float32))


def test_circles_have_radius_sigma(result: SlamResult) -> None:
    circles = next(trace for trace in plots.paths_figure(result).data if trace.name.startswith("σ"))
    corners = (circles.x + 1j * circles.y).reshape(len(result.radio_map), -1)[:, :-1]
    centre = result.radio_map.poses[:, :2] @ [1, 1j]
    np.testing.assert_allclose(np.abs(corners - centre[:, None]).T, [result.radio_map.sigma_m] * 17, atol=1e-4)


def test_walks_of_other_maps_are_kept_apart(result: SlamResult) -> None:
    parted = with_two_maps(result)
    figure = plots.paths_figure(parted)
    here = parted.radio_map.map == 0
    estimate = points(layer(figure, "estimate, a colour per walk"))
    np.testing.assert_array_equal(estimate, sort_rows(parted.radio_map.poses[here, :2]))
    untied = layer(figure, "walks not tied, own frames")
    assert untied[0].visible == "legendonly"
    np.testing.assert_array_equal(points(untied), sort_rows(parted.radio_map.poses[~here, :2]))


def test_hundreds_of_walks_take_few_traces(result: SlamResult) -> None:
    samples = result.radio_map
    walks = tuple(f"walk {k}" for k in range(len(samples)))
    crowd = replace(result, radio_map=replace(samples, walks=walks, walk=np.arange(len(samples))))
    figure = plots.paths_figure(crowd)
    assert len(figure.data) < 30
    assert {trace.type for trace in figure.data} == {"scattergl"}


def test_coverage_shows_what_was_heard(result: SlamResult) -> None:
    figure = plots.coverage_figure(result)
    rss = result.radio_map.rss_dbm
    _, heard, strongest, most_heard = figure.data[:4]
    np.testing.assert_array_equal(heard.marker.color, np.diff(rss.indptr))
    dense = np.where(rss.toarray() == 0, -np.inf, rss.toarray())
    top = dense.max(axis=1)
    np.testing.assert_array_equal(strongest.marker.color, top[np.isfinite(top)].astype(np.float32))
    column = dense[:, np.argmax(np.isfinite(dense).sum(axis=0))]
    np.testing.assert_array_equal(most_heard.marker.color, column[np.isfinite(column)].astype(np.float32))
    buttons = figure.layout.updatemenus[0].buttons
    assert len(buttons) == len(figure.data) - 1
    for k, button in enumerate(buttons):
        assert np.flatnonzero(button.args[0]["visible"]).tolist() == [0, k + 1]


def test_uncertainty_shows_the_table(result: SlamResult) -> None:
    model = result.uncertainty
    everywhere, learned, count = plots.uncertainty_figure(model).data
    np.testing.assert_array_equal(everywhere.y, np.sqrt(model.variance_m2))
    np.testing.assert_array_equal(np.isfinite(learned.y), model.sample_count > 0)
    np.testing.assert_array_equal(count.y, model.sample_count)


def test_names_are_escaped_for_plotly(result: SlamResult) -> None:
    samples = result.radio_map
    evil = replace(
        samples,
        walks=("<a href='x'>&", *samples.walks[1:]),
        transmitters=tuple(f"<b>{name}" for name in samples.transmitters),
    )
    parts = replace(result, radio_map=evil)
    texts = [text for trace in plots.paths_figure(parts).data for text in trace.text or ()]
    assert any("&lt;a href='x'&gt;&amp;<br>" in text for text in texts)
    labels = [button.label for button in plots.coverage_figure(parts).layout.updatemenus[0].buttons]
    assert labels[-1].startswith("&lt;b&gt;")
    assert not any("<b" in text.replace("<br>", "") or "<a" in text for text in [*texts, *labels])
