"""What a version of a map consists of on the disk; readers and writers of it meet here."""

from __future__ import annotations

from pathlib import Path

RADIO_MAP = "radio_map.parquet"
"""Samples of all floors."""
FLOORS = "floors.json"
"""Names of the floors in the order of their folders."""
GROWING = "growing"
"""Folder of what the next version grows from; only the newest version has it, and it is not handed out."""


def floor_folder(folder: Path, number: int) -> Path:
    """The result folder of a floor."""
    return folder / f"floor-{number}"
