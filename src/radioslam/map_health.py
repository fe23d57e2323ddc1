"""Access points that must not be used for positioning: moved, vanished, or carried about; each with its reason.

Found from the walks alone. Where an access point is heard well tells where it stands: the strongest readings of
different walks lie together if it stays, apart if it moved or travels with people.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]

STRONG_DBM = -60.0
"""Readings at least so strong were made near the access point."""
NEAR_M = 25.0
"""Strong readings of one access point lie within this distance of each other."""
LEAST_STRONG = 3
LEAST_WALKS = 6
"""Before and after so many walks its absence is no accident."""


@dataclass(frozen=True)
class Finding:
    """An access point that is left out, and why: ``moved``, ``vanished`` or ``travels``."""

    transmitter: str
    kind: str
    reason: str


def find_unhealthy(samples: RadioMap) -> tuple[Finding, ...]:
    """All findings of a map, by access point; the walks' own times tell what came later."""
    columns = samples.rss_dbm.tocsc()
    findings = []
    for k, name in enumerate(samples.transmitters):
        part = slice(columns.indptr[k], columns.indptr[k + 1])
        rows, rss = columns.indices[part], columns.data[part]
        found = _travelling_or_moved(samples, name, rows[rss >= STRONG_DBM])
        found = found or _vanished(samples, name, rows)
        if found:
            findings.append(found)
    return tuple(findings)


def _travelling_or_moved(samples: RadioMap, name: str, strong: Array) -> Finding | None:
    """Strong readings in two places: of one walk, it travels; early here and late there, it moved."""
    if len(strong) < LEAST_STRONG:
        return None
    xy, walk, time_s = samples.poses[strong, :2], samples.walk[strong], samples.time_s[strong]
    spread = np.hypot(*np.ptp(xy, axis=0))
    if spread <= 2 * NEAR_M:
        return None
    for k in np.unique(walk):
        extent = float(np.hypot(*np.ptp(xy[walk == k], axis=0)))
        if extent > 2 * NEAR_M:
            return Finding(
                name, "travels", f"strong over {extent:.0f} m of walk {samples.walks[k]}, as if carried along"
            )
    order = np.argsort(time_s, kind="stable")
    for cut in range(1, len(order)):
        early, late = xy[order[:cut]], xy[order[cut:]]
        apart = float(np.hypot(*(np.median(early, axis=0) - np.median(late, axis=0))))
        within = max(float(np.hypot(*np.ptp(part, axis=0))) for part in (early, late))
        if apart > NEAR_M and within <= NEAR_M:
            return Finding(name, "moved", f"strong in one place first and {apart:.0f} m away later")
    return Finding(name, "travels", f"strong in places {spread:.0f} m apart")


def _vanished(samples: RadioMap, name: str, rows: Array) -> Finding | None:
    """Strong in early walks, then unheard by many later walks that passed the same places."""
    if len(rows) < LEAST_STRONG:
        return None
    last_s = samples.time_s[rows].max()
    place = samples.poses[rows, :2].mean(axis=0)
    passed = np.hypot(*(samples.poses[:, :2] - place).T) < NEAR_M / 5
    later = np.unique(samples.walk[passed & (samples.time_s > last_s)])
    heard = np.unique(samples.walk[rows])
    before = np.unique(samples.walk[passed & (samples.time_s <= last_s)])
    share = len(np.intersect1d(before, heard)) / max(len(before), 1)
    if len(later) >= LEAST_WALKS and len(heard) >= LEAST_STRONG and share > 0.8:
        return Finding(name, "vanished", f"heard by {len(heard)} walks, then by none of {len(later)} that came by")
    return None


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
