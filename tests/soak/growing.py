"""A crowd that comes one by one: what each version costs, grown and of all walks, and how far apart the maps are."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from radioslam.server.mapping import SiteMap, make_map
from radioslam.server.settings import Settings
from radioslam.server.site_config import site_config
from radioslam.server.site_walks import SiteWalks
from radioslam.simulator import simulate
from tests.server.apart import apart_m
from tests.server.service import Service


@dataclass(frozen=True)
class Version:
    """A version: walks on it, whether it had grown, processor seconds of it and of a full one, metres between them."""

    walks: int
    grown: bool
    version_s: float
    full_s: float
    apart_m: float


def grow(count: int = 40, starts: str = "common", seed: int = 1) -> list[Version]:
    """Walks of an office, a version after each."""
    config, versions = site_config(starts, "device", []), []
    with tempfile.TemporaryDirectory() as name, Service(Settings(data=Path(name), worker=False)) as service:
        service.make_site(starts=starts)
        before: Path | str = "it is the first"
        for k, walk in enumerate(simulate("office", seed=seed, walks=count), 1):
            service.send_walk(walk, device=walk.device)
            walks = SiteWalks(service.context.database, "office")
            version_s, made = _timed(walks, config, Path(name) / f"version-{k}", before)
            full_s, full = _timed(walks, config, Path(name) / f"full-{k}", "it is the reference")
            apart = apart_m(made.floors[0].result, full.floors[0].result, aligned=starts == "unknown")
            versions.append(Version(k, made.summary()["made"] == "grown", version_s, full_s, apart))
            before = Path(name) / f"version-{k}"
    return versions


def _timed(walks: SiteWalks, config: object, folder: Path, before: Path | str) -> tuple[float, SiteMap]:
    folder.mkdir()
    started_s = time.process_time()
    made = make_map(walks, config, folder, lambda step: None, before)
    return time.process_time() - started_s, made


def table(versions: list[Version]) -> str:
    """Rows of ten walks each."""
    rows = [f"{'walks':>8} {'grown':>6} {'grown s':>8} {'full s':>7} {'version s':>10} {'apart m':>8} {'most m':>7}"]
    for first in range(0, len(versions), 10):
        part = versions[first : first + 10]
        grown = [one for one in part if one.grown]
        grown_s = np.mean([one.version_s for one in grown]) if grown else np.nan
        full_s, all_s = np.mean([one.full_s for one in part]), np.mean([one.version_s for one in part])
        apart = [one.apart_m for one in grown] or [np.nan]
        span = f"{part[0].walks}-{part[-1].walks}"
        between = f"{np.mean(apart):8.2f} {np.max(apart):7.2f}"
        rows.append(f"{span:>8} {len(grown):6d} {grown_s:8.2f} {full_s:7.2f} {all_s:10.2f} {between}")
    return "\n".join(rows)
