"""How close crowd-sensing comes to a survey: held-out walks located in (a) our map and (b) the surveyed map.

Walks are left out in groups (every fourth walk together), so that the map is built four times and not once per walk; a
place that only the walks of one group saw is then missing from the map, for every method alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam.accuracy import ErrorStatistics
from radioslam.config import Config, load_config
from radioslam.experiments import Source
from radioslam.fingerprints import collect_fingerprints
from radioslam.odometry import estimate_track
from radioslam.positioning import Positioner
from radioslam.radio_map import RadioMap
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.tracking import aligned_columns, track_walk
from radioslam.walk import Walk

Array = NDArray[np.float64]

GROUPS = 4
SURVEY_SIGMA_M = 0.3
METHODS = ("knn", "locate", "track")


@dataclass(frozen=True)
class Trial:
    """Errors (n,) by method of one walk's scans with known truth, whether the truth lay inside the radius, and whether
    the scan was taken to be of the map.
    """

    errors: dict[str, Array]
    inside: Array
    here: Array


def run_positioning(source: Source, seed: int, walks: int | None, overrides: Sequence[str]) -> str:
    """Map, survey, locate, track; the table as Markdown."""
    settings = [f"merging.starts={source.starts}", *overrides]
    config = load_config("default", overrides=settings, environment={})
    made = sorted(source.make(seed, walks), key=lambda walk: walk.name)
    trials: dict[str, list[Trial]] = {"a": [], "b": []}
    for group in range(GROUPS):
        held = [walk for walk in made[group::GROUPS] if walk.reference is not None]
        result = map_walks([walk for k, walk in enumerate(made) if k % GROUPS != group], config)
        for name, samples in (("a", result.radio_map), ("b", surveyed(result))):
            positioner = Positioner.of(samples, config)
            trials[name] += [_try(positioner, walk, config) for walk in held]
    return _markdown(source, len(made), trials)


def surveyed(result: SlamResult) -> RadioMap:
    """The samples with a known truth, at their true positions."""
    samples, truth = result.radio_map, result.reference_xy
    poses = np.column_stack([truth, samples.poses[:, 2]])
    sigma = np.full(len(samples), SURVEY_SIGMA_M)
    one = replace(samples, poses=poses, sigma_m=sigma, map=np.zeros_like(samples.map))
    return one.select(np.isfinite(truth[:, 0]))


def _try(positioner: Positioner, walk: Walk, config: Config) -> Trial:
    track = estimate_track(walk, config.odometry)
    fingerprints = collect_fingerprints([track], config.fingerprints)
    scans = aligned_columns(fingerprints.rss_dbm, fingerprints.transmitters, positioner.transmitters)
    unknown = np.diff(fingerprints.rss_dbm.indptr) - np.diff(scans.indptr)
    floor = positioner.floors[0]
    neighbours = floor.neighbours
    nearest = neighbours.locate(neighbours.similarity(scans, unknown), config.positioning.neighbours)
    mean, _ = floor.candidates.moments(floor.candidates.tempered(scans, floor.calibration.temperature))
    tracked = track_walk(floor, track, scans, config.positioning, np.random.default_rng(1))
    located = positioner.locate_rows(scans, unknown)
    assert walk.reference is not None
    truth = walk.reference.at(fingerprints.time_s, 60.0)
    known = np.isfinite(truth[:, 0])
    positions = {"knn": nearest, "locate": mean, "track": tracked.poses[:, :2]}
    errors = {name: np.hypot(*(xy - truth).T)[known] for name, xy in positions.items()}
    radius = np.array([location.radius_m for location in located])[known]
    here = np.array([location.here for location in located])[known]
    return Trial(errors, errors["locate"] <= radius, here)


def _markdown(source: Source, walks: int, trials: dict[str, list[Trial]]) -> str:
    """A row per method and map; a scan that was called foreign counts with its best guess in every method."""
    lines = [f"**Positioning** — {source.name}, {walks} walks, {GROUPS} groups left out in turn", ""]
    lines += ["| method | map | median | mean | p75 | p95 | a/b |", "|---|---|---|---|---|---|---|"]
    for method in METHODS:
        statistics = {m: ErrorStatistics.of(np.concatenate([t.errors[method] for t in trials[m]])) for m in trials}
        ratio = statistics["a"].mean / statistics["b"].mean
        for name, of in (("a", "RadioSLAM's"), ("b", "surveyed")):
            s = statistics[name]
            end = f"{ratio:.2f}" if name == "a" else ""
            lines.append(f"| {method} | {of} | {s.median:.2f} | {s.mean:.2f} | {s.p75:.2f} | {s.p95:.2f} | {end} |")
    for name, of in (("a", "RadioSLAM's"), ("b", "surveyed")):
        inside, here = (np.concatenate([getattr(t, part) for t in trials[name]]) for part in ("inside", "here"))
        share = 100 * float(np.mean(inside[here]))
        lines.append(
            f"\nInside the 95 % radius, {of} map: {share:.1f} %; called foreign: {100 * np.mean(~here):.1f} %."
        )
    return "\n".join([*lines, ""])
