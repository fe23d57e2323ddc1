"""Fingerprints that are smoothed over time, for placing walks whose starts nobody knows.

A phone hears each access point at a moment of its own (last seen) and reports it in the next scan, and one scan misses
many that the next one hears. Along a walk the strength of an access point a is therefore taken as

    f_a(t) = Σ_k w_k RSS_k / Σ_k w_k - fade · max(0, min_k |t - t_k| - τ),   w_k = exp(-(t - t_k)² / 2τ²)

over its readings k heard within ``reach`` of t. That compares places, not moments of scanning.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import PlacementConfig
from radioslam.fingerprints import Fingerprints, fresh_readings
from radioslam.odometry import Track

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def smooth_fingerprints(tracks: Sequence[Track], config: PlacementConfig, lag_s: float = 0.0) -> Fingerprints:
    """Smoothed fingerprints on a regular clock, one per ``spacing_m`` walked, of all tracks.

    Readings count ``lag_s`` before the time at which the phone says that it heard them.
    """
    transmitters = tuple(sorted({name for track in tracks for name in track.walk.wifi.transmitters}))
    column = {name: k for k, name in enumerate(transmitters)}
    clocks, progress, blocks = [], [], []
    for track in tracks:
        time_s = _clock(track, config)
        progress_m = _progress(track, time_s, config.standing_mps)
        chosen = _one_per_cell(progress_m, config.spacing_m)
        time_s = time_s[chosen]
        clocks.append(time_s)
        progress.append(progress_m[chosen])
        blocks.append(_smoothed(track, time_s + lag_s, column, config))
    counts = [len(clock) for clock in clocks]
    return Fingerprints(
        walk=np.repeat(np.arange(len(tracks)), counts),
        scan=np.concatenate([np.arange(count) for count in counts]),
        time_s=np.concatenate(clocks),
        poses=np.concatenate([track.at(clock) for track, clock in zip(tracks, clocks, strict=True)]),
        distance_m=np.concatenate(progress),
        rss_dbm=sparse.csr_array(sparse.vstack(blocks)),
        transmitters=transmitters,
    )


def _clock(track: Track, config: PlacementConfig) -> Array:
    """Every ``period_s`` while the walk moves and scans are within reach; (n,), at least one."""
    scan_s = track.walk.wifi.scan_time_s
    first = max(track.time_s[0], scan_s[0] - config.smoothing_reach_s)
    last = min(track.time_s[-1], scan_s[-1] + config.smoothing_reach_s)
    return first + config.period_s * np.arange(int(max(last - first, 0.0) // config.period_s) + 1)


def _progress(track: Track, time_s: Array, standing_mps: float) -> Array:
    """Metres walked until the times (n,), a stand counted as slow walking: what is heard there is evidence too."""
    walked = np.diff(track.distance_at(time_s), prepend=0.0)
    return np.cumsum(np.maximum(walked, standing_mps * np.diff(time_s, prepend=time_s[0])))


def _one_per_cell(distance_m: Array, spacing_m: float) -> Integers:
    """Indices of the first of each stretch of ``spacing_m``."""
    return np.unique(np.floor(distance_m / spacing_m), return_index=True)[1].astype(np.int64)


def _smoothed(track: Track, time_s: Array, column: dict[str, int], config: PlacementConfig) -> sparse.csr_array:
    """RSS (n, m) in dBm at the times (n,); what is not stored was not heard within reach, or too weakly."""
    scans, tau_s, reach_s = track.walk.wifi, config.smoothing_s, config.smoothing_reach_s
    fresh = fresh_readings(scans, config.max_age_s)
    heard_s = np.where(np.isfinite(scans.last_seen_s), scans.last_seen_s, scans.scan_time_s[scans.reading_scan])[fresh]
    columns = np.array([column[name] for name in scans.transmitters], dtype=np.int64)
    reading, row = _within_reach(heard_s, time_s, reach_s)
    apart_s = np.abs(time_s[row] - heard_s[reading])
    weight = np.exp(-0.5 * (apart_s / tau_s) ** 2)
    key = row * len(column) + columns[scans.reading_transmitter[fresh]][reading]
    entry, place = np.unique(key, return_inverse=True)
    mean = np.bincount(place, weight * scans.rss_dbm[fresh][reading]) / np.bincount(place, weight)
    nearest_s = np.full(len(entry), np.inf)
    np.minimum.at(nearest_s, place, apart_s)
    rss = mean - config.fade_db_per_s * np.maximum(nearest_s - tau_s, 0.0)
    strong = rss >= config.rss_threshold_dbm
    rows, kept = entry[strong] // max(len(column), 1), entry[strong] % max(len(column), 1)
    return sparse.csr_array((rss[strong], (rows, kept)), shape=(len(time_s), len(column)))


def _within_reach(heard_s: Array, time_s: Array, reach_s: float) -> tuple[Integers, Integers]:
    """Pairs (reading, row of ``time_s``), (n_pairs,) each, at most ``reach_s`` apart."""
    first = np.searchsorted(time_s, heard_s - reach_s, side="left")
    count = np.searchsorted(time_s, heard_s + reach_s, side="right") - first
    reading = np.repeat(np.arange(len(heard_s)), count)
    row = np.arange(len(reading)) + np.repeat(first - np.cumsum(count) + count, count)
    return reading.astype(np.int64), row.astype(np.int64)
