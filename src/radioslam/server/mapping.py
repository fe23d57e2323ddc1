"""Walks of a site -> the folders of its map. The one file that knows how maps are made.

Floors are mapped apart, each into a result folder ``floor-0``, ``floor-1`` … in the order of their names, and joined in
``radio_map.parquet``. Walks without a floor belong to the only floor there is. A floor grows from the version before
where it may (``floor_mapping``), else all its walks are mapped anew.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from radioslam.config import Config
from radioslam.errors import MappingError, ResultError
from radioslam.map_export import merge
from radioslam.server.floor_mapping import FloorWalks, MadeFloor, make_floor, usable
from radioslam.server.map_files import FLOORS, RADIO_MAP, floor_folder
from radioslam.server.site_walks import Recorded
from radioslam.server.standing import Standing, read_standing, write_standing
from radioslam.surveying import survey_map
from radioslam.walk import Walk

Skipped = list[tuple[str, str]]
"""Names of walks and why they are not on the map."""
REASONS_TOLD = 2


class Walks(Protocol):
    """Where walks come from; see ``site_walks``."""

    def stamps(self) -> dict[str, str]:
        """What tells the states of each walk apart, by name."""

    def load(self, names: Collection[str]) -> list[Recorded]:
        """Those of these names that are still there, as they are now."""


@dataclass(frozen=True)
class SiteMap:
    """What was written: the floors, the walks left out with reasons, and how long it took."""

    floors: tuple[MadeFloor, ...]
    skipped: tuple[tuple[str, str], ...]
    duration_s: float

    def summary(self) -> dict[str, Any]:
        """For JSON."""
        grown = bool(self.floors) and all(not one.why_full for one in self.floors)
        return {
            "made": "grown" if grown else "full",
            "duration_s": round(self.duration_s, 3),
            "floors": [_summary(one) for one in self.floors],
            "skipped": [{"walk": walk, "reason": reason} for walk, reason in self.skipped],
        }


@dataclass(frozen=True)
class _Crowd:
    """The site's walks by floor, those with known positions and no motion, and those on no map."""

    floors: list[FloorWalks]
    surveyed: list[Walk]
    skipped: Skipped


def make_map(walks: Walks, config: Config, folder: Path, tell: Callable[[str], None], before: Path | str) -> SiteMap:
    """Map the walks into an existing, empty folder.

    ``before`` is the folder of the version to grow from, or the reason why none is.

    Raises:
        MappingError: no walk can be mapped.
    """
    started_s = time.perf_counter()
    tell("reading walks")
    standing = _standing(before, config)
    crowd = _crowd(walks, standing)
    if not isinstance(standing, str) and tuple(one.floor for one in crowd.floors) != standing.floors:
        return make_map(walks, config, folder, tell, "the site's floors are others")
    made, failed = _make_floors(crowd.floors, config, standing, walks, tell)
    skipped = [*crowd.skipped, *failed, *_left_out_of_survey(crowd.surveyed, config)]
    surveyed = crowd.surveyed if _frame_is_known(config) else []
    if not made and not surveyed:
        raise MappingError(_why_nothing([reason for _, reason in skipped]))
    tell("writing")
    _write(made, surveyed, config, folder)
    _write_standing(crowd, made, config, standing, folder)
    return SiteMap(tuple(made), tuple(sorted(skipped)), time.perf_counter() - started_s)


def _standing(before: Path | str, config: Config) -> Standing | str:
    """What may be grown from, or why nothing may."""
    if isinstance(before, str):
        return before
    if config.merging.heading == "unknown":
        return "with unknown headings maps do not grow"
    try:
        return read_standing(before, config)
    except ResultError as error:
        return str(error)


