"""Sixteen sites on one worker process and on two, and one site in areas against one machine.

Reference in the same run is the one worker; the two take turns, because other work on the machine comes and goes.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from radioslam.cluster import ClusterEngine, connect, map_sites
from radioslam.config import load_config
from radioslam.formats import write_walk
from radioslam.object_store import ObjectStore
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from radioslam.walk import Walk

SITES, WALKS, TURNS = 16, 6, 3


def write_sites(folder: Path) -> dict[str, list[Path]]:
    """Logs of small offices with raw sensors, a folder each."""
    sites = {}
    for seed in range(SITES):
        (folder / f"site-{seed:02d}").mkdir()
        for walk in simulate("office", seed=seed, walks=WALKS, inertial=True):
            write_walk(walk, folder / f"site-{seed:02d}")
        sites[f"site-{seed:02d}"] = [folder / f"site-{seed:02d}"]
    return sites


def seconds_of_sites(client: Any, sites: Mapping[str, Sequence[Path]], out: Path) -> float:
    config = load_config(overrides=["merging.starts=known"], environment={})
    started = time.perf_counter()
    totals = map_sites(client, sites, config, ObjectStore(str(out)))
    assert not any("reason" in total for total in totals.values())
    return time.perf_counter() - started


def neighbourhood() -> list[Walk]:
    """Eight offices 100 m apart as one site, with access points and walks of their own."""
    walks = []
    for seed in range(8):
        for walk in simulate("office", seed=seed, walks=24):
            assert walk.reference is not None
            moved = walk.reference.positions_xy + np.array([100.0 * (seed % 4), 100.0 * (seed // 4)])
            own = tuple(f"{seed}-{name}" for name in walk.wifi.transmitters)
            reference = replace(walk.reference, positions_xy=moved)
            walks.append(
                replace(
                    walk, name=f"{seed}-{walk.name}", wifi=replace(walk.wifi, transmitters=own), reference=reference
                )
            )
    return walks


def one_site(client: Any, store: Path, name: str, walks: Sequence[Walk]) -> None:
    """Print the seconds of the join and the optimization here, and in tiles and areas, and how far apart they end."""
    config = load_config(overrides=["merging.starts=known"], environment={})
    seconds, poses = [], []
    for engine in (None, ClusterEngine(client, ObjectStore(str(store)))):
        result = map_walks(walks, config, engine=engine)
        poses.append(result.radio_map.poses)
        seconds.append(result.seconds["loop candidates"] + result.seconds["optimization"])
    apart_m = float(np.hypot(*(poses[1] - poses[0])[:, :2].T).max())
    print(
        f"{name}, {len(poses[0])} scans, join and optimization: here {seconds[0]:.1f} s, "
        f"in tiles and areas on 2 workers {seconds[1]:.1f} s, at most {apart_m:.3f} m apart"
    )


def run() -> None:
    """Print the seconds of every turn, their ratio, and what one site in areas costs."""
    with (
        tempfile.TemporaryDirectory() as name,
        connect("local", workers=1) as one,
        connect("local", workers=2) as two,
    ):
        folder = Path(name)
        (folder / "logs").mkdir()
        sites = write_sites(folder / "logs")
        for client in (one, two):  # workers import what they need once
            seconds_of_sites(client, dict(list(sites.items())[:2]), folder / "warm")
        turns = [[seconds_of_sites(client, sites, folder / "out") for client in (one, two)] for _ in range(TURNS)]
        for alone, both in turns:
            print(f"{SITES} sites: 1 worker {alone:.1f} s, 2 workers {both:.1f} s, {alone / both:.2f} times faster")
        one_site(two, folder / "store", "eight offices of 24 walks", neighbourhood())
        one_site(two, folder / "store", "a campus of 16 walks", simulate("campus", seed=0, walks=16))


if __name__ == "__main__":
    run()
