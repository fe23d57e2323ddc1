"""A log's bytes: gzip or not, and what is wrong when there are none."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from radioslam.errors import LogError

HEAD_BYTES = 8192
"""How much of a log tells its format."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_GZIP_MAGIC = b"\x1f\x8b"
ZIP_MAGIC = b"PK\x03\x04"
_ENDINGS = (".gz", ".txt", ".csv", ".log", ".tum", ".scans", ".zip", ".json", ".jsonl", ".ndjson", ".wifi")


def load(path: Path) -> bytes:
    """The whole text of a log, unpacked if it is gzip.

    Raises:
        LogError: missing, not readable, empty, binary, or gzip that is broken or is none.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _unreadable(path, error) from None
    if _is_gzip(path, data):
        try:
            data = gzip.decompress(data)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise _broken_gzip(path, error) from None
    return _check_text(path, data)


def load_head(path: Path) -> bytes:
    """The first ``HEAD_BYTES`` of a log's text, or of a zip as it is; else raises as ``load`` does."""
    try:
        with path.open("rb") as stream:
            data = stream.read(HEAD_BYTES)
    except OSError as error:
        raise _unreadable(path, error) from None
    if data.startswith(ZIP_MAGIC):
        return data
    if _is_gzip(path, data):
        try:
            data = zlib.decompressobj(wbits=31).decompress(data, HEAD_BYTES)
        except zlib.error as error:
            raise _broken_gzip(path, error) from None
    return _check_text(path, data)


def walk_name(path: Path) -> str:
    """The file name without its endings: ``a/b.txt.gz`` is ``b``."""
    name = path.name
    while name.endswith(_ENDINGS) and name.rpartition(".")[0]:
        name = name.rpartition(".")[0]
    return name


def shown(text: bytes | str, longest: int = 60) -> str:
    """A piece of a log as one printable line for a message."""
    words = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    short = words[:longest] + ("…" if len(words) > longest else "")
    return repr(short)


def _is_gzip(path: Path, data: bytes) -> bool:
    if data.startswith(_GZIP_MAGIC):
        return True
    if data and path.name.endswith(".gz"):
        raise LogError(path, "gzip data", "something else", "unpack it, or take the ending .gz away")
    return False


def _unreadable(path: Path, error: OSError) -> LogError:
    if isinstance(error, FileNotFoundError):
        return LogError(path, "a log", "no such file", "check the path")
    return LogError(path, "a readable file", (error.strerror or "an error").lower(), "check path and rights")


def _broken_gzip(path: Path, error: Exception) -> LogError:
    found = "a file cut short" if isinstance(error, EOFError) else f"damage ({error})"
    return LogError(path, "complete gzip data", found, "copy the log again from where it came")


def _check_text(path: Path, data: bytes) -> bytes:
    if not data.strip():
        raise LogError(path, "a log", "an empty file", "record again, or leave it out")
    if b"\0" in data[:HEAD_BYTES]:
        raise LogError(path, "text", "binary data", "export the log as UTF-8 text")
    return data.removeprefix(_BYTE_ORDER_MARK)
