"""Uploaded files and zips -> walks, within limits of bytes, ratio and number."""

from __future__ import annotations

import gzip
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO

from radioslam.errors import LogError, ServiceError, TooLargeError
from radioslam.formats.registry import find_logs, read_walk, recognise, share_origin
from radioslam.server.privacy import scrub
from radioslam.server.settings import Limits
from radioslam.walk import Walk, check_walk

CHUNK_BYTES = 256 * 1024
LEAST_SUSPICIOUS_BYTES = 1024 * 1024
"""Unpacked files below are never a bomb, whatever their ratio."""


def read_upload(name: str, content: IO[bytes], limits: Limits) -> tuple[list[Walk], int]:
    """The walks of a log, or of a zip of logs, and how many readings of networks that opted out were dropped.

    Raises:
        ServiceError: it is none that can be mapped; the message names the file as the client does.
        TooLargeError: it unpacks to more than the limits allow.
    """
    with tempfile.TemporaryDirectory(prefix="radioslam-upload-") as folder:
        place = Path(folder) / (_plain_name(name).partition(".")[0] or "log")
        place.mkdir()
        try:
            return _read(_unpack(name, content, place, limits))
        except LogError as error:
            raise ServiceError(str(error).replace(f"{place}/", "").replace(str(place), _plain_name(name))) from None


def _read(source: Path) -> tuple[list[Walk], int]:
    walks, dropped = [], 0
    for path in find_logs([source]):
        dropped += scrub(path, recognise(path).name)
        walks.append(check_walk(read_walk(path)))
    return share_origin(walks), dropped


def _unpack(name: str, content: IO[bytes], folder: Path, limits: Limits) -> Path:
    """Write what came below the folder; the log, or the folder where it was a zip."""
    budget = _Budget(limits)
    if not zipfile.is_zipfile(content):
        content.seek(0)
        return _copy(_plain_name(name), content, folder, budget)
    content.seek(0)
    try:
        with zipfile.ZipFile(content) as archive:
            for entry in _entries(archive, limits):
                with archive.open(entry) as file:
                    _copy(_inside(entry.filename), file, folder, budget, entry.compress_size)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise LogError(_plain_name(name), "a whole zip without a password", str(error), "pack it again") from None
    return folder


def _entries(archive: zipfile.ZipFile, limits: Limits) -> Iterator[zipfile.ZipInfo]:
    entries = [entry for entry in archive.infolist() if not entry.is_dir()]
    if len(entries) > limits.archive_files:
        raise TooLargeError(f"expected a zip of at most {limits.archive_files} files, found {len(entries)}; split it")
    return (entry for entry in entries if not PurePosixPath(entry.filename).name.startswith("."))


def _inside(name: str) -> str:
    """A zip's path without what leads out of the folder."""
    parts = [part for part in PurePosixPath(name.replace("\\", "/")).parts if part not in ("/", "..", ".")]
    return "/".join(part[:100] for part in parts[-4:]) or "log"


def _plain_name(name: str) -> str:
    return _inside("".join(c for c in name if c.isprintable())).rpartition("/")[2]


class _Budget:
    """How many bytes may still be unpacked."""

    def __init__(self, limits: Limits) -> None:
        self.left, self.limits = limits.unpacked_bytes, limits

    def spend(self, chunk: int, unpacked: int, packed: int | None) -> None:
        self.left -= chunk
        if self.left < 0:
            raise TooLargeError(f"expected at most {self.limits.unpacked_bytes} bytes unpacked, found more; split it")
        suspicious = packed is not None and unpacked > LEAST_SUSPICIOUS_BYTES
        if suspicious and unpacked > self.limits.unpacking_ratio * max(packed or 0, 1):
            raise TooLargeError(f"expected files packed at most 1 : {self.limits.unpacking_ratio:g}, found more")


def _copy(name: str, file: IO[bytes], folder: Path, budget: _Budget, packed: int | None = None) -> Path:
    """Write one file below the folder; gzip is unpacked on the way, so that readers find plain text."""
    target = folder / name.removesuffix(".gz")
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.open("wb") as out:
        total = 0
        for chunk in _chunks(file):
            total += len(chunk)
            budget.spend(len(chunk), total, packed)
            out.write(chunk)
    with target.open("rb") as written:
        is_gzip = written.read(2) == b"\x1f\x8b"
    if is_gzip:
        _gunzip(name, target, budget)
    return target


def _chunks(file: IO[bytes] | gzip.GzipFile) -> Iterator[bytes]:
    while chunk := file.read(CHUNK_BYTES):
        yield chunk


def _gunzip(name: str, path: Path, budget: _Budget) -> None:
    partial = path.with_name(path.name + ".partial")
    try:
        with gzip.open(path) as packed, partial.open("wb") as out:
            total = 0
            for chunk in _chunks(packed):
                total += len(chunk)
                budget.spend(len(chunk), total, path.stat().st_size)
                out.write(chunk)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise LogError(name, "whole gzip data", str(error), "copy the log again from where it came") from None
    partial.replace(path)
