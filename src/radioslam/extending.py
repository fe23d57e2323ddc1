"""New walks into an existing map: where each was is found in the map, then all are mapped together in its frame.

The particle filter (``tracking``) follows a new walk through the map from an unknown start. A typical moment of its
answer becomes the walk's known position, held by the deviations of filter and map. The walks of the map take part as a
tracker would have told them: their optimized paths are their odometry, their first places are known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam.config import Config
from radioslam.errors import MappingError
from radioslam.following import follow_track
from radioslam.positioning import Positioner
from radioslam.radio_map import RadioMap
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.tracking import told_by
from radioslam.walk import RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]

MAX_SIGMA_M = 8.0
"""Where the filter never comes to know the walk better, it does not know the place."""


@dataclass(frozen=True)
class FoundPlace:
    """Where a walk was at ``time_s``: ``position_xy`` (2,) in the map's frame, known to ``sigma_m`` per axis.

    Or None, with the ``reason`` why nobody can tell.
    """

    time_s: float = np.nan
    position_xy: Array | None = None
    sigma_m: float = np.nan
    reason: str = ""


def extend_map(
    radio_map: RadioMap,
    walks: Sequence[Walk],
    config: Config,
    references: Mapping[str, Reference] | None = None,
    progress: Callable[[str], None] | None = None,
    seed: int = 1,
) -> SlamResult:
    """Map walks whose starts nobody knows together with those of a map of one floor, in its frame.

    A new walk replaces that of the same name. True positions of new walks are for judging only, as are ``references``,
    those of the map's own walks by name. Walks that do not belong to the map are in maps of their own, each with its
    reason.

    Raises:
        MappingError: a map of several floors, nothing to learn from in it, or walks that cannot be mapped.
        PositioningError: fewer than two samples in the map that heard something.
    """
    if len(set(radio_map.floors)) > 1:
        raise MappingError(f"expected a map of one floor, found floors {', '.join(sorted(set(radio_map.floors)))}")
    if progress:
        progress("finding places")
    new = {walk.name for walk in walks}
    old = [walk for walk in walks_of(radio_map) if walk.name not in new]
    positioner = Positioner.of(radio_map, config)
    seeking = [*walks, *(walk for walk in old if walk.reference is None)]
    places = {walk.name: find_place(positioner, walk, config, seed) for walk in seeking}
    everybody = [_placed(walk, places.get(walk.name)) for walk in (*old, *walks)]
    result = map_walks(everybody, _with_starts(config, "known"), progress)
    return _told(result, places, _truth(walks, references or {}), radio_map)


def _truth(walks: Sequence[Walk], references: Mapping[str, Reference]) -> dict[str, Reference]:
    """True positions by walk, those of new walks in the frame of the others where these have a place on earth."""
    origin = next((reference.origin_wgs84 for reference in references.values() if reference.origin_wgs84), None)
    new = {walk.name: walk.reference for walk in walks if walk.reference is not None}
    return {**references, **{name: one.with_origin(origin) if origin else one for name, one in new.items()}}


def find_place(positioner: Positioner, walk: Walk, config: Config, seed: int) -> FoundPlace:
    """Where a walk was at the moment at which the particle filter moves the track by the median of all moments.

    So neither a filter that lost its way for a while nor shaking that dead reckoning took for steps decides.
    """
    track, scans, unknown = told_by(positioner, walk, config)
    floor = positioner.floors[0]
    likeness = float(np.median(floor.neighbours.similarity(scans, unknown).max(axis=1)))
    if likeness < (usual := floor.calibration.usual_similarity):
        return FoundPlace(reason=f"not of this map: scans {likeness:.2f} like it, {usual:.2f} are usual")
    walked = follow_track(floor, track, scans, config, seed)
    offset = walked.poses[:, :2] - track.at(walked.time_s)[:, :2]
    best = int(np.hypot(*(offset - np.median(offset, axis=0)).T).argmin())
    sigma_m = float(walked.sigma_m[best])
    if sigma_m > MAX_SIGMA_M:
        return FoundPlace(reason=f"the map knows its place to {sigma_m:.0f} m at best, {MAX_SIGMA_M:.0f} m are needed")
    return FoundPlace(float(walked.time_s[best]), walked.poses[best, :2], sigma_m)


def walks_of(radio_map: RadioMap) -> Iterator[Walk]:
    """The walks of a map as a tracker would have told them; those of its largest map begin where they stand."""
    floors = radio_map.floors or ("",) * len(radio_map.walks)
    for k, (name, floor) in enumerate(zip(radio_map.walks, floors, strict=True)):
        samples = radio_map.select(radio_map.walk == k)
        tied = samples.map[0] == 0
        first = Reference(samples.time_s[:1], samples.poses[:1, :2]) if tied else None
        motion = Signal(samples.time_s, samples.poses)
        yield Walk(name, _scans(samples), odometry=motion, reference=first, floor=floor)


def _scans(samples: RadioMap) -> RadioScans:
    """The scans of one walk; those that heard nothing keep their place."""
    rss = samples.rss_dbm.tocsr()
    row = np.repeat(np.arange(len(samples)), np.diff(rss.indptr))
    names = np.array(samples.transmitters)[rss.indices].tolist()
    scans = RadioScans.from_readings(samples.time_s[row], names, rss.data)
    place = np.searchsorted(samples.time_s, scans.scan_time_s)
    return replace(scans, scan_time_s=samples.time_s, reading_scan=place[scans.reading_scan])


def _with_starts(config: Config, starts: str) -> Config:
    return config.model_copy(update={"merging": config.merging.model_copy(update={"starts": starts})})


def _placed(walk: Walk, place: FoundPlace | None) -> Walk:
    if place is None:
        return walk
    if place.position_xy is None:
        return replace(walk, reference=None)
    fix = Reference(np.array([place.time_s]), place.position_xy[None], sigma_m=place.sigma_m)
    return replace(walk, reference=fix)


def _told(
    result: SlamResult, places: Mapping[str, FoundPlace], truth: Mapping[str, Reference], radio_map: RadioMap
) -> SlamResult:
    """The result with the true references, what was found of each walk, and the map's own facts."""
    found = [places.get(name, FoundPlace()) for name in result.walks]
    reasons = (place.reason if m else "" for place, m in zip(found, result.map_of_walk, strict=True))
    floors = radio_map.floors[:1] * len(result.walks)
    return replace(
        result,
        config=_with_starts(result.config, "mixed"),
        radio_map=replace(result.radio_map, floors=floors, georeference=radio_map.georeference),
        references=tuple(truth.get(name) for name in result.walks),
        placed_sigma_m=tuple(place.sigma_m for place in found),
        untied_reason=tuple(reasons),
    )
