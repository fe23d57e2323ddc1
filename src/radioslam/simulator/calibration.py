"""How near the simulated campus comes to the recording of the paper (Liu et al., arXiv:1904.11712, table I)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from radioslam.simulator.survey import simulate
from radioslam.walk import Walk

Array = NDArray[np.float64]

LEVELS_DBM = (-90.0, -80.0, -70.0, -60.0, -50.0, -45.0)
PAPER_BSSIDS_PER_SCAN = (163.2, 106.8, 39.4, 14.2, 2.8, 0.8)
PAPER_ODOMETRY_ERROR_M = (4.99, 4.26)
"""Mean and standard deviation over the scans."""


def bssids_per_scan(walks: Sequence[Walk], levels_dbm: Sequence[float] = LEVELS_DBM) -> Array:
    """Mean number of readings above each level (k,) over all scans."""
    scans = sum(len(walk.wifi) for walk in walks)
    rss_dbm = np.concatenate([walk.wifi.rss_dbm for walk in walks])
    return np.array([np.count_nonzero(rss_dbm > level) / scans for level in levels_dbm])


def odometry_errors_m(walk: Walk) -> Array:
    """Distance (n_scans,) at every scan between the reference and the odometry put on the reference's start.

    Raises:
        ValueError: the walk has no odometry or no reference.
    """
    if walk.odometry is None or walk.reference is None:
        raise ValueError(f"{walk.name}: odometry and reference are needed")
    time_s, poses = walk.wifi.scan_time_s, walk.odometry.values
    seen = np.stack([np.interp(time_s, walk.odometry.time_s, poses[:, k]) for k in (0, 1)], axis=1)
    seen += walk.reference.positions_xy[0] - poses[0, :2]
    return np.linalg.norm(seen - walk.reference.at(time_s), axis=1)


def campus_table(seeds: Iterable[int], scenario: str = "campus") -> str:
    """The radio statistics and the odometry's error over seeds beside the paper's, as Markdown."""
    surveys = [simulate(scenario, seed=seed) for seed in seeds]
    counts = np.array([bssids_per_scan(walks) for walks in surveys])
    lines = ["| BSSIDs per scan above | paper | simulated | spread over seeds | ratio |", "|---|---|---|---|---|"]
    for level, paper, column in zip(LEVELS_DBM, PAPER_BSSIDS_PER_SCAN, counts.T, strict=True):
        mean, spread = column.mean(), column.std()
        lines.append(f"| {level:.0f} dBm | {paper:.1f} | {mean:.1f} | {spread:.1f} | {mean / paper:.2f} |")
    errors = [np.concatenate([odometry_errors_m(walk) for walk in walks]) for walks in surveys]
    largest, pooled = [float(error.max()) for error in errors], np.concatenate(errors)
    lines.append("")
    lines.append(
        f"Odometry alone at the scans: {pooled.mean():.2f} ± {pooled.std():.2f} m; the largest error of a seed is "
        f"{np.median(largest):.1f} m in the median, {min(largest):.1f} to {max(largest):.1f} m over the seeds."
    )
    return "\n".join(lines)
