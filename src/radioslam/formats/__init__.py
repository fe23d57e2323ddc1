"""Log formats: one file each, and the registry that finds, recognises and reads logs."""

from radioslam.formats.registry import FORMATS, Format, find_logs, read_walk, read_walks, share_origin

__all__ = [
    "FORMATS",
    "Format",
    "find_logs",
    "read_walk",
    "read_walks",
    "share_origin",
]
