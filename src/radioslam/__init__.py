"""RadioSLAM: walks recorded by many phones become their true paths and a radio map of the building.

walks = radioslam.read_walks(["logs/"])
result = radioslam.map_walks(walks, radioslam.load_config("default"))
result.save("result/")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from radioslam.config import Config, load_config
    from radioslam.errors import RadioSlamError
    from radioslam.formats import read_walk, read_walks, write_walk
    from radioslam.radio_map import RadioMap
    from radioslam.results import SlamResult
    from radioslam.slam import map_walks
    from radioslam.walk import Walk

_HOMES = {
    "Config": "radioslam.config",
    "RadioMap": "radioslam.radio_map",
    "RadioSlamError": "radioslam.errors",
    "SlamResult": "radioslam.results",
    "Walk": "radioslam.walk",
    "load_config": "radioslam.config",
    "map_walks": "radioslam.slam",
    "read_walk": "radioslam.formats",
    "read_walks": "radioslam.formats",
    "write_walk": "radioslam.formats",
}

__all__ = [
    "Config",
    "RadioMap",
    "RadioSlamError",
    "SlamResult",
    "Walk",
    "load_config",
    "map_walks",
    "read_walk",
    "read_walks",
    "write_walk",
]


def __getattr__(name: str) -> Any:
    """Import on first use, so that the command line answers at once."""
    if name not in _HOMES:
        raise AttributeError(f"module 'radioslam' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
