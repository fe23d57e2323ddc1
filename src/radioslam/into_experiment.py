"""New walks of unknown start in an existing map, against the same walks with known starts.

Every fourth walk in turn is new; the map is of the others, whose starts are known. ``into`` finds each new walk by the
particle filter, ``mixed`` places all at once by their scans, ``known`` is told where they begin.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam.accuracy import ErrorStatistics
from radioslam.config import load_config
from radioslam.experiments import Experiment, Outcome, Runs, Source, Variant, walks_of_seed
from radioslam.extending import extend_map
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.walk import Walk

Array = NDArray[np.float64]

GROUPS = 4
INTO = Experiment(
    "into",
    "New walks in the map of the others, by what is known of their starts",
    tuple(Variant(way) for way in ("into", "mixed", "known")),
    ("mean", "median", "p95", "tied %"),
)


def run_into(experiment: Experiment, runs: Runs) -> list[Outcome]:
    """The variants of ``INTO`` or some of them, by preset and seed; errors of new walks that are tied to the map."""
    labels = [variant.label for variant in experiment.variants]
    asked = list(itertools.product(runs.presets, labels, runs.seeds))
    tasks = [(runs.source, *one, runs.walks, runs.overrides, group) for one in asked for group in range(GROUPS)]
    parts = runs.in_parallel(_errors_of_group, tasks)
    outcomes = []
    for k, one in enumerate(asked):
        errors, tied = zip(*parts[k * GROUPS : (k + 1) * GROUPS], strict=True)
        statistics = ErrorStatistics.of(np.concatenate(errors))
        figures = {name: float(getattr(statistics, name)) for name in ("mean", "median", "p95")}
        outcomes.append(Outcome(*one, {**figures, "tied %": 100 * float(np.mean(np.concatenate(tied)))}))
    return outcomes


def _errors_of_group(
    source: Source, preset: str, way: str, seed: int, walks: int | None, overrides: tuple[str, ...], group: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Errors of the new walks' scans, and which of the new walks are in the map."""
    made = sorted(walks_of_seed(source, seed, walks), key=lambda walk: walk.name)
    new, old = made[group::GROUPS], [walk for k, walk in enumerate(made) if k % GROUPS != group]
    settings = [*overrides, f"merging.starts={'mixed' if way == 'mixed' else 'known'}"]
    config = load_config(preset, overrides=[*settings, "optimizer.standard_deviations=true"], environment={})
    if way == "into":
        result = extend_map(map_walks(old, config).radio_map, new, config, seed=seed)
    elif way == "mixed":
        result = map_walks([*old, *(replace(walk, reference=None) for walk in new)], config)
    else:
        result = map_walks(made, config)
    return _judge(result, new)


def _judge(result: SlamResult, new: Sequence[Walk]) -> tuple[Array, NDArray[np.bool_]]:
    samples, errors, tied = result.radio_map, [], []
    for walk in new:
        k = samples.walks.index(walk.name)
        tied.append(result.map_of_walk[k] == 0)
        if walk.reference is not None and tied[-1]:
            here = samples.walk == k
            truth = walk.reference.at(samples.time_s[here], 60.0)
            errors.append(np.hypot(*(samples.poses[here, :2] - truth).T))
    every = np.concatenate([*errors, np.zeros(0)])
    return every[np.isfinite(every)], np.array(tied)
