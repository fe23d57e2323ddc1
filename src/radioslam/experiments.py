"""The paper's tables and sweeps, re-runnable on simulated, semi-real and real walks.

An experiment is a list of variants (settings laid over a preset), run on a source of walks with several seeds; a
source makes the walks of one seed. Runs are independent and go to worker processes; every figure is gathered per
variant as mean and spread over the seeds.
"""

from __future__ import annotations

import csv
import functools
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from radioslam.config import load_config
from radioslam.errors import ConfigError, MappingError
from radioslam.evaluation import evaluate
from radioslam.results import SlamResult
from radioslam.walk import Walk

PAPER_TABLES: dict[str, dict[str, dict[str, float]]] = {
    "rss-threshold": {
        "-90": {"bssids": 163.2},
        "-80": {"bssids": 106.8},
        "-70": {"bssids": 39.4, "mean": 1.74, "std": 0.89},
        "-60": {"bssids": 14.2},
        "-50": {"bssids": 2.8},
        "-45": {"bssids": 0.8},
        "odometry": {"mean": 4.99, "std": 4.26, "max": 22.0},
    },
    "similarity-threshold": {"0.8": {"mean": 1.74, "std": 0.89}},
    "bin-width": {"0.1": {"mean": 1.74, "std": 0.89}},
    "timing": {"all": {"seconds": 11.2}},
}
"""Figures that the paper gives, by experiment and variant; metres, seconds, BSSIDs per scan."""


WORSE = 5e-4
"""An estimate counts as worse than odometry where its mean error is larger by more than this part of it."""


@dataclass(frozen=True)
class Variant:
    """One row: its label, the settings that make it, and how many walks it takes (None: as many as asked for)."""

    label: str
    overrides: tuple[str, ...] = ()
    walks: int | None = None


@dataclass(frozen=True)
class Experiment:
    """A named sweep; ``columns`` are the figures that its table shows."""

    name: str
    title: str
    variants: tuple[Variant, ...]
    columns: tuple[str, ...]


def _sweep(key: str, values: Sequence[float]) -> tuple[Variant, ...]:
    return tuple(Variant(f"{value:g}", (f"{key}={value}",)) for value in values)


EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            "rss-threshold",
            "Impact of the RSS threshold ϑ_r (dBm); the paper's table I",
            (*_sweep("fingerprints.rss_threshold_dbm", (-90, -80, -70, -60, -50, -45)), Variant("odometry")),
            ("mean", "std", "max", "rigid_mean", "bssids", "closure_s"),
        ),
        Experiment(
            "similarity-threshold",
            "Impact of the similarity threshold ϑ_s; the paper's table II",
            _sweep("loops.similarity_threshold", (0.98, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)),
            ("mean", "std", "median", "max", "rigid_mean", "loops", "closure_s"),
        ),
        Experiment(
            "bin-width",
            "Impact of the bin width b; the paper's table III",
            _sweep("uncertainty.bin_width", (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)),
            ("mean", "std", "median", "max", "rigid_mean"),
        ),
        Experiment(
            "timing",
            "Seconds per stage; the paper's table IV",
            (Variant("all"),),
            ("training_s", "closure_s", "screening_s", "optimization_s", "seconds", "recording_s", "scans"),
        ),
        Experiment(
            "accuracy",
            "Preset beside preset",
            (Variant("all"),),
            ("mean", "std", "median", "max", "odometry_mean", "ratio", "size_ratio", "loops", "seconds"),
        ),
        Experiment(
            "crowd-size",
            "What more walkers do",
            tuple(Variant(str(n), walks=n) for n in (4, 10, 20, 40)),
            ("mean", "std", "odometry_mean", "ratio", "size_ratio", "loops", "seconds"),
        ),
        Experiment(
            "crowd",
            "A whole crowd by what is known of its starts",
            tuple(Variant(starts, (f"merging.starts={starts}",)) for starts in ("known", "unknown")),
            ("mean", "std", "median", "odometry_mean", "ratio", "size_ratio", "placed", "loops", "all_s"),
        ),
        Experiment(
            "few-walks",
            "A few walks drawn at random",
            tuple(Variant(str(n), walks=n) for n in (2, 3, 5)),
            ("mean", "odometry_mean", "ratio", "worse", "loops"),
        ),
    )
}


@dataclass(frozen=True)
class Source:
    """Where walks come from.

    Attributes:
        name: for the tables.  starts: how the walks' starts are related.
        make: (seed, number of walks or None) -> walks; must be picklable.
    """

    name: str
    starts: str
    make: Callable[[int, int | None], list[Walk]]


@dataclass(frozen=True)
class Simulated:
    """Walks of a made-up building."""

    building: str

    def __call__(self, seed: int, walks: int | None) -> list[Walk]:
        """Walks of one seed."""
        from radioslam.simulator import simulate

        return simulate(self.building, seed=seed, walks=walks)


