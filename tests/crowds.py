"""Small simulated crowds that several tests map."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from radioslam.config import load_config
from radioslam.planar import path_length
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.simulator.streams import random_stream
from radioslam.slam import map_walks
from radioslam.walk import RadioScans, Signal, Walk


@cache
def office_walks(seed: int = 1) -> tuple[Walk, ...]:
    return tuple(simulate("office", seed=seed))


@cache
def office_result(preset: str = "default", starts: str = "common") -> SlamResult:
    config = load_config(preset, overrides=[f"merging.starts={starts}"], environment={})
    return map_walks(office_walks(), config)


def _piece(walk: Walk, first_s: float, last_s: float, rng: np.random.Generator, name: str) -> Walk:
    """A part of a walk with dead reckoning of its own: heading N(0, 8°), scale N(0, 0.08), 3° per √m."""
    assert walk.reference is not None
    time_s = np.arange(first_s, last_s, 1.0)
    steps = np.diff(walk.reference.at(time_s), axis=0)
    length, heading = np.hypot(*steps.T), np.arctan2(steps[:, 1], steps[:, 0])
    drift = np.cumsum(rng.normal(0, 1, len(heading)) * np.radians(3) * np.sqrt(length))
    heading = heading + rng.normal(0, np.radians(8)) + drift
    moved = (length * np.exp(rng.normal(0, 0.08) + rng.normal(0, 0.1, len(length))))[:, None]
    path = np.cumsum(moved * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    poses = np.column_stack([np.vstack([np.zeros((1, 2)), path]), np.append(heading, heading[-1])])
    wifi = walk.wifi
    at_s = wifi.scan_time_s[wifi.reading_scan]
    inside = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    scans = RadioScans.from_readings(
        at_s[inside],
        [wifi.transmitters[k] for k in wifi.reading_transmitter[inside]],
        wifi.rss_dbm[inside],
        last_seen_s=wifi.last_seen_s[inside],
    )
    return replace(walk, name=name, wifi=scans, ble=None, inertial=None, odometry=Signal(time_s, poses))


@cache
def short_walks(
    scenario: str, seed: int = 1, walks: int = 40, length_m: float = 80.0, count: int = 40, heard: float = 1.0
) -> tuple[Walk, ...]:
    """Walks of a simulated building cut to pieces of half to all of ``length_m``, in no order, none knows its start.

    Only the share ``heard`` of the access points is left in the data.
    """
    rng = np.random.default_rng(seed)
    pieces = []
    for walk in simulate(scenario, seed=seed, walks=walks, devices=2):
        assert walk.reference is not None
        walk = _with_fewer_access_points(walk, heard, seed)
        time_s = walk.reference.time_s
        along = path_length(walk.reference.positions_xy)
        for begin in np.arange(0.0, along[-1] - length_m, length_m):
            first, last = np.interp([begin, begin + length_m * rng.uniform(0.5, 1.0)], along, time_s)
            scans = np.sum((walk.wifi.scan_time_s >= first) & (walk.wifi.scan_time_s <= last - 1))
            if scans >= 3:
                pieces.append(_piece(walk, first, last, rng, f"{walk.name}-{begin:04.0f}"))
    return tuple(pieces[k] for k in rng.permutation(len(pieces))[:count])


def _with_fewer_access_points(walk: Walk, heard: float, seed: int) -> Walk:
    """The walk as if only some access points existed, the same ones for all walks."""
    wifi = walk.wifi
    known = np.array([random_stream(seed, "heard", name).random() < heard for name in wifi.transmitters])
    left = known[wifi.reading_transmitter]
    scans = replace(
        wifi,
        reading_scan=wifi.reading_scan[left],
        reading_transmitter=wifi.reading_transmitter[left],
        rss_dbm=wifi.rss_dbm[left],
        frequency_mhz=wifi.frequency_mhz[left],
        last_seen_s=wifi.last_seen_s[left],
    )
    return replace(walk, wifi=scans)
