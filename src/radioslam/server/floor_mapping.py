"""One floor of a site: its map grows from the version before, or is a batch run of all its walks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

from radioslam.config import Config
from radioslam.errors import LogError, RadioSlamError, ResultError
from radioslam.formats.registry import share_origin
from radioslam.incremental import GrowingMap
from radioslam.results import SlamResult
from radioslam.server.site_walks import Recorded
from radioslam.server.standing import Kept, Standing
from radioslam.slam import map_walks
from radioslam.walk import Walk, check_walk


@dataclass(frozen=True)
class FloorWalks:
    """The walks of a floor.

    Attributes:
        floor: its name.  fresh: walks that are new, or other than the version before has them.
        same: names of those that are as it has them.  gone: names of those that it has and nobody has any more.
    """

    floor: str
    fresh: Sequence[Recorded]
    same: Collection[str] = ()
    gone: Collection[str] = ()


@dataclass(frozen=True)
class MadeFloor:
    """A floor's map.

    Attributes:
        why_full: why it is a batch run; empty where it has grown.  laid: how many walks were laid in.
        grown: what the next version grows from; None where it cannot.  kept: the walks that this call read, by name.
    """

    floor: str
    result: SlamResult
    why_full: str
    laid: int
    grown: GrowingMap | None
    kept: Mapping[str, Kept] = field(default_factory=dict)


def make_floor(
    here: FloorWalks,
    config: Config,
    standing: Standing | str,
    load: Callable[[Collection[str]], list[Recorded]],
    tell: Callable[[str], None],
) -> MadeFloor:
    """Map a floor; ``standing`` is the version before, or why it must not be built upon, ``load`` reads walks of it.

    Raises:
        MappingError: the walks cannot be mapped.
    """
    try:
        grown = _taken_up(here, standing)
        for k, walk in enumerate(_in_origin_of(grown, _walks(here.fresh))):
            tell(f"laying in walk {k + 1} of {len(here.fresh)}")
            grown.add(walk)
        return MadeFloor(here.floor, grown.result(), "", len(here.fresh), grown, kept(here.fresh))
    except RadioSlamError as error:
        why_full = str(error)
    recorded = sorted([*here.fresh, *usable(load(here.same))[0]], key=lambda one: one.name)
    walks = share_origin(_walks(recorded))
    result = map_walks(walks, config, tell)
    grows = None if config.merging.heading == "unknown" else GrowingMap.of(result, walks)
    return MadeFloor(here.floor, result, why_full, len(recorded), grows, kept(recorded))


def _taken_up(here: FloorWalks, standing: Standing | str) -> GrowingMap:
    """The floor's map of the version before; a ResultError says why a batch run is needed, or pays."""
    if isinstance(standing, str):
        raise ResultError(standing)
    if here.gone:  # what it taught the map would stay in it
        raise ResultError(f"{len(here.gone)} walks were taken out")
    grown = standing.growing(here.floor)
    if not set(here.same) <= set(grown.walks) <= {*here.same, *(one.name for one in here.fresh)}:
        raise ResultError("the state of the version before is of other walks")
    if grown.worth_rebuilding_with(_walks(here.fresh)):
        raise ResultError("so much is new that a full optimization pays")
    return grown


def _in_origin_of(grown: GrowingMap, walks: Sequence[Walk]) -> list[Walk]:
    """Walks whose references have the origin of those in the map."""
    standing = (one.track.walk for one in grown.mapped.values())
    first = [walk for walk in standing if walk.reference and walk.reference.origin_wgs84][:1]
    return share_origin([*first, *walks])[len(first) :]


def usable(recorded: Sequence[Recorded]) -> tuple[list[Recorded], list[tuple[str, str]]]:
    """Walks that can be mapped, and names and reasons of the others."""
    good, skipped = [], []
    for one in recorded:
        reason = one.reason or _fault(one.walk)
        if reason:
            skipped.append((one.name, reason))
        else:
            good.append(one)
    return good, skipped


def _fault(walk: Walk | None) -> str:
    try:
        if walk is not None:
            check_walk(walk)
    except LogError as error:
        return str(error)
    return ""


def kept(recorded: Sequence[Recorded]) -> dict[str, Kept]:
    """What the next version has to know of walks."""
    return {one.name: Kept(one.stamp, one.walk.floor) for one in recorded if one.walk}


def _walks(recorded: Sequence[Recorded]) -> list[Walk]:
    return [one.walk for one in recorded if one.walk]
