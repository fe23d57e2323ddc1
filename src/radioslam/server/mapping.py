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


def make_map(walks: Sequence[Walk], config: Config, folder: Path, tell: Callable[[str], None]) -> SiteMap:
    """Map the walks into an existing, empty folder.

    Raises:
        MappingError: no walk can be mapped.
    """
    usable, skipped = _usable(walks)
    labels = sorted({walk.floor for walk in usable} - {""}) or [""]
    if len(labels) > 1:
        skipped += [(walk.name, "no floor, and the site has several") for walk in usable if not walk.floor]
    results: list[tuple[str, SlamResult]] = []
    for label in labels:
        here = [walk for walk in usable if walk.floor == label or (not walk.floor and len(labels) == 1)]
        try:
            results.append((label, map_walks(share_origin(here), config, tell)))
        except MappingError as error:
            skipped += [(walk.name, str(error)) for walk in here]
    if not results:
        raise MappingError("; ".join(sorted({reason for _, reason in skipped})) or "expected walks, found none")
    tell("writing")
    for k, (_, result) in enumerate(results):
        result.save(floor_folder(folder, k))
    floors = tuple(label for label, _ in results)
    maps = [result.radio_map for _, result in results]
    (merge(maps, floors) if len(maps) > 1 else maps[0]).save(folder / RADIO_MAP)
    (folder / FLOORS).write_text(json.dumps(floors), "utf-8")
    summaries = tuple(_short(result.summary()) for _, result in results)
    return SiteMap(floors, summaries, tuple(sorted(skipped)))


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
