"""How the time to map a crowd grows with the crowd: the mall's floor F1 in parts, whole, and walked twice over.

Reference in the same run is the odometry of the same walks, which every mapping needs and which grows with their
number.
Reading the logs is not counted.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from radioslam.config import load_config
from radioslam.formats import read_walks
from radioslam.odometry import estimate_odometry
from radioslam.slam import map_walks
from radioslam.walk import Walk

REPOSITORY = Path(__file__).resolve().parent.parent
SIZES = (26, 53, 106, 212)


def crowd_of(walks: Sequence[Walk], size: int) -> list[Walk]:
    """So many walks, spread evenly over the floor's; beyond their number they are taken again under other names."""
    if size <= len(walks):
        return [walks[k] for k in np.linspace(0, len(walks) - 1, size).astype(int)]
    return [replace(walks[k % len(walks)], name=f"{walks[k % len(walks)].name}-{k // len(walks)}") for k in range(size)]


def seconds_of(walks: Sequence[Walk], starts: str) -> tuple[float, int]:
    """Seconds of the whole mapping, and the number of its scans."""
    config = load_config("default", overrides=[f"merging.starts={starts}"], environment={})
    started = time.perf_counter()
    result = map_walks(walks, config)
    return time.perf_counter() - started, len(result.radio_map)


def run() -> None:
    """Print seconds, the ratio to odometry, and how fast both kinds of mapping grow."""
    folder = Path(os.environ.get("RADIOSLAM_DATA", REPOSITORY.parent / "shared" / "data"))
    floor = folder / "indoor-location-20" / "site1" / "F1"
    if not floor.is_dir():
        print(f"crowd: no recordings in {floor}; set RADIOSLAM_DATA to the folder of recordings")
        return
    walks = read_walks([floor])
    print(f"{'walks':>6} {'scans':>6} {'odometry s':>10} {'known s':>8} {'ratio':>6} {'unknown s':>10} {'ratio':>6}")
    rows = []
    for size in SIZES:
        crowd = crowd_of(walks, size)
        started = time.perf_counter()
        estimate_odometry(crowd, load_config("default", environment={}).odometry)
        odometry = time.perf_counter() - started
        (known, scans), (unknown, _) = seconds_of(crowd, "known"), seconds_of(crowd, "unknown")
        ratios = known / odometry, unknown / odometry
        print(
            f"{size:6d} {scans:6d} {odometry:10.2f} {known:8.2f} {ratios[0]:6.1f} {unknown:10.2f} {ratios[1]:6.1f}",
            flush=True,
        )
        rows.append((scans, known, unknown))
    growth = [np.polyfit(*np.log([[row[0], row[k]] for row in rows]).T, 1)[0] for k in (1, 2)]
    print(f"seconds grow as scans to the power of {growth[0]:.2f} (known starts) and {growth[1]:.2f} (unknown starts)")


if __name__ == "__main__":
    run()