@dataclass(frozen=True)
class Recorded:
    """Logs; walks without motion get a simulated tracker's drift, and ``walks`` of them are drawn by the seed."""

    paths: tuple[Path, ...]

    def __call__(self, seed: int, walks: int | None) -> list[Walk]:
        """Walks of one seed, in the order of their names."""
        from radioslam.formats import find_logs, read_walks
        from radioslam.simulator import with_tracker_drift

        logs = find_logs(self.paths)
        if walks is not None and walks < len(logs):
            chosen = np.random.default_rng(seed).choice(len(logs), walks, replace=False)
            logs = [logs[k] for k in sorted(chosen)]
        return read_walks(logs, prepare=lambda w: w if w.motion is not None else with_tracker_drift(w, seed))


def source_of(data: Sequence[str], starts: str | None = None) -> Source:
    """A simulated building by its name, or logs by their paths.

    Raises:
        ConfigError: neither a building nor an existing path.
    """
    from radioslam.simulator import SCENARIOS

    if len(data) == 1 and data[0] in SCENARIOS:
        return Source(data[0], starts or "common", Simulated(data[0]))
    missing = [path for path in data if not Path(path).exists()]
    if missing or not data:
        raise ConfigError(f"expected one of {', '.join(SCENARIOS)} or existing logs, found {' '.join(missing) or '-'}")
    parts = Path(data[0]).resolve().parts[-2:]
    return Source("/".join(parts), starts or "known", Recorded(tuple(Path(path) for path in data)))


@dataclass(frozen=True)
class Outcome:
    """One run: preset, variant label, seed and its figures."""

    preset: str
    variant: str
    seed: int
    figures: dict[str, float]


