"""What a version of a site's map keeps so that the next one can grow from it.

growing/standing.json  what it was made by, the site's floors, and per walk on them its stamp and floor
growing/floor-0 …      each floor's growing map (``growing_folder``), in the order of the floors; none where it failed
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from radioslam.config import Config
from radioslam.errors import ResultError
from radioslam.incremental import GrowingMap
from radioslam.server.map_files import GROWING, floor_folder

STANDING = "standing.json"


@dataclass(frozen=True)
class Kept:
    """A walk that is on a floor's map: its stamp, and the floor that it said to be on."""

    stamp: str
    floor: str


@dataclass(frozen=True)
class Standing:
    """The state of a version in its folder.

    Attributes:
        floors: the site's, also those that could not be mapped.  walks: by name, those that are on a map.
    """

    folder: Path
    floors: tuple[str, ...]
    walks: Mapping[str, Kept]

    def growing(self, floor: str) -> GrowingMap:
        """The map of a floor.

        Raises:
            ResultError: none is there, or it cannot be read.
        """
        return GrowingMap.load(floor_folder(self.folder / GROWING, self.floors.index(floor)))


def read_standing(version: Path, config: Config) -> Standing:
    """What a version's folder holds to grow from.

    Raises:
        ResultError: nothing, nothing that can be read, or a map that was made otherwise.
    """
    try:
        state = json.loads((version / GROWING / STANDING).read_text("utf-8"))
        walks = {name: Kept(**kept) for name, kept in state["walks"].items()}
        floors, made_by = tuple(state["floors"]), state["made_by"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise ResultError("the version before left no state that can be read") from None
    if made_by != _made_by(config):
        raise ResultError("the configuration or the program is another")
    return Standing(version, floors, walks)


def write_standing(
    version: Path, config: Config, floors: Sequence[str], maps: Mapping[str, GrowingMap], walks: Mapping[str, Kept]
) -> None:
    """Into a folder of a version that is not whole yet: the floors, the maps of those that have one, and the walks."""
    (version / GROWING).mkdir()
    for floor, grown in maps.items():
        grown.save(floor_folder(version / GROWING, floors.index(floor)))
    state = {
        "made_by": _made_by(config),
        "floors": list(floors),
        "walks": {name: {"stamp": kept.stamp, "floor": kept.floor} for name, kept in walks.items()},
    }
    (version / GROWING / STANDING).write_text(json.dumps(state), "utf-8")


def _made_by(config: Config) -> list[str]:
    return [importlib.metadata.version("radioslam"), config.to_toml()]
