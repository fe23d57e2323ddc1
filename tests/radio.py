"""A hall of 40 by 30 m with twelve access points, sampled anywhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import sparse

from radioslam.radio_map import RadioMap

STATIONS = np.array([[x, y] for x in (0.0, 13.0, 27.0, 40.0) for y in (0.0, 15.0, 30.0)])


def hall(
    rng: np.random.Generator, count: int, walks: int = 8, prefix: str = "02:00:00:00:00"
) -> tuple[RadioMap, Callable[[Any], Any]]:
    """Samples at random places, and the true mean strengths (q, 12) at places (q, 2)."""

    def truth(places: Any) -> Any:
        distance = np.hypot(*(places[:, None] - STATIONS[None]).transpose(2, 0, 1))
        return -40 - 30 * np.log10(np.maximum(distance, 1.0))

    xy = rng.uniform([0, 0], [40, 30], (count, 2))
    rss = np.minimum(truth(xy) + rng.normal(0, 3, (count, len(STATIONS))), -20)
    rss[rss < -85] = 0
    walk = np.sort(np.arange(count) % walks)
    samples = RadioMap(
        walks=tuple(f"walk-{k}" for k in range(walks)),
        walk=walk,
        time_s=np.arange(float(count)),
        poses=np.column_stack([xy, np.zeros(count)]),
        sigma_m=np.full(count, 0.5),
        map=np.zeros(count, np.int64),
        rss_dbm=sparse.csr_array(rss),
        transmitters=tuple(f"{prefix}:{k:02x}" for k in range(len(STATIONS))),
    )
    return samples, truth


def scan_of(samples: RadioMap, row: int, offset_db: float = 0.0) -> dict[str, float]:
    part = slice(*samples.rss_dbm.indptr[row : row + 2])
    names = (samples.transmitters[k] for k in samples.rss_dbm.indices[part])
    return dict(zip(names, samples.rss_dbm.data[part] + offset_db, strict=True))
