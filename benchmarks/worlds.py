"""Large crowds made fast: a plain radio world for the joins and the maps that the benchmarks time.

Access points stand anywhere, one per 125 m²; a scan holds the 40 strongest of -35 - 25 log₁₀(d) dBm with 4 dB of noise.
No walls and no habits: for how well maps turn out there is ``radioslam.simulator``; here only numbers count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from radioslam.simulator import with_tracker_drift
from radioslam.simulator.scenarios import CAMPUS
from radioslam.walk import RadioScans, Reference, Walk

Array = NDArray[np.float64]

HEARD = 40
AREA_M2 = 125.0
BUILDING_M = 95.0
STREET_M = 30.0
CORRIDOR_M = 13.0
SCAN_M = 2.0
"""Metres between scans: the pace of the simulated campus."""


def campus_scans(n: int, seed: int = 1) -> sparse.csr_array:
    """Strengths (n, m) of a campus that grows with its scans: each access point is in some 350 of them."""
    return _strengths(n, max(100, n * HEARD // 350), seed)


def crowd_scans(n: int, seed: int = 1) -> sparse.csr_array:
    """Strengths (n, 300) of a crowd in one place."""
    return _strengths(n, 300, seed)


def campus_walks(walks: int, buildings: int, scans: int = 333, seed: int = 1) -> Iterator[Walk]:
    """Walks along the corridors of buildings in a square, a scan each 5 s, with known paths and a drifting tracker."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(buildings**0.5))
    pitch = BUILDING_M + STREET_M
    corner = pitch * np.stack(np.divmod(np.arange(buildings), side), axis=1)
    count = round(BUILDING_M**2 / AREA_M2)
    access_points = (corner[:, None] + rng.uniform(0, BUILDING_M, (buildings, count, 2))).reshape(-1, 2)
    tree = cKDTree(access_points)
    names = np.array([f"02:00:00:{k >> 16:02x}:{k >> 8 & 255:02x}:{k & 255:02x}" for k in range(len(access_points))])
    for k in range(walks):
        time_s = 5.0 * np.arange(scans)
        positions = corner[k % buildings] + _corridor_path(scans, rng)
        heard, rss_dbm = _heard(tree, positions, rng)
        radio = RadioScans.from_readings(np.repeat(time_s, HEARD), names[heard.ravel()].tolist(), rss_dbm.ravel())
        walk = Walk(f"walk-{k:04d}", radio, reference=Reference(time_s, positions))
        yield with_tracker_drift(walk, seed, CAMPUS.drift)


def _corridor_path(scans: int, rng: np.random.Generator) -> Array:
    """Positions (scans, 2) ``SCAN_M`` apart along a grid of corridors, turning at random where they cross."""
    size = int(BUILDING_M // CORRIDOR_M)
    legs = [rng.integers(0, size + 1, 2)]
    moves = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    for _ in range(int(scans * SCAN_M / CORRIDOR_M) + 2):
        onward = legs[-1] + moves
        inside = onward[np.all((onward >= 0) & (onward <= size), axis=1)]
        new = inside[np.any(inside != legs[-2], axis=1)] if len(legs) > 1 else inside
        legs.append(rng.choice(new))
    along = SCAN_M * np.arange(scans)
    corners = np.array(legs) * CORRIDOR_M
    at = np.arange(len(corners)) * CORRIDOR_M
    sway = rng.normal(0, 0.3, (scans, 2))
    return np.column_stack([np.interp(along, at, column) for column in corners.T]) + sway


def _heard(tree: cKDTree, positions_xy: Array, rng: np.random.Generator) -> tuple[NDArray[np.int64], Array]:
    """Access points (n, 40) and dBm (n, 40) of scans at positions (n, 2), from the nearest 60."""
    distance, near = tree.query(positions_xy, k=min(60, tree.n))
    rss_dbm = -35 - 25 * np.log10(np.hypot(distance, 2.5)) + rng.normal(0, 4, distance.shape)
    best = np.argsort(-rss_dbm, axis=1)[:, :HEARD]
    return np.take_along_axis(near, best, 1), np.clip(np.take_along_axis(rss_dbm, best, 1), -120, -1)


def _strengths(n: int, access_points: int, seed: int) -> sparse.csr_array:
    """Exponential strengths of scans along walks of 200, 5 m apart, in a square that holds the access points."""
    rng = np.random.default_rng(seed)
    side = np.sqrt(AREA_M2 * access_points)
    walks = -(-n // 200)
    heading = rng.uniform(0, 7, (walks, 1)) + np.cumsum(rng.normal(0, 0.3, (walks, 200)), axis=1)
    moves = 5 * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    walked = (rng.uniform(0, side, (walks, 1, 2)) + np.cumsum(moves, axis=1)).reshape(-1, 2)[:n]
    positions = side - np.abs(walked % (2 * side) - side)  # walls turn walkers back
    heard, rss_dbm = _heard(cKDTree(rng.uniform(0, side, (access_points, 2))), positions, rng)
    rows = np.arange(0, n * HEARD + 1, HEARD)
    strengths = sparse.csr_array((np.exp((rss_dbm + 100) / 24).ravel(), heard.ravel(), rows), shape=(n, access_points))
    strengths.sort_indices()
    return strengths
