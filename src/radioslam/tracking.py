"""A moving user in a radio map: particle filter over scans and dead reckoning, start unknown.

A particle is a position with the turn between the walk's compass and the map and the scale of its steps. Between
scans it moves as the track says, with noise; at a scan it is weighed by the field (``likelihood.py``) at the nearest
candidate, and the less the farther that is. The first scan spreads the particles over the whole map, so that no start
is needed; the answer at the first scan, after the lag, is the start of a new walk in an existing map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from radioslam import planar
from radioslam.config import Config, PositioningConfig
from radioslam.fingerprints import collect_fingerprints
from radioslam.likelihood import Candidates
from radioslam.odometry import Track, estimate_track
from radioslam.positioning import FloorModel, Positioner
from radioslam.walk import Walk

Array = NDArray[np.float64]

TURN_SIGMA_RAD = 0.1
"""Of the compass of a whole walk, against the map's frame."""
OFF_CANDIDATES_M = 2.0
"""Places farther from where people walked get less likely by a Gaussian of this width."""
SCAN_CORRELATION = 0.25
"""Successive scans repeat each other's errors; each counts for this part of its evidence."""
WRONG_SCAN = 0.1
"""Chance that a scan is of somewhere else: stale readings that the phone repeats."""


@dataclass(frozen=True)
class TrackedWalk:
    """Positions at n scans: ``poses`` (n, 3) in the map's frame, ``sigma_m`` (n,) per axis, ``time_s`` (n,)."""

    time_s: Array
    poses: Array
    sigma_m: Array
    floor: str = ""


@dataclass
class _Particles:
    """n particles: ``history`` (lag + 1, n, 2) of positions, newest last; ``turn`` (n,) and ``log_scale`` (n,)."""

    history: Array
    turn: Array
    log_scale: Array
    log_weight: Array

    def mean(self, row: int) -> tuple[Array, float, float]:
        """Position (2,), standard deviation per axis, and turn of what stands in a row of the history."""
        weight = np.exp(self.log_weight - logsumexp(self.log_weight))
        at = self.history[row]
        position = weight @ at
        variance = weight @ np.sum((at - position) ** 2, axis=1) / 2
        return position, float(np.sqrt(variance)), float(weight @ self.turn)

    def resample(self, rng: np.random.Generator) -> None:
        """Systematic resampling where fewer than half of the particles matter."""
        weight = np.exp(self.log_weight - logsumexp(self.log_weight))
        n = len(weight)
        if 1 / np.sum(weight**2) > n / 2:
            return
        chosen = np.searchsorted(np.cumsum(weight), (rng.random() + np.arange(n)) / n).clip(0, n - 1)
        self.history, self.turn, self.log_scale = self.history[:, chosen], self.turn[chosen], self.log_scale[chosen]
        self.log_weight = np.zeros(n)


def track_walk(
    floor: FloorModel,
    track: Track,
    scans_dbm: sparse.csr_array,
    config: PositioningConfig,
    rng: np.random.Generator,
    backwards: bool = False,
) -> TrackedWalk:
    """Follow a walk whose scans are the rows (n, m) of ``scans_dbm``, in the order of its scan times, or from its end.

    Each answer has heard ``config.lag_scans`` scans more (fixed-lag smoothing); with 0 it is the filter's own.
    """
    time_s = track.walk.wifi.scan_time_s
    odometry = track.at(time_s)
    order = np.arange(len(time_s))[:: -1 if backwards else 1]
    steps = np.diff(odometry[order, :2], axis=0)
    sigma_m, sigma_rad = (column[:: -1 if backwards else 1] for column in track.motion_sigmas(time_s))
    evidence = _evidence(floor, scans_dbm)[order]
    tree = cKDTree(floor.candidates.positions_xy)
    cloud = _spread(floor.candidates, evidence[0], track, config, rng)
    answers = []
    for k in range(len(time_s)):
        if k:
            _move(cloud, steps[k - 1], sigma_m[k - 1], sigma_rad[k - 1], config.lag_scans, rng)
            _weigh(cloud, tree, evidence[k])
            cloud.resample(rng)
        if k >= config.lag_scans:
            answers.append(cloud.mean(len(cloud.history) - 1 - config.lag_scans))
    last = len(cloud.history)
    answers += [cloud.mean(row) for row in range(last - (len(time_s) - len(answers)), last)]
    position, sigma, turn = (np.array(column)[order] for column in zip(*answers, strict=True))
    return TrackedWalk(time_s, np.column_stack([position, planar.wrap(odometry[:, 2] + turn)]), sigma, floor.floor)


