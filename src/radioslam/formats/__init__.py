"""Log formats: one file each, and the registry that finds, recognises and reads logs."""

from radioslam.formats.open_writer import write_walk
from radioslam.formats.registry import FORMATS, Format, find_logs, is_log, read_walk, read_walks, share_origin
from radioslam.formats.sensor_logger import walk_of_messages
from radioslam.formats.tum import read_tum, write_tum

__all__ = [
    "FORMATS",
    "Format",
    "find_logs",
    "is_log",
    "read_tum",
    "read_walk",
    "read_walks",
    "share_origin",
    "walk_of_messages",
    "write_tum",
    "write_walk",
]
