"""Walks of a site -> the folders of its map. The one file that knows how maps are made.

Floors are mapped apart, each into a result folder ``floor-0``, ``floor-1`` … in the order of their names, and joined in
``radio_map.parquet``. Walks without a floor belong to the only floor there is.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from radioslam.config import Config
from radioslam.errors import LogError, MappingError
from radioslam.formats.registry import share_origin
from radioslam.map_export import merge
from radioslam.results import SlamResult
from radioslam.server.map_files import FLOORS, RADIO_MAP, floor_folder
from radioslam.slam import map_walks
from radioslam.surveying import survey_map
from radioslam.walk import Walk, check_walk


@dataclass(frozen=True)
class SiteMap:
    """What was written: the names of the floors and a summary for each, and the walks left out with reasons."""

    floors: tuple[str, ...]
    summaries: tuple[dict[str, Any], ...]
    skipped: tuple[tuple[str, str], ...]

    def summary(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "floors": [{"floor": floor, **summary} for floor, summary in zip(self.floors, self.summaries, strict=True)],
            "skipped": [{"walk": walk, "reason": reason} for walk, reason in self.skipped],
        }


def make_map(
    walks: Sequence[Walk],
    config: Config,
    folder: Path,
    tell: Callable[[str], None],
    unread: Sequence[tuple[str, str]] = (),
) -> SiteMap:
    """Map the walks into an existing, empty folder; ``unread`` are names and reasons of walks that cannot be read.

    Raises:
        MappingError: no walk can be mapped.
    """
    surveyed = [walk for walk in walks if walk.motion is None and walk.reference is not None and len(walk.wifi)]
    usable, skipped = _usable([walk for walk in walks if walk not in surveyed])
    results, failed = _map_floors(usable, config, tell)
    skipped += [*unread, *failed]
    maps = [result.radio_map for _, result in results]
    labels = [label for label, _ in results]
    if surveyed and _frame_is_known(config):
        maps.append(survey_map(surveyed, config.fingerprints))
        labels.append("")
    elif surveyed:
        skipped += [(walk.name, "known positions, but the site's starts are not known") for walk in surveyed]
    if not maps:
        raise MappingError("; ".join(sorted({reason for _, reason in skipped})) or "expected walks, found none")
    tell("writing")
    for k, (_, result) in enumerate(results):
        result.save(floor_folder(folder, k))
    (merge(maps, labels if len(set(labels) - {""}) > 1 else None) if len(maps) > 1 else maps[0]).save(
        folder / RADIO_MAP
    )
    floors = tuple(label for label, _ in results)
    (folder / FLOORS).write_text(json.dumps(floors), "utf-8")
    return SiteMap(floors, tuple(_short(result.summary()) for _, result in results), tuple(sorted(skipped)))


def _map_floors(
    usable: Sequence[Walk], config: Config, tell: Callable[[str], None]
) -> tuple[list[tuple[str, SlamResult]], list[tuple[str, str]]]:
    """Results by floor, and the walks that are in none."""
    labels = sorted({walk.floor for walk in usable} - {""}) or [""]
    results, skipped = [], []
    if len(labels) > 1:
        skipped = [(walk.name, "no floor, and the site has several") for walk in usable if not walk.floor]
    for label in labels:
        here = [walk for walk in usable if walk.floor == label or (not walk.floor and len(labels) == 1)]
        try:
            if here:
                results.append((label, map_walks(share_origin(here), config, tell)))
        except MappingError as error:
            skipped += [(walk.name, str(error)) for walk in here]
    return results, skipped


def _frame_is_known(config: Config) -> bool:
    """Whether the map's frame is that of the known positions."""
    return config.merging.starts in ("known", "mixed")


def _usable(walks: Sequence[Walk]) -> tuple[list[Walk], list[tuple[str, str]]]:
    usable, skipped = [], []
    for walk in walks:
        try:
            usable.append(check_walk(walk))
        except LogError as error:
            skipped.append((walk.name, str(error)))
    return usable, skipped


def _short(summary: dict[str, Any]) -> dict[str, Any]:
    """A summary without the rows of walks, which stand in the folder."""
    return {key: value for key, value in summary.items() if key not in ("walks", "config")}