def _evidence(floor: FloorModel, scans_dbm: sparse.csr_array) -> Array:
    """Log-evidence (n, q) of each scan for each candidate: a wrong scan, of chance ``WRONG_SCAN``, says nothing.

    A scan that is like no sample of the map says nothing at all.
    """
    posterior = SCAN_CORRELATION * floor.candidates.tempered(scans_dbm, floor.calibration.temperature)
    posterior -= logsumexp(posterior, axis=1, keepdims=True)
    likeness = floor.neighbours.similarity(scans_dbm, np.zeros(len(posterior))).max(axis=1)
    posterior[likeness < floor.calibration.least_similarity] = -np.log(posterior.shape[1])
    mixed: Array = np.logaddexp(posterior, np.log(WRONG_SCAN / posterior.shape[1]))
    return mixed


def _spread(
    candidates: Candidates, evidence: Array, track: Track, config: PositioningConfig, rng: np.random.Generator
) -> _Particles:
    n = config.particles
    weight = np.exp(evidence - logsumexp(evidence))
    at = candidates.positions_xy[rng.choice(len(weight), n, p=weight / weight.sum())]
    at = at + rng.normal(0, OFF_CANDIDATES_M / 2, (n, 2))
    turn, scale = rng.normal(0, TURN_SIGMA_RAD, n), rng.normal(0, track.log_scale_sigma, n)
    return _Particles(at[None], turn, scale, np.zeros(n))


def _move(
    cloud: _Particles, step_xy: Array, sigma_m: float, sigma_rad: float, lag: int, rng: np.random.Generator
) -> None:
    n = len(cloud.turn)
    cloud.turn = cloud.turn + rng.normal(0, sigma_rad, n)
    moved = planar.rotate(cloud.turn, np.exp(cloud.log_scale)[:, None] * step_xy)
    here = cloud.history[-1] + moved + rng.normal(0, sigma_m + 0.1, (n, 2))
    cloud.history = np.concatenate([cloud.history, here[None]])[-lag - 1 :]


def _weigh(cloud: _Particles, tree: cKDTree, evidence: Array) -> None:
    away, nearest = tree.query(cloud.history[-1])
    cloud.log_weight = cloud.log_weight + evidence[nearest] - 0.5 * (away / OFF_CANDIDATES_M) ** 2


def told_by(positioner: Positioner, walk: Walk, config: Config) -> tuple[Track, sparse.csr_array, Array]:
    """A walk's track, its scans (n, m) by the map's access points, and how many unknown ones each heard (n,)."""
    track = estimate_track(walk, config.odometry)
    fingerprints = collect_fingerprints([track], config.fingerprints)
    scans = aligned_columns(fingerprints.rss_dbm, fingerprints.transmitters, positioner.transmitters)
    return track, scans, np.diff(fingerprints.rss_dbm.indptr) - np.diff(scans.indptr)


def aligned_columns(rss_dbm: sparse.csr_array, names: Sequence[str], wanted: Sequence[str]) -> sparse.csr_array:
    """Strengths (n, m) of ``names`` as (n, k) of the access points ``wanted``; others are left out."""
    column = {name: k for k, name in enumerate(wanted)}
    place = np.array([column.get(name, -1) for name in names], dtype=np.int64)
    entries = rss_dbm.tocoo()
    known = place[entries.col] >= 0
    cells = (entries.data[known], (entries.row[known], place[entries.col[known]]))
    return sparse.csr_array(cells, shape=(rss_dbm.shape[0], len(wanted)))
