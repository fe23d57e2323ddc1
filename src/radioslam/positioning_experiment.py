"""How close crowd-sensing comes to a survey: held-out walks located in (a) our map and (b) the surveyed map.

Walks are left out in groups (every fourth walk together), so that the map is built four times and not once per walk; a
place that only the walks of one group saw is then missing from the map, for every method alike.

Methods that see one scan alone get it as the phone told it: that readings repeat those of an earlier scan is known only
to who has seen that one. The filter, like the map, gets what is new, and nothing where a phone repeats itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.accuracy import ErrorStatistics
from radioslam.config import Config, load_config
from radioslam.experiments import Experiment, Outcome, Runs, Source, Variant, walks_of_seed
from radioslam.fingerprints import collect_fingerprints
from radioslam.following import follow_track
from radioslam.odometry import Track, estimate_track
from radioslam.positioning import Positioner
from radioslam.radio_map import RadioMap
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.surveying import SIGMA_M
from radioslam.tracking import aligned_columns
from radioslam.walk import Walk

Array = NDArray[np.float64]

GROUPS = 4
METHODS = ("knn", "locate", "track")
SURVEYED = " surveyed"
COLUMNS = ("mean", "median", "p75", "p95", "a/b", "inside %", "foreign %")

POSITIONING = Experiment(
    "positioning",
    "Strangers located in the map of the other walks, and in a survey of the same scans",
    tuple(Variant(method + where) for method in METHODS for where in ("", SURVEYED)),
    COLUMNS,
)


@dataclass(frozen=True)
class Trial:
    """Errors (n,) by method of one walk's scans with known truth, whether the truth lay inside the radius, and whether
    the scan was taken to be of the map.
    """

    errors: dict[str, Array]
    inside: Array
    here: Array


def run_positioning(experiment: Experiment, runs: Runs) -> list[Outcome]:
    """Map, survey, locate, track: the variants of ``POSITIONING`` or some of them, by preset and seed.

    A scan that was called foreign counts with its best guess in every method.
    """
    labels = tuple(variant.label for variant in experiment.variants)
    methods = tuple(method for method in METHODS if any(label.startswith(method) for label in labels))
    asked = [(preset, seed) for preset in runs.presets for seed in runs.seeds]
    tasks = [
        (runs.source, *one, runs.walks, runs.overrides, group, methods) for one in asked for group in range(GROUPS)
    ]
    trials = runs.in_parallel(_locate_group, tasks)
    outcomes = []
    for k, (preset, seed) in enumerate(asked):
        groups = trials[k * GROUPS : (k + 1) * GROUPS]
        figures = _figures({where: [t for group in groups for t in group[where]] for where in ("", SURVEYED)}, methods)
        outcomes += [Outcome(preset, label, seed, figures[label]) for label in labels]
    return outcomes


def _locate_group(
    source: Source,
    preset: str,
    seed: int,
    walks: int | None,
    overrides: tuple[str, ...],
    group: int,
    methods: tuple[str, ...],
) -> dict[str, list[Trial]]:
    """The walks of one group in both maps of the others."""
    settings = [f"merging.starts={source.starts}", *overrides]
    config = load_config(preset, overrides=settings, environment={})
    made = sorted(walks_of_seed(source, seed, walks), key=lambda walk: walk.name)
    result = map_walks([walk for k, walk in enumerate(made) if k % GROUPS != group], config)
    maps = {"": Positioner.of(result.radio_map, config), SURVEYED: Positioner.of(surveyed(result), config)}
    held = [walk for walk in made[group::GROUPS] if walk.reference is not None]
    return {where: [locate_walk(one, walk, config, seed, methods) for walk in held] for where, one in maps.items()}


def surveyed(result: SlamResult) -> RadioMap:
    """The samples with a known truth, at their true positions."""
    samples, truth = result.radio_map, result.reference_xy
    poses = np.column_stack([truth, samples.poses[:, 2]])
    sigma = np.full(len(samples), SIGMA_M)
    one = replace(samples, poses=poses, sigma_m=sigma, map=np.zeros_like(samples.map))
    return one.select(np.isfinite(truth[:, 0]))


def locate_walk(
    positioner: Positioner, walk: Walk, config: Config, seed: int, methods: Sequence[str] = METHODS
) -> Trial:
    """Every scan of a walk with known truth by some of the ``METHODS``."""
    track = estimate_track(walk, config.odometry)
    fresh, _ = _scans(positioner, track, config, repeats=False)
    told, unknown = _scans(positioner, track, config, repeats=True)
    floor = positioner.floors[0]

    def nearest() -> Array:
        return floor.neighbours.locate(floor.neighbours.similarity(told, unknown), config.positioning.neighbours)

    def located() -> Array:
        return floor.candidates.moments(floor.candidates.tempered(told, floor.calibration.temperature))[0]

    def tracked() -> Array:
        return follow_track(floor, track, fresh, config, seed).poses[:, :2]

    assert walk.reference is not None
    truth = walk.reference.at(walk.wifi.scan_time_s, 60.0)
    known = np.isfinite(truth[:, 0])
    ways = {"knn": nearest, "locate": located, "track": tracked}
    errors = {method: np.hypot(*(ways[method]() - truth).T)[known] for method in methods}
    answers = positioner.locate_rows(told, unknown)
    radius = np.array([answer.radius_m for answer in answers])[known]
    here = np.array([answer.here for answer in answers], dtype=bool)[known]
    inside = errors["locate"] <= radius if "locate" in errors else np.zeros(0, bool)
    return Trial(errors, inside, here)


def _scans(positioner: Positioner, track: Track, config: Config, repeats: bool) -> tuple[sparse.csr_array, Array]:
    """A walk's scans by the map's access points, and how many unknown ones each heard."""
    fingerprints = collect_fingerprints([track], config.fingerprints, repeats)
    scans = aligned_columns(fingerprints.rss_dbm, fingerprints.transmitters, positioner.transmitters)
    return scans, np.diff(fingerprints.rss_dbm.indptr) - np.diff(scans.indptr)


def _figures(trials: dict[str, list[Trial]], methods: Sequence[str]) -> dict[str, dict[str, float]]:
    """Figures by label; a/b, our map's mean over the survey's, stands with our map."""
    figures = {method + where: figures_of(trials[where], method) for method in methods for where in trials}
    for method in methods:
        figures[method]["a/b"] = figures[method]["mean"] / figures[method + SURVEYED]["mean"]
    return figures


def figures_of(trials: Sequence[Trial], method: str) -> dict[str, float]:
    """Statistics of one method's errors; where it is ``locate``, also of its radius and of scans called foreign."""
    statistics = ErrorStatistics.of(np.concatenate([trial.errors[method] for trial in trials]))
    figures = {name: float(getattr(statistics, name)) for name in ("mean", "median", "p75", "p95")}
    if method == "locate":
        inside, here = (np.concatenate([getattr(trial, part) for trial in trials]) for part in ("inside", "here"))
        figures["inside %"] = 100 * float(np.mean(inside[here]))
        figures["foreign %"] = 100 * float(np.mean(~here))
    return figures
