"""Walks whose positions are known -> a radio map without any mapping: a survey.

For logs that hold scans at positions but no motion, such as WiGLE's or WiFine's, and for a yardstick beside a map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import FingerprintConfig
from radioslam.errors import MappingError
from radioslam.fingerprints import fresh_readings
from radioslam.radio_map import RadioMap
from radioslam.walk import Reference, Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

LONGEST_GAP_S = 60.0
"""Between reference positions further apart nobody knows where a scan was."""
SIGMA_M = 0.3
"""Standard deviation of a surveyed position, unless the log says another."""


@dataclass(frozen=True)
class _Placed:
    """Scans of one walk with a known position: times (n,), positions (n, 2), and readings as scan, name and dBm."""

    time_s: Array
    positions_xy: Array
    reading_scan: Integers
    names: list[str]
    rss_dbm: Array
    sigma_m: float


def survey_map(walks: Sequence[Walk], config: FingerprintConfig) -> RadioMap:
    """The radio map of all scans with a known position, in the frame of the references.

    Headings are zero. Where the references have an origin, the map is georeferenced. Walks must share one frame, as
    ``read_walks`` leaves them.

    Raises:
        MappingError: no scan has a known position, or some walks have an origin and others have none.
    """
    placed = [(walk, _placed(walk, walk.reference, config)) for walk in walks if walk.reference is not None]
    placed = [(walk, scans) for walk, scans in placed if len(scans.time_s)]
    if not placed:
        expected = "scans at reference positions, or between two that are at most"
        raise MappingError(f"expected {expected} {LONGEST_GAP_S:g} s apart, found none; use `radioslam map`")
    parts = [scans for _, scans in placed]
    count = [len(scans.time_s) for scans in parts]
    walk = np.repeat(np.arange(len(parts)), count)
    names, column = np.unique([name for scans in parts for name in scans.names], return_inverse=True)
    row = np.concatenate([scans.reading_scan + start for scans, start in zip(parts, _starts(count), strict=True)])
    entries = (np.concatenate([scans.rss_dbm for scans in parts]), (row, column))
    floors = tuple(one.floor for one, _ in placed)
    return RadioMap(
        walks=tuple(one.name for one, _ in placed),
        walk=walk,
        time_s=np.concatenate([scans.time_s for scans in parts]),
        poses=np.column_stack([np.concatenate([scans.positions_xy for scans in parts]), np.zeros(len(walk))]),
        sigma_m=np.repeat([scans.sigma_m for scans in parts], count),
        map=np.zeros(len(walk), np.int64),
        rss_dbm=sparse.csr_array(entries, shape=(len(walk), len(names))),
        transmitters=tuple(names.tolist()),
        floors=floors if any(floors) else (),
        georeference=_georeference([one.reference for one, _ in placed if one.reference is not None]),
    )


def _starts(count: Sequence[int]) -> Integers:
    return np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)


def _placed(walk: Walk, reference: Reference, config: FingerprintConfig) -> _Placed:
    """The walk's scans that heard something new at a known position."""
    scans = walk.wifi
    positions = reference.at(scans.scan_time_s, LONGEST_GAP_S)
    good = fresh_readings(scans, config.max_age_s) & (scans.rss_dbm >= config.rss_threshold_dbm)
    good &= np.isfinite(positions[scans.reading_scan, 0])
    used, reading_scan = np.unique(scans.reading_scan[good], return_inverse=True)
    return _Placed(
        scans.scan_time_s[used],
        positions[used],
        reading_scan,
        [scans.transmitters[k] for k in scans.reading_transmitter[good]],
        scans.rss_dbm[good],
        SIGMA_M if reference.sigma_m is None else reference.sigma_m,
    )


def _georeference(references: Sequence[Reference]) -> tuple[float, float, float] | None:
    origins = {one.origin_wgs84 for one in references}
    if len(origins) > 1:
        found = "some with latitude and longitude, some without" if None in origins else "several origins"
        raise MappingError(f"expected references in one frame, found {found}; survey each on its own")
    (origin,) = origins
    return None if origin is None else (*origin, 0.0)
