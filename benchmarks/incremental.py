"""What one more walk costs: a simulated floor that 100 and 1,000 walks of some 190 scans cross.

Reference in the same run is a batch run of the smaller crowd and the walks that come to it. The larger crowd is grown
from that one walk by walk, without any full optimization, because a batch run of 187,000 scans on one floor takes too
long. Sizes are at least five walks apart. Seconds are processor time, so that other work on the machine does not count.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from radioslam.config import load_config
from radioslam.incremental import GrowingMap
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from radioslam.walk import Walk

SIZES = (100, 1000)
NEW, SEED = 5, 0


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    started = time.process_time()
    answer = work()
    return time.process_time() - started, answer


def error_m(result: SlamResult, names: Sequence[str]) -> float:
    samples = result.radio_map
    here = np.isin(np.array(samples.walks)[samples.walk], names)
    return float(np.nanmean(np.hypot(*(samples.poses[here, :2] - result.reference_xy[here]).T)))


def grow(walks: Sequence[Walk], sizes: Sequence[int]) -> dict[int, tuple[float, float, SlamResult]]:
    """By crowd: mean and greatest seconds of each of the next walks, and the map with them."""
    config = load_config(overrides=["merging.starts=known"], environment={})
    first = min(sizes)
    grown = GrowingMap.of(map_walks(walks[:first], config), walks[:first])
    measured = {}
    for k, walk in enumerate(walks[first:], first):
        seconds, added = timed(lambda walk=walk: grown.add(walk))
        assert added.tied, added.reason
        size = max((size for size in sizes if size <= k), default=0)
        if size and k < size + NEW:
            measured.setdefault(size, []).append(seconds)
            if k == size + NEW - 1:
                measured[size] = (np.mean(measured[size]), np.max(measured[size]), grown.result())
    return measured


def run(sizes: Sequence[int] = SIZES) -> None:
    """Print seconds of one walk by crowd, their ratio to a batch run and to each other, and the errors."""
    config = load_config(overrides=["merging.starts=known"], environment={})
    walks = simulate("campus", seed=SEED, walks=max(sizes) + NEW)
    small = sorted(sizes)[0]
    batch_s, batch = timed(lambda: map_walks(walks[: small + NEW], config))
    measured = grow(walks, sizes)
    print(f"incremental: campus seed {SEED}, {np.mean([len(walk.wifi) for walk in walks]):.0f} scans per walk")
    names = {"walks": 6, "one more s": 10, "at most s": 9, "batch / one": 11, "new walks m": 11, "batch m": 8}
    print(*(f"{name:>{width}}" for name, width in names.items()), f"{'all m':>6} {'batch m':>8}")
    for size, (mean_s, most_s, result) in sorted(measured.items()):
        names = [walk.name for walk in walks[size : size + NEW]]
        same = f"{batch_s / mean_s:11.0f}" if size == small else f"{'–':>11}"
        errors = [error_m(result, which) for which in (names, result.walks)]
        judged = [error_m(batch, which) for which in (names, result.walks)] if size == small else []
        of_batch = [f"{error:8.2f}" for error in judged] or 2 * [f"{'–':>8}"]
        row = f"{size:6d} {mean_s:10.2f} {most_s:9.2f} {same} {errors[0]:11.2f} {of_batch[0]} {errors[1]:6.2f}"
        print(row, of_batch[1], flush=True)
    print(f"one more walk at {max(sizes)} over at {small}: {measured[max(sizes)][0] / measured[small][0]:.2f}")


if __name__ == "__main__":
    run(tuple(int(size) for size in sys.argv[1:]) or SIZES)
