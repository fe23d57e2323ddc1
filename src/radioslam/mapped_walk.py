"""A walk as a growing map keeps it: how it moved, what it heard, where it was, and what holds it there."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam import planar
from radioslam.fingerprints import Fingerprints
from radioslam.loops import KEPT
from radioslam.odometry import Track
from radioslam.walk import Reference

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class MappedWalk:
    """A walk in a map.

    Attributes:
        number: its own within the map, never used again.
        track: its odometry, with its scans and without raw sensors.  fingerprints: its n scans.
        poses: (n, 3) in the map's frame, or in the walk's own where it is not tied.  sigma_m: (n,) per axis.
        fix: the position that holds it in the map's frame; None where it is not tied, for the ``reason``.
    """

    number: int
    track: Track
    fingerprints: Fingerprints
    poses: Array
    sigma_m: Array
    fix: Reference | None = None
    reason: str = ""

    @property
    def name(self) -> str:
        """Of the walk."""
        return self.track.walk.name

    @property
    def tied(self) -> bool:
        """Whether it stands in the map's frame."""
        return self.fix is not None

    def held(self) -> Track:
        """The track with the fix as the known position of its walk."""
        return replace(self.track, walk=replace(self.track.walk, reference=self.fix))

    @functools.cached_property
    def velocity(self) -> Array:
        """(n, 2) m/s at the scans in the frame of the poses."""
        time_s = self.fingerprints.time_s
        return planar.rotate(self.poses[:, 2] - self.track.at(time_s)[:, 2], self.track.velocity(time_s))


def lean(track: Track) -> Track:
    """The track without the raw motion that made it."""
    return replace(track, walk=replace(track.walk, inertial=None, odometry=None))


def split(fingerprints: Fingerprints) -> Iterator[Fingerprints]:
    """The fingerprints of each walk by itself, with the columns that it heard."""
    names = np.array(fingerprints.transmitters, dtype=np.str_)
    for k in range(int(fingerprints.walk.max(initial=-1)) + 1):
        here = np.flatnonzero(fingerprints.walk == k)
        rows = sparse.csr_array(fingerprints.rss_dbm[here])
        heard, column = np.unique(rows.indices, return_inverse=True)
        own = sparse.csr_array((rows.data, column.ravel(), rows.indptr), shape=(len(here), len(heard)))
        yield Fingerprints(
            walk=np.zeros(len(here), np.int64),
            scan=fingerprints.scan[here],
            time_s=fingerprints.time_s[here],
            poses=fingerprints.poses[here],
            distance_m=fingerprints.distance_m[here],
            rss_dbm=own,
            transmitters=tuple(names[heard].tolist()),
        )


def joined(parts: Sequence[Fingerprints]) -> Fingerprints:
    """The fingerprints of many walks in one numbering, what ``split`` took apart."""
    transmitters = tuple(sorted({name for part in parts for name in part.transmitters}))
    column = {name: k for k, name in enumerate(transmitters)}
    counts = [len(part) for part in parts]
    rows = [in_columns(part.rss_dbm, part.transmitters, column) for part in parts]
    names = ("scan", "time_s", "poses", "distance_m")
    return Fingerprints(
        walk=np.repeat(np.arange(len(parts)), counts),
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names},
        rss_dbm=sparse.csr_array(sparse.vstack(rows, format="csr")),
        transmitters=transmitters,
    )


def in_columns(rows: sparse.csr_array, names: Sequence[str], column: dict[str, int]) -> sparse.csr_array:
    """Rows (n, m) over ``names`` as (n, k) over the k columns that a dict of names numbers; it knows them all."""
    place = np.array([column[name] for name in names], dtype=np.int64)
    return sparse.csr_array((rows.data, place[rows.indices], rows.indptr), shape=(rows.shape[0], len(column)))


@dataclass(frozen=True)
class Ties:
    """Candidates between scans of numbered walks with their verdicts; six arrays of shape (n,)."""

    walk_i: Integers
    scan_i: Integers
    walk_j: Integers
    scan_j: Integers
    similarity: Array
    reason: NDArray[np.uint8]

    @staticmethod
    def concatenate(parts: Iterable[Ties]) -> Ties:
        """All ties of the parts, in their order."""
        number, none = np.zeros(0, np.int64), np.zeros(0, np.uint8)
        parts = [Ties(number, number, number, number, np.zeros(0), none), *parts]
        names = Ties.__dataclass_fields__
        return Ties(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def select(self, mask: NDArray[np.bool_]) -> Ties:
        """The ties that a mask (n,) picks."""
        return Ties(*(getattr(self, name)[mask] for name in Ties.__dataclass_fields__))

    @functools.cached_property
    def kept(self) -> Ties:
        """The loops proper."""
        return self.select(self.reason == KEPT)

    def touching(self, numbers: Integers) -> NDArray[np.bool_]:
        """Mask (n,) of the ties of any of these walks."""
        return np.isin(self.walk_i, numbers) | np.isin(self.walk_j, numbers)

    def strongest(self, numbers: Integers, most: int) -> Ties:
        """Those among these walks, and for each of their scans the ``most`` most similar of those to other walks."""
        inside = np.isin(self.walk_i, numbers)
        among = inside & np.isin(self.walk_j, numbers)
        walk, scan = np.where(inside, [self.walk_i, self.scan_i], [self.walk_j, self.scan_j])
        order = np.lexsort((-self.similarity, scan, walk, among))
        first = np.flatnonzero(np.append(True, (np.diff(walk[order]) != 0) | (np.diff(scan[order]) != 0)))
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order)) - np.repeat(first, np.diff(np.append(first, len(order))))
        return self.select(among | (rank < most))

    def partners(self, number: int) -> Integers:
        """Numbers of the walks that are tied to a walk, those most often first."""
        ends = np.stack([self.walk_i, self.walk_j])[:, self.touching(np.array([number]))]
        numbers, counts = np.unique(ends[ends != number], return_counts=True)
        return numbers[np.lexsort((numbers, -counts))]
