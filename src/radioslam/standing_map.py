"""A map that stands, into which walks are laid: the walks, their loops, and the places that it is condensed to.

A new walk is tied to the places around it and optimized alone, then together with the few walks that it has most loops
to. All others stay, so that the cost does not depend on how many they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam import planar
from radioslam.config import Config
from radioslam.errors import MappingError
from radioslam.fingerprints import represent
from radioslam.mapped_walk import MappedWalk, Ties, in_columns, joined
from radioslam.merging import MergedTracks, merge_tracks, standing_at
from radioslam.places import Samples, condense
from radioslam.seeking import FoundPlace
from radioslam.settling import Knowledge, Settled, polish, settle
from radioslam.similarity import Pairs, unit_rows
from radioslam.walk import Reference

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

UNKNOWN_SIGMA_M = 2.0
"""Of positions whose standard deviation nobody asked for."""
EMPTY = "expected at least one walk in the map, found none; add one"


@dataclass
class StandingMap:
    """Walks of one floor in one frame.

    Attributes:
        config: of all walks; ``merging.starts`` says how they are related.
        mapped: the walks by name.  ties: candidates of the last full optimization and of each walk since.
        knowledge: what the walks of the last full optimization taught; None while empty.
    """

    config: Config
    mapped: dict[str, MappedWalk] = field(default_factory=dict)
    ties: list[Ties] = field(default_factory=list)
    knowledge: Knowledge | None = None
    _column: dict[str, int] = field(default_factory=dict)
    _places: Samples = field(default_factory=Samples.none)

    def _lay(self, walk: MappedWalk, found: FoundPlace) -> None:
        """Tie a walk to the places around where it was found, then optimize it with the walks it has most loops to."""
        self.mapped[walk.name] = replace(walk, reason=found.reason)
        if found.position_xy is None:
            return
        fix = Reference(np.array([found.time_s]), found.position_xy[None], sigma_m=found.sigma_m)
        walk = replace(walk, fix=fix, reason="")
        merged = _turned(self._merged([walk]), fix, found.turn_rad)
        settled = settle(merged, self._samples(walk), self._places, self._known, self.config)
        self.ties.append(_ties_of(settled, walk.number))
        self._keep([replace(walk, poses=settled.poses, sigma_m=settled.sigma_m)])
        partners = self.ties[-1].kept.partners(walk.number)[: self.config.growing.partners]
        self._polish([walk.number, *partners.tolist()])

    def _polish(self, numbers: Sequence[int]) -> None:
        """Optimize some walks of the map together by the loops they have; all others stay."""
        walks = [walk for walk in self.mapped.values() if walk.tied and walk.number in numbers]
        if not walks:
            return
        own, loops = np.array([walk.number for walk in walks]), self._loops()
        loops = loops.select(loops.touching(own)).strongest(own, self.config.growing.per_cell)
        others, kept = self._outside(loops, walks)
        merged = standing_at(self._merged(walks), np.concatenate([walk.poses for walk in walks]))
        poses = polish(merged, kept, others, self._known, self.config)
        parts = np.split(poses, np.cumsum([len(walk.poses) for walk in walks])[:-1])
        self._keep([replace(walk, poses=part) for walk, part in zip(walks, parts, strict=True)])

    def _outside(self, loops: Ties, walks: Sequence[MappedWalk]) -> tuple[Samples, Pairs]:
        """The scans at the other ends of loops, and the loops as pairs that number them first, then those of walks."""
        by_number = {walk.number: walk for walk in self.mapped.values()}
        number, scan = (np.concatenate(c) for c in ((loops.walk_i, loops.walk_j), (loops.scan_i, loops.scan_j)))
        own = np.array([walk.number for walk in walks])
        first = np.cumsum([0, *(len(walk.poses) for walk in walks)])[:-1]
        inside = np.isin(number, own)
        ends, row = np.unique(np.column_stack([number, scan])[~inside], axis=0, return_inverse=True)
        numbers, first_end = np.unique(ends[:, 0], return_index=True)
        scans_of = np.split(ends[:, 1], first_end[1:])
        parts = [(by_number[k], scans) for k, scans in zip(numbers.tolist(), scans_of, strict=False)]
        node = np.empty(len(number), np.int64)
        node[~inside] = row.ravel()
        order = np.argsort(own)
        place = order[np.searchsorted(own[order], number[inside])]
        node[inside] = len(ends) + first[place] + scan[inside]
        i, j = node.reshape(2, -1)
        return _standing(parts), Pairs(np.minimum(i, j), np.maximum(i, j), loops.similarity)

    def _loops(self) -> Ties:
        return Ties.concatenate(ties.kept for ties in self.ties)

    def _keep(self, walks: Sequence[MappedWalk]) -> None:
        """Replace walks and their places."""
        self.mapped |= {walk.name: walk for walk in walks}
        others = self._places.select(~np.isin(self._places.walk, [walk.number for walk in walks]))
        samples = [self._samples(walk) for walk in walks]
        self._places = condense(Samples.concatenate([others, *samples]), self.config.growing)

    def _merged(self, walks: Sequence[MappedWalk]) -> MergedTracks:
        """Walks as a crowd of their own, each held at its fix."""
        held = self.config.merging.model_copy(update={"starts": "known"})
        fingerprints = joined([walk.fingerprints for walk in walks])
        strengths = represent(fingerprints.rss_dbm, self.config.fingerprints)
        tracks = [walk.held() for walk in walks]
        return merge_tracks(tracks, fingerprints, strengths, self._known.uncertainty, held)

    @property
    def _known(self) -> Knowledge:
        if self.knowledge is None:
            raise MappingError(EMPTY)
        return self.knowledge

    # The condensed map -----------------------------------------------------------------------------------------------

    def _samples(self, walk: MappedWalk) -> Samples:
        """All scans of a walk."""
        for name in walk.fingerprints.transmitters:
            self._column.setdefault(name, len(self._column))
        rows = unit_rows(represent(walk.fingerprints.rss_dbm, self.config.fingerprints))
        strengths = in_columns(rows, walk.fingerprints.transmitters, self._column)
        return replace(_standing([(walk, walk.fingerprints.scan)]), strengths=strengths)

    def condense_places(self) -> None:
        """Choose the scans that stand for the map from all of its walks."""
        every = Samples.concatenate([self._samples(walk) for walk in self.mapped.values() if walk.tied])
        self._places = condense(every, self.config.growing)


def _turned(merged: MergedTracks, fix: Reference, turn_rad: float) -> MergedTracks:
    """The walk turned about its fix to begin with."""
    pivot = fix.positions_xy[0]
    positions = planar.rotate(turn_rad, merged.poses[:, :2] - pivot) + pivot
    return replace(merged, poses=np.column_stack([positions, merged.poses[:, 2] + turn_rad]))


def _ties_of(settled: Settled, number: int) -> Ties:
    """The loops of a settled walk by the numbers of walks and scans."""
    pairs, places = settled.loops.pairs, settled.places
    walk = np.concatenate([places.walk, np.full(len(settled.poses), number)])
    scan = np.concatenate([places.scan, np.arange(len(settled.poses))])
    return Ties(walk[pairs.i], scan[pairs.i], walk[pairs.j], scan[pairs.j], pairs.similarity, settled.loops.reason)


def _standing(parts: Sequence[tuple[MappedWalk, Integers]]) -> Samples:
    """Where scans of walks stand, without what they heard."""
    if not parts:
        return Samples.none()

    def column(of: Callable[[MappedWalk], Array]) -> Array:
        return np.concatenate([of(walk)[scans] for walk, scans in parts])

    return Samples(
        walk=np.repeat([walk.number for walk, _ in parts], [len(scans) for _, scans in parts]),
        scan=np.concatenate([scans for _, scans in parts]),
        poses=column(lambda walk: walk.poses),
        velocity=column(lambda walk: walk.velocity),
        sigma_m=np.nan_to_num(column(lambda walk: walk.sigma_m), nan=UNKNOWN_SIGMA_M),
        distance_m=column(lambda walk: walk.fingerprints.distance_m),
        strengths=sparse.csr_array((sum(len(scans) for _, scans in parts), 0)),
    )