@dataclass(frozen=True)
class Runs:
    """What an experiment is run on, and how.

    Attributes:
        source: where walks come from.  presets, seeds: of every variant.  walks: how many, None: all.
        overrides: settings laid over the preset, under those of the variant.
        jobs: worker processes, None: one per core.  progress: called with (runs done, all) after each.
    """

    source: Source
    presets: tuple[str, ...] = ("paper", "default")
    seeds: tuple[int, ...] = (0, 1, 2)
    walks: int | None = None
    overrides: tuple[str, ...] = ()
    jobs: int | None = None
    progress: Callable[[int, int], None] | None = None

    def in_parallel(self, work: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> list[Any]:
        """What ``work`` makes of each task's arguments, in the order of the tasks, which the jobs share."""
        results: dict[int, Any] = {}
        with ProcessPoolExecutor(self.jobs or os.cpu_count()) as pool:
            waiting = {pool.submit(work, *task): k for k, task in enumerate(tasks)}
            for done, future in enumerate(as_completed(waiting), 1):
                results[waiting[future]] = future.result()
                if self.progress:
                    self.progress(done, len(tasks))
        return [results[k] for k in range(len(tasks))]


def only(experiment: Experiment, labels: Sequence[str]) -> Experiment:
    """The same experiment with some of its variants.

    Raises:
        ConfigError: a label that the experiment does not have.
    """
    known = {variant.label: variant for variant in experiment.variants}
    unknown = [label for label in labels if label not in known]
    if unknown:
        raise ConfigError(f"{experiment.name}: expected values of {', '.join(known)}, found {', '.join(unknown)}")
    return replace(experiment, variants=tuple(known[label] for label in labels))


def run(experiment: Experiment, runs: Runs) -> list[Outcome]:
    """Run every variant with every preset and seed; results in the order preset, variant, seed.

    A variant that leaves nothing to learn from or to tie has the figures of odometry alone and zero loops.
    """
    tasks = [
        (runs.source, preset, variant, seed, variant.walks or runs.walks, runs.overrides)
        for preset in runs.presets
        for variant in experiment.variants
        for seed in runs.seeds
    ]
    by_seed = sorted(range(len(tasks)), key=lambda k: (tasks[k][4] or 0, tasks[k][3]))
    outcomes = dict(zip(by_seed, runs.in_parallel(_run_one, [tasks[k] for k in by_seed]), strict=True))
    return [outcomes[k] for k in range(len(tasks))]


@functools.lru_cache(maxsize=2)
def walks_of_seed(source: Source, seed: int, walks: int | None) -> list[Walk]:
    """Walks are made once per worker and seed, not once per variant."""
    return source.make(seed, walks)


def _run_one(
    source: Source, preset: str, variant: Variant, seed: int, walks: int | None, overrides: tuple[str, ...]
) -> Outcome:
    from radioslam.slam import map_walks

    made = walks_of_seed(source, seed, walks)
    always = [f"merging.starts={source.starts}", "optimizer.standard_deviations=false"]  # no table shows them
    settings = [*always, *overrides, *variant.overrides]
    config = load_config(preset, overrides=settings, environment={})
    try:
        result = map_walks(made, config)
    except MappingError:  # nothing heard above the threshold: odometry is all there is
        result = map_walks(made, load_config(preset, overrides=always, environment={}))
        return Outcome(preset, variant.label, seed, _of_odometry(result))
    if variant.label == "odometry":
        return Outcome(preset, variant.label, seed, _of_odometry(result))
    return Outcome(preset, variant.label, seed, _figures(result))


def _of_odometry(result: SlamResult) -> dict[str, float]:
    errors = evaluate(result).total.errors["odometry"]
    rigid = evaluate(result, alignment="rigid").total.errors["odometry"].mean
    figures = {"mean": errors.mean, "std": errors.std, "median": errors.median, "max": errors.max}
    return {**figures, "rigid_mean": rigid, "loops": 0.0}


def _figures(result: SlamResult) -> dict[str, float]:
    total, seconds = evaluate(result).total, result.seconds
    errors = total.errors["estimate"]
    samples = result.radio_map
    last = np.append(samples.walk[1:] != samples.walk[:-1], True)
    first = np.append(True, last[:-1])
    stages = {
        "training_s": seconds["uncertainty model"],
        "closure_s": seconds["loop candidates"],
        "screening_s": seconds["screening"],
        "optimization_s": seconds["optimization"],
    }
    return {
        "mean": errors.mean,
        "std": errors.std,
        "median": errors.median,
        "max": errors.max,
        "rigid_mean": evaluate(result, alignment="rigid").total.errors["estimate"].mean,
        "odometry_mean": total.errors["odometry"].mean,
        "ratio": total.ratio,
        "size_ratio": total.size_ratio["estimate"],
        "worse": float(total.ratio > 1 + WORSE),
        "placed": float(np.mean(result.map_of_walk == 0)),
        "loops": float(len(result.loops.kept)),
        "bssids": samples.rss_dbm.nnz / len(samples),
        "scans": float(len(samples)),
        "recording_s": float(np.sum(samples.time_s[last] - samples.time_s[first])),
        **stages,
        "seconds": sum(stages.values()),
        "all_s": sum(seconds.values()),
    }


# Tables ----------------------------------------------------------------------------------------------------------


def gather(experiment: Experiment, outcomes: Sequence[Outcome]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """(preset, variant, figure -> (mean, spread over seeds)) in the experiment's order."""
    presets = list(dict.fromkeys(outcome.preset for outcome in outcomes))
    for preset in presets:
        for variant in experiment.variants:
            runs = [o.figures for o in outcomes if (o.preset, o.variant) == (preset, variant.label)]
            means = {
                name: (float(np.mean(values)), float(np.std(values)))
                for name in experiment.columns
                if (values := [figures[name] for figures in runs if name in figures])
            }
            yield preset, variant.label, means


def markdown(experiment: Experiment, source: Source, outcomes: Sequence[Outcome]) -> str:
    """The table, the paper's figures as rows of their own; ± is the spread over the seeds."""
    seeds = sorted({outcome.seed for outcome in outcomes})
    header = ["preset", experiment.name, *experiment.columns]
    lines = [f"**{experiment.title}** — {source.name}, {source.starts} starts, seeds {', '.join(map(str, seeds))}", ""]
    lines += [f"| {' | '.join(header)} |", f"|{'---|' * len(header)}"]
    for variant, figures in PAPER_TABLES.get(experiment.name, {}).items() if source.name == "campus" else ():
        cells = [_cell(figures[c]) if c in figures else "" for c in experiment.columns]
        lines.append(f"| *the paper* | {variant} | {' | '.join(cells)} |")
    for preset, variant, means in gather(experiment, outcomes):
        cells = [
            f"{_cell(m)} ± {_cell(s)}" if len(seeds) > 1 and m == m else _cell(m)
            for m, s in _in_order(experiment, means)
        ]
        lines.append(f"| {preset} | {variant} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _in_order(experiment: Experiment, means: dict[str, Any]) -> Iterator[tuple[float, float]]:
    return (means.get(name, (float("nan"), float("nan"))) for name in experiment.columns)


def _cell(value: float) -> str:
    if value != value:
        return "–"
    size = abs(value)
    return (
        f"{value:.0f}"
        if size >= 100
        else f"{value:.1f}"
        if size >= 10
        else f"{value:.2f}"
        if size >= 0.1
        else f"{value:.2g}"
    )


def write_csv(outcomes: Sequence[Outcome], path: Path) -> None:
    """Every run as a row: preset, variant, seed and its figures."""
    names = list(dict.fromkeys(name for outcome in outcomes for name in outcome.figures))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["preset", "variant", "seed", *names])
        for o in outcomes:
            writer.writerow([o.preset, o.variant, o.seed, *(o.figures.get(name, "") for name in names)])
