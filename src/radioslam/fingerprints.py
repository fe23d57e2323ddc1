"""Scans at poses: F_t = (f_t, x_t), the paper's radio fingerprints, as one sparse matrix for the whole crowd."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import FingerprintConfig
from radioslam.odometry import Track
from radioslam.walk import RadioScans, Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Fingerprints:
    """All scans of all walks, in the order of the walks and of time.

    Attributes:
        walk: (n,) index of the track.  scan: (n,) index of the scan within its walk.
        time_s: (n,) on the walk's own clock.
        poses: (n, 3) odometry, in the walk's own frame.  distance_m: (n,) walked so far.
        rss_dbm: (n, m) CSR of fresh readings at or above the threshold; what is not stored was not heard.
        transmitters: m identities, the columns.
    """

    walk: Integers
    scan: Integers
    time_s: Array
    poses: Array
    distance_m: Array
    rss_dbm: sparse.csr_array
    transmitters: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.walk)


def collect_fingerprints(tracks: Sequence[Track], config: FingerprintConfig, repeats: bool = False) -> Fingerprints:
    """Give each scan the pose at its own time and keep its fresh readings that are strong enough (ϑ_r).

    With ``repeats`` also what the phone had told before, which nobody knows who sees one scan alone.
    With ``config.beacons``, what was heard of Bluetooth beacons around a scan makes further columns.
    """
    scans = [track.walk.wifi if not config.beacons else with_beacons(track.walk, config) for track in tracks]
    transmitters = tuple(sorted({name for radio in scans for name in radio.transmitters}))
    column = {name: k for k, name in enumerate(transmitters)}
    blocks = [_strengths(radio, column, config, repeats) for radio in scans]
    times = [track.walk.wifi.scan_time_s for track in tracks]
    counts = [len(t) for t in times]
    return Fingerprints(
        walk=np.repeat(np.arange(len(tracks)), counts),
        scan=np.concatenate([np.arange(c) for c in counts]),
        time_s=np.concatenate(times),
        poses=np.concatenate([track.at(t) for track, t in zip(tracks, times, strict=True)]),
        distance_m=np.concatenate([track.distance_at(t) for track, t in zip(tracks, times, strict=True)]),
        rss_dbm=sparse.csr_array(sparse.vstack(blocks)),
        transmitters=transmitters,
    )


def with_beacons(walk: Walk, config: FingerprintConfig) -> RadioScans:
    """The WiFi scans of a walk, each with the mean strength of every beacon heard nearest to it in time.

    Beacons are heard all the time, scans are read out every few seconds: a reading belongs to the nearest scan if that
    is no more than ``beacon_window_s`` away. Beacons are called ``ble:`` and their identity.
    """
    wifi, ble = walk.wifi, walk.ble
    if ble is None or not len(wifi) or not ble.reading_count:
        return wifi
    time_s = ble.scan_time_s[ble.reading_scan]
    middle = (wifi.scan_time_s[1:] + wifi.scan_time_s[:-1]) / 2
    scan = np.searchsorted(middle, time_s)
    near = np.abs(wifi.scan_time_s[scan] - time_s) <= config.beacon_window_s
    key = scan[near] * len(ble.transmitters) + ble.reading_transmitter[near]
    keys, group = np.unique(key, return_inverse=True)
    mean_dbm = np.bincount(group, ble.rss_dbm[near]) / np.maximum(np.bincount(group), 1)
    names = np.array([*wifi.transmitters, *(f"ble:{name}" for name in ble.transmitters)])
    beacon = names[len(wifi.transmitters) + keys % len(ble.transmitters)]
    both = RadioScans.from_readings(
        np.concatenate([wifi.scan_time_s[wifi.reading_scan], wifi.scan_time_s[keys // len(ble.transmitters)]]),
        np.concatenate([names[wifi.reading_transmitter], beacon]).tolist(),
        np.concatenate([wifi.rss_dbm, mean_dbm]),
        np.concatenate([wifi.frequency_mhz, np.full(len(keys), np.nan)]),
        np.concatenate([wifi.last_seen_s, np.full(len(keys), np.nan)]),
    )
    place = np.searchsorted(wifi.scan_time_s, both.scan_time_s)  # scans that heard nothing keep their place
    return replace(both, scan_time_s=wifi.scan_time_s, reading_scan=place[both.reading_scan])


def _strengths(scans: RadioScans, column: dict[str, int], config: FingerprintConfig, repeats: bool) -> sparse.csr_array:
    fresh = ~stale_readings(scans, config.max_age_s) if repeats else fresh_readings(scans, config.max_age_s)
    keep = fresh & (scans.rss_dbm >= config.rss_threshold_dbm)
    columns = np.array([column[name] for name in scans.transmitters], dtype=np.int64)
    entries = (scans.rss_dbm[keep], (scans.reading_scan[keep], columns[scans.reading_transmitter[keep]]))
    return sparse.csr_array(entries, shape=(len(scans), len(column)))


def fresh_readings(scans: RadioScans, max_age_s: float) -> NDArray[np.bool_]:
    """Mask (n_readings,) of the readings that tell something new.

    Where the phone says when a transmitter was last heard, a reading is stale if that was more than ``max_age_s``
    before the scan, and a repeat if an earlier scan had the same (transmitter, last seen). Where it does not, a scan
    equal to the one before, reading by reading, is the phone's cache and holds nothing new.
    """
    seen = scans.last_seen_s
    known = np.isfinite(seen)
    order = np.lexsort((scans.reading_scan, seen, scans.reading_transmitter))
    same = np.zeros(len(seen), bool)
    same[order[1:]] = (np.diff(scans.reading_transmitter[order]) == 0) & (np.diff(seen[order]) == 0)
    repeated = np.where(known, same, _repeated_scans(scans)[scans.reading_scan])
    return ~stale_readings(scans, max_age_s) & ~repeated


def stale_readings(scans: RadioScans, max_age_s: float) -> NDArray[np.bool_]:
    """Mask (n_readings,) of the readings of which the phone itself says that they are older than that."""
    old: NDArray[np.bool_] = scans.scan_time_s[scans.reading_scan] - scans.last_seen_s > max_age_s
    return old


def _repeated_scans(scans: RadioScans) -> NDArray[np.bool_]:
    """Mask (n_scans,): equal to the scan before it. Readings stand sorted by scan and transmitter."""
    count = np.bincount(scans.reading_scan, minlength=len(scans))
    before = np.concatenate([[-1], count[:-1]])
    twin = np.arange(scans.reading_count) - count[scans.reading_scan]
    inside = (count == before)[scans.reading_scan]
    equal = inside & (scans.reading_transmitter == scans.reading_transmitter[twin])
    equal &= scans.rss_dbm == scans.rss_dbm[twin]
    return (count == before) & (np.bincount(scans.reading_scan, equal, minlength=len(scans)) == count)


def represent(rss_dbm: sparse.csr_array, config: FingerprintConfig) -> sparse.csr_array:
    """Strengths (n, m) that the cosine compares, zero where a transmitter was not heard.

    ``dbm``: the raw value, as the paper's formula has it (weak readings weigh more than strong ones);
    ``positive``: RSS - floor;  ``exponential``: exp((RSS - floor) / α), near the amplitude of the field.
    """
    strengths = rss_dbm.copy()
    if config.representation == "positive":
        strengths.data = np.maximum(rss_dbm.data - config.floor_dbm, 0.1)
    elif config.representation == "exponential":
        strengths.data = np.exp((rss_dbm.data - config.floor_dbm) / config.exponential_scale_db)
    return strengths
