"""A crowd as heavy as real phones: one pose per second, a scan of 150 readings every five seconds."""

from __future__ import annotations

import numpy as np

from radioslam.walk import RadioScans, Signal, Walk

HALL_M = (120.0, 80.0)
ACCESS_POINTS = 400
READINGS = 150
SCAN_EVERY_S = 5.0


def heavy_walks(count: int, duration_s: float, seed: int) -> list[Walk]:
    """Walks from corner to corner of a hall, its strongest access points in each scan."""
    rng = np.random.default_rng(seed)
    stations = rng.uniform((0, 0), HALL_M, (ACCESS_POINTS, 2))
    names = [f"02:00:00:00:{k >> 8:02x}:{k & 255:02x}" for k in range(ACCESS_POINTS)]
    return [_walk(f"heavy-{k:03d}", stations, names, duration_s, rng) for k in range(count)]


def _walk(name: str, stations: np.ndarray, names: list[str], duration_s: float, rng: np.random.Generator) -> Walk:
    time_s = np.arange(0.0, duration_s + 1)
    goals = np.vstack([[0.0, 0.0], rng.uniform((0, 0), HALL_M, (50, 2))])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(goals, axis=0).T))])
    walked = 1.2 * time_s
    positions = np.column_stack([np.interp(walked, along, axis) for axis in goals.T])
    heading = np.unwrap(np.arctan2(*np.gradient(positions, axis=0).T[::-1]))
    drift = np.cumsum(rng.normal(0, 0.03, positions.shape), axis=0)
    scan_s = np.arange(2.0, duration_s, SCAN_EVERY_S)
    readings = [_scan(t, positions[int(t)], stations, names, rng) for t in scan_s]
    columns = ([value for part in column for value in part] for column in zip(*readings, strict=True))
    wifi = RadioScans.from_readings(*columns)
    return Walk(name, wifi, odometry=Signal(time_s, np.column_stack([positions + drift, heading])))


def _scan(time_s: float, at: np.ndarray, stations: np.ndarray, names: list[str], rng: np.random.Generator) -> tuple:
    away = np.maximum(np.hypot(*(stations - at).T), 1.0)
    rss = np.clip(-40 - 25 * np.log10(away) + rng.normal(0, 4, len(away)), -95, -20).round()
    heard = np.argsort(-rss, kind="stable")[:READINGS]
    return [time_s] * READINGS, [names[k] for k in heard], rss[heard].tolist()
