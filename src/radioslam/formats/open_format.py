"""RadioSLAM's own format: placeholder until the next commit."""

from __future__ import annotations

from pathlib import Path

from radioslam.walk import Walk


def sniff(head: bytes) -> bool:
    """Not yet."""
    return False


def read(path: Path) -> Walk:
    """Not yet."""
    raise NotImplementedError


def log_of(path: Path) -> Path:
    """The log itself."""
    return path


def is_partner(path: Path) -> bool:
    """Not yet."""
    return False


def is_scans(path: Path) -> bool:
    """Not yet."""
    return False
