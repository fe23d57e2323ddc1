"""The same map, one walk at a time.

What stands is moved as little as can be when a walk comes or goes (``standing_map``), so that it costs the same however
many walks there are. Most of them do not gain by it until a full optimization, which pays (``worth_rebuilding``) once
the map has grown by a part of itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import Config
from radioslam.errors import MappingError
from radioslam.fingerprints import collect_fingerprints
from radioslam.grown_result import as_result
from radioslam.mapped_walk import MappedWalk, Ties, lean, split
from radioslam.odometry import Track, estimate_odometry, estimate_track, pooled, scaled_like
from radioslam.places import Samples
from radioslam.results import SlamResult, SolverStatus
from radioslam.seeking import FoundPlace, seek
from radioslam.settling import Knowledge
from radioslam.similarity import pair_similarity
from radioslam.slam import map_tracks
from radioslam.standing_map import EMPTY, StandingMap
from radioslam.walk import Reference, Walk

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AddedWalk:
    """Where a new walk was: ``poses`` (n, 3) and ``sigma_m`` (n,) per axis of its scans at ``time_s`` (n,).

    ``tied`` says whether it stands in the map's frame, else ``reason`` why not. ``loops`` counts its own.
    """

    name: str
    time_s: Array
    poses: Array
    sigma_m: Array
    tied: bool
    reason: str
    loops: int


@dataclass
class GrowingMap(StandingMap):
    """A map of one floor that takes walks in and gives them back.

    Attributes:
        status: how the last full optimization went, None while empty.  rebuilt: how many scans it saw.
    """

    status: SolverStatus | None = None
    rebuilt: int = 0

    @staticmethod
    def begin(config: Config) -> GrowingMap:
        """An empty map; its first walk will anchor the frame."""
        return GrowingMap(config)

    @staticmethod
    def of(result: SlamResult, walks: Sequence[Walk]) -> GrowingMap:
        """A map as a batch run left it, with the walks that it was made of.

        Raises:
            MappingError: they are not the walks of the result.
            LogError: no motion in one of them.
        """
        walks = sorted(walks, key=lambda walk: walk.name)
        if tuple(walk.name for walk in walks) != result.walks:
            raise MappingError(f"expected the {len(result.walks)} walks of the result, found {len(walks)} others")
        grown = GrowingMap(result.config)
        grown._adopt(result, estimate_odometry(walks, result.config.odometry))
        return grown

    @property
    def walks(self) -> tuple[str, ...]:
        """Names of all walks, sorted."""
        return tuple(sorted(self.mapped))

    @property
    def worth_rebuilding(self) -> bool:
        """Whether so many scans came or went since the last full optimization that another one pays."""
        return self.worth_rebuilding_with(())

    def worth_rebuilding_with(self, walks: Sequence[Walk]) -> bool:
        """Whether it would pay after these are laid in, or would cost no more than to lay in so many of them."""
        growth = self.config.growing.rebuild_growth
        scans = {one.name: len(one.track.walk.wifi) for one in self.mapped.values()}
        scans |= {walk.name: len(walk.wifi) for walk in walks}
        grown = abs(sum(scans.values()) - self.rebuilt) > growth * self.rebuilt
        return grown or len(walks) > growth * len(self.mapped)

    def add(self, walk: Walk) -> AddedWalk:
        """Lay a walk into the map; one of the same name is replaced. The first one is the map.

        A walk that cannot be tied is kept in a frame of its own, and a full optimization tries it again.

        Raises:
            LogError: no motion in it.
            MappingError: another floor than the map's, or a first walk with too little to learn from.
        """
        self._check_floor(walk)
        track = self._track_of(walk)
        if walk.name in self.mapped:
            self.remove(walk.name)
        number = 1 + max((one.number for one in self.mapped.values()), default=-1)
        fingerprints = next(split(collect_fingerprints([track], self.config.fingerprints)))
        alone = MappedWalk(number, track, fingerprints, fingerprints.poses, np.zeros(len(fingerprints)))
        if self.knowledge is None:
            self._begin_with(alone)
        else:
            self._lay(alone, self._sought(alone))
        return self._told(walk.name)

    def remove(self, name: str) -> None:
        """Take a walk out; those that loops tied to it are optimized without it.

        Raises:
            MappingError: no walk of that name.
        """
        if name not in self.mapped:
            raise MappingError(f"expected a walk of the map, found {name!r}, which is not in it")
        gone = self.mapped.pop(name)
        partners = self._loops().partners(gone.number).tolist()
        self.ties = [ties.select(~ties.touching(np.array([gone.number]))) for ties in self.ties]
        if not self.mapped:
            self.knowledge = self.status = None
        self.condense_places()
        most = self.config.growing.partners + 1
        for k in range(0, len(partners), most):
            self._polish(partners[k : k + most])

    def rebuild(self) -> None:
        """Optimize all walks together as a batch run does, in the frame of the map.

        Raises:
            MappingError: no walks, or walks that cannot be mapped.
        """
        if not self.mapped:
            raise MappingError(EMPTY)
        walks = [self.mapped[name] for name in self.walks]
        tracks = pooled([one.held() if self._is_held(one) else one.track for one in walks], self.config.odometry)
        result = map_tracks(tracks, self.config)
        own = zip(tracks, walks, strict=True)
        self._adopt(self._in_frame(result), [replace(track, walk=one.track.walk) for track, one in own])
        for one in [one for one in self.mapped.values() if not one.tied]:
            self._lay(one, self._sought(one))

    def result(self) -> SlamResult:
        """The map as it stands.

        Raises:
            MappingError: no walks.
        """
        if self.knowledge is None or self.status is None:
            raise MappingError(EMPTY)
        walks = [self.mapped[name] for name in self.walks]
        return as_result(walks, Ties.concatenate(self.ties), self.knowledge, self.status, self.config)

    def judge_by(self, references: Mapping[str, Reference | None]) -> None:
        """True positions by walk, to judge the map by; what holds the walks stays what it is."""
        for name, reference in references.items():
            walk = self.mapped[name]
            told = replace(walk.track, walk=replace(walk.track.walk, reference=reference))
            self.mapped[name] = replace(walk, track=told)

    def save(self, folder: Path | str, force: bool = False) -> Path:
        """Write a folder that ``load`` reads, whole or not at all.

        Raises:
            ResultError: the folder exists and ``force`` is not given, or cannot be written.
        """
        from radioslam.growing_folder import write_growing

        return write_growing(self, Path(folder), force)

    @staticmethod
    def load(folder: Path | str) -> GrowingMap:
        """Read what ``save`` wrote.

        Raises:
            ResultError: a file is missing, cut short or not of this form.
        """
        from radioslam.growing_folder import read_growing

        return read_growing(Path(folder))

    # What a walk is and where it begins ------------------------------------------------------------------------------

    def _check_floor(self, walk: Walk) -> None:
        floors = {one.track.walk.floor for one in self.mapped.values()} - {""}
        if walk.floor and floors and walk.floor not in floors:
            raise MappingError(f"{walk.name}: expected a walk of floor {min(floors)}, found floor {walk.floor}")

    def _track_of(self, walk: Walk) -> Track:
        """Its odometry, with steps as long as those of the same phone model's walks in the map."""
        alike = [one.track for one in self.mapped.values() if one.track.walk.device == walk.device]
        return lean(scaled_like(estimate_track(walk, self.config.odometry), alike, self.config.odometry))

    def _sought(self, walk: MappedWalk) -> FoundPlace:
        """A place of the walk by what is known of starts, else by its scans."""
        starts, reference = self.config.merging.starts, walk.track.walk.reference
        if starts == "common":
            return self._common_start(walk)
        if starts != "unknown" and reference is not None:
            sigma_m = self.config.merging.start_sigma_m if reference.sigma_m is None else reference.sigma_m
            return FoundPlace(float(reference.time_s[0]), reference.positions_xy[0], sigma_m)
        return seek(self._samples(walk), walk.fingerprints.time_s, self._places, self.config)

    def _common_start(self, walk: MappedWalk) -> FoundPlace:
        hub = self.mapped[self.walks[0]]
        first = Samples.concatenate([self._samples(one).select(np.arange(1)) for one in (hub, walk)])
        similarity = pair_similarity(first.strengths, np.array([0]), np.array([1]))
        sigma_m = float(self._known.uncertainty.sigma(similarity)[0])
        return FoundPlace(float(walk.fingerprints.time_s[0]), hub.poses[0, :2], sigma_m)

    def _begin_with(self, walk: MappedWalk) -> None:
        before = dict(self.mapped)
        self.mapped[walk.name] = walk
        try:
            self.rebuild()
        except MappingError:
            self.mapped = before
            raise

    def _told(self, name: str) -> AddedWalk:
        walk = self.mapped[name]
        # Its loops are those of the last ties: only walks that come later add others.
        loops = int(np.sum(self.ties[-1].kept.touching(np.array([walk.number])))) if self.ties else 0
        return AddedWalk(name, walk.fingerprints.time_s, walk.poses, walk.sigma_m, walk.tied, walk.reason, loops)

    # Taking over a batch result --------------------------------------------------------------------------------------

    def _in_frame(self, result: SlamResult) -> SlamResult:
        """The result turned and shifted onto the map, where nothing else ties it to a frame."""
        if self.config.merging.starts != "unknown" or self.knowledge is None:
            return result
        before = [self.mapped[name] for name in result.walks]
        tied = np.concatenate([np.full(len(one.poses), one.tied) for one in before]) & (result.radio_map.map == 0)
        old, new = np.concatenate([one.poses for one in before])[tied], result.radio_map.poses
        pose = planar.align_rigid(new[tied, :2], old[:, :2])
        radio_map = replace(result.radio_map, poses=planar.compose(pose, new))
        axis_rad = result.solver.axis_rad
        turned = None if axis_rad is None else float((axis_rad + pose[2]) % (np.pi / 2))
        return replace(result, radio_map=radio_map, solver=replace(result.solver, axis_rad=turned))

    def _adopt(self, result: SlamResult, tracks: Sequence[Track]) -> None:
        """Take over poses, loops and all that the batch learned of ``tracks``, in the order of the result."""
        samples, tied = result.radio_map, result.map_of_walk == 0
        parts = split(collect_fingerprints(tracks, self.config.fingerprints))
        mapped = {}
        for k, (track, part) in enumerate(zip(tracks, parts, strict=True)):
            here = samples.walk == k
            walk = MappedWalk(k, lean(track), part, samples.poses[here], samples.sigma_m[here])
            reason = result.untied_reason[k] if result.untied_reason else ""
            fix = self._fix_of(walk) if tied[k] else None
            mapped[walk.name] = replace(
                walk, fix=fix, reason=reason or ("" if tied[k] else "nothing ties it to the map")
            )
        pairs, scan = result.loops.pairs, np.concatenate([one.fingerprints.scan for one in mapped.values()])
        ends = samples.walk[pairs.i], scan[pairs.i], samples.walk[pairs.j], scan[pairs.j]
        self.mapped, self.ties = mapped, [Ties(*ends, pairs.similarity, result.loops.reason)]
        self.knowledge = Knowledge(result.uncertainty, result.solver.radio_lag_s, result.solver.axis_rad)
        self.status = result.solver
        self.rebuilt = sum(len(one.track.walk.wifi) for one in mapped.values())
        self.condense_places()

    def _is_held(self, walk: MappedWalk) -> bool:
        """Whether a batch run takes the fix of a walk for its known position."""
        starts, reference = self.config.merging.starts, walk.track.walk.reference
        return walk.tied and (starts == "known" or (starts == "mixed" and reference is not None))

    def _fix_of(self, walk: MappedWalk) -> Reference:
        """What holds a walk that the batch tied: as before, its known start, or else its place of now, weakly."""
        merging, reference = self.config.merging, walk.track.walk.reference
        before = self.mapped.get(walk.name)
        if before is not None and before.fix is not None and self._is_held(before):
            return before.fix
        if merging.starts in ("known", "mixed") and reference is not None:
            return Reference(reference.time_s[:1], reference.positions_xy[:1], sigma_m=reference.sigma_m)
        common = merging.starts == "common"
        k, sigma_m = (0, merging.start_sigma_m) if common else (len(walk.poses) // 2, merging.placed_sigma_m)
        return Reference(walk.fingerprints.time_s[k : k + 1], walk.poses[k : k + 1, :2], sigma_m=sigma_m)
