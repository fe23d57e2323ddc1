"""Access points that must not be used for positioning: moved, vanished, or carried about; each with its reason.

Found from the walks alone. Being strong in places far apart is no sign: in an open hall one transmitter is. The sign is
that walks contradict each other: where one walk heard it strongly, others came by and did not hear it at all. Two eras
that explain the contradictions are a move, or its end; contradictions at any time in places far apart are a traveller.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

STRONG_DBM = -60.0
"""Readings at least so strong were made near the access point, or in its sight."""
LEAST_STRONG = 3
BY_M = 5.0
"""A walk that scans ``LEAST_SCANS`` times so near comes by; one scan alone may miss what stands there."""
LEAST_SCANS = 2
NEAR_M = 25.0
"""Places farther apart than this are two, and a traveller's lie over twice as much."""
LEAST_WALKS = 6
"""So many walks that contradict are no accident."""
SILENT_SHARE = 0.5
"""A traveller is not heard by more than this share of those that come by."""
ERA_SHARE = 0.8
"""Of those that come by in its era so many hear what moved or vanished, and in the other era so many do not."""


@dataclass(frozen=True)
class Finding:
    """An access point that is left out, and why: ``moved``, ``vanished`` or ``travels``."""

    transmitter: str
    kind: str
    reason: str


@dataclass(frozen=True)
class _Passes:
    """Who came by where an access point was heard strongly, in s places by w walks.

    Attributes:
        positions_xy: (s, 2) of its strong readings.  walk: (s,).
        came: (s, w) whether another walk came by.  heard: (s, w) whether that walk heard it thereabouts.
    """

    positions_xy: Array
    walk: Integers
    came: Mask
    heard: Mask

    def silent(self, places: Mask, walks: Mask) -> tuple[float, int]:
        """Share of the passes of some walks by some places that heard nothing, NaN without any, and by how many."""
        came = self.came & places[:, None] & walks
        silent = came & ~self.heard
        return (float(silent.sum() / came.sum()) if came.any() else np.nan), int(silent.any(axis=0).sum())


def find_unhealthy(samples: RadioMap) -> tuple[Finding, ...]:
    """All findings of the largest map, by floor and access point; the walks' own times tell what came later.

    Walks that overlap in time, such as those whose clocks all begin at zero, tell no earlier and later.
    """
    return tuple(finding for _, part in samples.by_floor() for finding in _of_floor(part))


def _of_floor(samples: RadioMap) -> Iterator[Finding]:
    begins_s, ends_s = _spans(samples)
    for name, passes in _passes(samples):
        finding = _of_eras(name, passes, begins_s, ends_s) or _travelling(name, passes)
        if finding:
            yield finding


def _spans(samples: RadioMap) -> tuple[Array, Array]:
    """First and last time (w,) of each walk; a walk without samples never begins."""
    begins_s, ends_s = np.full(len(samples.walks), np.inf), np.full(len(samples.walks), np.inf)
    np.minimum.at(begins_s, samples.walk, samples.time_s)
    ends_s[samples.walk] = -np.inf
    np.maximum.at(ends_s, samples.walk, samples.time_s)
    return begins_s, ends_s


def _passes(samples: RadioMap) -> Iterator[tuple[str, _Passes]]:
    n, xy = len(samples), samples.poses[:, :2]
    by, around = _within(xy, BY_M), _within(xy, 2 * BY_M)
    of_walk = sparse.csr_array((np.ones(n), (np.arange(n), samples.walk)), shape=(n, len(samples.walks)))
    columns = samples.rss_dbm.tocsc()
    for k, name in enumerate(samples.transmitters):
        part = slice(columns.indptr[k], columns.indptr[k + 1])
        rows, rss = columns.indices[part], columns.data[part]
        strong = rows[rss >= STRONG_DBM]
        if len(strong) < LEAST_STRONG:
            continue
        came = (by[strong] @ of_walk).toarray() >= LEAST_SCANS
        came[np.arange(len(strong)), samples.walk[strong]] = False
        heard = (around[strong][:, rows] @ of_walk[rows]).toarray() > 0
        yield name, _Passes(xy[strong], samples.walk[strong], came, heard)


def _within(positions_xy: Array, reach_m: float) -> sparse.csr_array:
    """(n, n) ones where two positions are no farther apart, each with itself."""
    near = cKDTree(positions_xy).query_ball_point(positions_xy, reach_m)
    indptr = np.cumsum([0, *(len(row) for row in near)])
    return sparse.csr_array((np.ones(indptr[-1]), np.concatenate(near).astype(np.int64), indptr))


def _of_eras(name: str, passes: _Passes, begins_s: Array, ends_s: Array) -> Finding | None:
    """Heard here by walks before some moment and not after it: vanished, or moved if it is heard elsewhere then."""
    for moment_s in np.unique(ends_s[passes.walk]):
        before, after = ends_s <= moment_s, begins_s > moment_s
        early, late = before[passes.walk], after[passes.walk]
        if not _stands(passes, early, before, after):
            continue
        _, unheard = passes.silent(early, after)
        if not late.any():
            heard = len(np.unique(passes.walk))
            return Finding(name, "vanished", f"strong in {heard} walks, then unheard by {unheard} that came by")
        apart = _apart(passes.positions_xy[early], passes.positions_xy[late])
        if apart > NEAR_M and _stands(passes, late, after, before):
            return Finding(name, "moved", f"strong in one place first and {apart:.0f} m away later")
    return None


def _stands(passes: _Passes, places: Mask, own: Mask, other: Mask) -> bool:
    """Whether what is strong at the places is heard there by walks of its own era, and not by those of the other."""
    if len(np.unique(passes.walk[places])) < LEAST_STRONG:
        return False
    share, unheard = passes.silent(places, other)
    return unheard >= LEAST_WALKS and share >= ERA_SHARE and passes.silent(places, own)[0] <= 1 - ERA_SHARE


def _apart(a_xy: Array, b_xy: Array) -> float:
    return float(np.hypot(*(np.median(a_xy, axis=0) - np.median(b_xy, axis=0))))


def _travelling(name: str, passes: _Passes) -> Finding | None:
    """Strong in places far apart where most walks do not hear it."""
    spread = float(np.hypot(*np.ptp(passes.positions_xy, axis=0)))
    everywhere, everyone = np.ones(len(passes.walk), bool), np.ones(passes.came.shape[1], bool)
    share, unheard = passes.silent(everywhere, everyone)
    if spread <= 2 * NEAR_M or unheard < LEAST_WALKS or share <= SILENT_SHARE:
        return None
    return Finding(name, "travels", f"strong in places {spread:.0f} m apart, unheard there by {unheard} walks")


def locally_administered(transmitter: str) -> bool:
    """Whether a BSSID has the bit that manufacturers do not set: hotspots, but many real networks as well."""
    head = transmitter[:2]
    octets = transmitter.replace("-", ":").count(":") == 5
    return octets and all(c in "0123456789abcdefABCDEF" for c in head) and bool(int(head, 16) & 2)


def trust(samples: RadioMap, findings: Sequence[Finding], local_weight: float) -> Array:
    """Weights (m,): 0 for findings, ``local_weight`` for locally administered addresses, else 1."""
    weights = np.array([local_weight if locally_administered(name) else 1.0 for name in samples.transmitters])
    column = {name: k for k, name in enumerate(samples.transmitters)}
    weights[[column[finding.transmitter] for finding in findings]] = 0.0
    return weights