def _crowd(walks: Walks, standing: Standing | str) -> _Crowd:
    """Walks as the version before has them are left unread."""
    stamps, known = walks.stamps(), {} if isinstance(standing, str) else standing.walks
    same = {name: kept.floor for name, kept in known.items() if stamps.get(name) == kept.stamp}
    recorded = walks.load(stamps.keys() - same.keys())
    surveyed = {one.name: one.walk for one in recorded if one.walk and _is_surveyed(one.walk)}
    fresh, skipped = usable([one for one in recorded if one.name not in surveyed])
    said = {one.name: one.walk.floor for one in fresh if one.walk}
    floors = sorted({*said.values(), *same.values()} - {""}) or [""]
    alone = floors[0] if len(floors) == 1 else None
    on = {name: floor or alone for name, floor in {**same, **said}.items()}
    gone = {name: kept.floor or alone for name, kept in known.items() if name not in on}
    skipped += [(name, "no floor, and the site has several") for name in said if on[name] is None]
    parts = [
        FloorWalks(
            floor,
            [one for one in fresh if on[one.name] == floor],
            [name for name in same if on[name] == floor],
            [name for name in gone if gone[name] == floor],
        )
        for floor in floors
    ]
    return _Crowd(parts, list(surveyed.values()), skipped)


def _make_floors(
    floors: list[FloorWalks], config: Config, standing: Standing | str, walks: Walks, tell: Callable[[str], None]
) -> tuple[list[MadeFloor], Skipped]:
    """Maps of the floors, and the walks of those that cannot be mapped."""
    made, failed = [], []
    for here in floors:
        try:
            if here.fresh or here.same:
                made.append(make_floor(here, config, standing, walks.load, tell))
        except MappingError as error:
            failed += [(name, str(error)) for name in (*here.same, *(one.name for one in here.fresh))]
    return made, failed


def _write(made: list[MadeFloor], surveyed: list[Walk], config: Config, folder: Path) -> None:
    """The result folders and what joins them."""
    maps = [one.result.radio_map for one in made]
    labels = [one.floor for one in made]
    if surveyed:
        maps.append(survey_map(surveyed, config.fingerprints))
        labels.append("")
    for k, one in enumerate(made):
        one.result.save(floor_folder(folder, k))
    joined = merge(maps, labels if len(set(labels) - {""}) > 1 else None) if len(maps) > 1 else maps[0]
    joined.save(folder / RADIO_MAP)
    (folder / FLOORS).write_text(json.dumps([one.floor for one in made]), "utf-8")


def _write_standing(
    crowd: _Crowd, made: list[MadeFloor], config: Config, standing: Standing | str, folder: Path
) -> None:
    """What the next version grows from."""
    before = {} if isinstance(standing, str) else standing.walks
    maps = {one.floor: one.grown for one in made if one.grown is not None}
    same = {name for here in crowd.floors if here.floor in maps for name in here.same}
    kept = {name: before[name] for name in same} | {
        name: walk for one in made if one.floor in maps for name, walk in one.kept.items()
    }
    write_standing(folder, config, [here.floor for here in crowd.floors], maps, kept)


def _is_surveyed(walk: Walk) -> bool:
    return walk.motion is None and walk.reference is not None and len(walk.wifi) > 0


def _left_out_of_survey(surveyed: list[Walk], config: Config) -> Skipped:
    if _frame_is_known(config):
        return []
    return [(walk.name, "known positions, but the site's starts are not known") for walk in surveyed]


def _why_nothing(reasons: Sequence[str]) -> str:
    """One line, however many walks there are."""
    different = sorted(set(reasons))
    more = f"; and {len(different) - REASONS_TOLD} other reasons" if len(different) > REASONS_TOLD else ""
    return "; ".join(different[:REASONS_TOLD]) + more if different else "expected walks, found none"


def _frame_is_known(config: Config) -> bool:
    """Whether the map's frame is that of the known positions."""
    return config.merging.starts in ("known", "mixed")


def _summary(one: MadeFloor) -> dict[str, Any]:
    """How a floor was made, and its result's summary without the rows of walks, which stand in the folder."""
    made = {"floor": one.floor, "made": "full" if one.why_full else "grown", "why": one.why_full, "laid": one.laid}
    return made | {key: value for key, value in one.result.summary().items() if key not in ("walks", "config")}
