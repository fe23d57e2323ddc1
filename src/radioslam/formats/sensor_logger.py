"""Recordings of the app Sensor Logger (https://github.com/tszheichoi/awesome-sensor-logger): where its streams stand.

Four forms of one thing: the zip export, a CSV per sensor; that zip unpacked; the JSON export, an array of records
that bear their sensor; and the messages that the app pushes by HTTP or MQTT, saved one a line in any order.
``sensor_streams`` tells what the columns mean.
"""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from radioslam.errors import LogError
from radioslam.formats.loading import ZIP_MAGIC, load, load_head, shown, walk_name
from radioslam.formats.records import Records, from_csv, from_objects, json_documents
from radioslam.formats.sensor_streams import STREAMS, stream_name, walk_of_streams
from radioslam.walk import Walk

LARGEST_TEXT_BYTES = 2 << 30
"""What a zip's CSV files may hold together, unpacked."""

_ZIP_HEAD = re.compile(re.escape(ZIP_MAGIC) + rb".{26}[^\0]{0,200}?\.csv", re.DOTALL)
_JSON_EXPECTED = "records with a sensor, or messages with a payload"
_ADVICE = "export the recording again"


def sniff(head: bytes) -> bool:
    """Whether the first bytes are a zip of CSV files, such a CSV, the JSON export, or pushed messages."""
    first = head.split(b"\n", 1)[0]
    if head.startswith(ZIP_MAGIC):
        return _ZIP_HEAD.match(head) is not None
    if head.lstrip()[:1] in (b"[", b"{"):
        exported = b'"sensor"' in head and b'"time"' in head
        return exported or (b'"payload"' in head and (b'"messageId"' in head or b'"sessionId"' in head))
    return b"seconds_elapsed" in first.split(b",") or first.startswith(b"version,device name")


def log_of(path: Path) -> Path:
    """The first file, by name, of an unpacked recording; zip and JSON as they are."""
    return next(iter(_unpacked(path)), path) if path.name.lower().endswith(".csv") else path


def read(path: Path) -> Walk:
    """Read a recording in any of its forms; of an unpacked one any of its files.

    Raises:
        LogError: it is damaged; the message names file and line.
    """
    with path.open("rb") if path.is_file() else _nothing(path) as stream:
        is_zip = stream.read(len(ZIP_MAGIC)) == ZIP_MAGIC
    if is_zip:
        return walk_of_streams(_from_csvs(path, _zipped(path)), walk_name(path), path)
    if log_of(path) != path or path in _unpacked(path):
        files = ((file, file.stem, load(file)) for file in _unpacked(path))
        return walk_of_streams(_from_csvs(path, files), path.resolve().parent.name or walk_name(path), path)
    data = load(path)
    if data.lstrip()[:1] not in (b"[", b"{"):
        return walk_of_streams(_from_csvs(path, [(path, walk_name(path), data)]), walk_name(path), path)
    documents = [*json_documents(path, data)]
    flat = [(one, line) for value, line in documents for one in (value if isinstance(value, list) else [value])]
    return _walk_of_json(flat, walk_name(path), path)


def walk_of_messages(messages: Sequence[Mapping[str, Any]], name: str) -> Walk:
    """The walk of pushed messages in any order; one that came twice counts once.

    Args:
        messages: ``{"messageId", "sessionId", "deviceId", "payload": [{"name", "time", "values": {...}}, ...]}``;
            fields may stand beside ``time`` instead of in ``values``.
        name: of the walk.

    Raises:
        LogError: a message is none, its readings make no sense, or they are of several sessions; the line is the
            message's number.
    """
    return _walk_of_json([(message, number) for number, message in enumerate(messages, start=1)], name, Path(name))


def _nothing(path: Path) -> Any:
    raise LogError(path, "a log", "no such file", "check the path")


def _unpacked(path: Path) -> list[Path]:
    """The CSV files of the recording beside this one, sorted."""
    if not path.is_file():
        return []
    files = sorted(path.parent.glob("*.csv"))
    return [file for file in files if stream_name(file.stem) in STREAMS and _is_stream(file)]


def _is_stream(path: Path) -> bool:
    try:
        return sniff(load_head(path))
    except LogError:
        return False


def _zipped(path: Path) -> Iterator[tuple[Path, str, bytes]]:
    """Path for messages, stem and text of each CSV of a stream that we read."""
    try:
        with zipfile.ZipFile(path) as archive:
            wanted = [one for one in archive.infolist() if _is_wanted(one.filename)]
            if sum(one.file_size for one in wanted) > LARGEST_TEXT_BYTES:
                raise LogError(path, f"at most {LARGEST_TEXT_BYTES >> 30} GB of CSV", "more", "split the recording")
            for one in wanted:
                yield path / one.filename, PurePosixPath(one.filename).stem, archive.read(one)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError, OSError) as error:
        raise LogError(path, "a complete zip file", shown(str(error)), "copy or export it again") from None


def _is_wanted(name: str) -> bool:
    return name.lower().endswith(".csv") and stream_name(PurePosixPath(name).stem) in STREAMS


def _from_csvs(path: Path, files: Any) -> dict[str, Records]:
    streams: dict[str, Records] = {}
    for place, stem, data in files:
        name = stream_name(stem)
        if name in streams:
            raise LogError(path, "one file per sensor", f"two of {shown(stem)}", "one recording per zip")
        if data.strip():
            streams[name] = from_csv(place, data.removeprefix(b"\xef\xbb\xbf"))
    if not streams:
        raise LogError(path, "CSV files such as WiFi.csv and Accelerometer.csv", "none", _ADVICE)
    return streams


def _walk_of_json(values: Sequence[tuple[Any, int]], name: str, path: Path) -> Walk:
    by_stream: dict[str, tuple[list[Mapping[str, Any]], list[int]]] = {}
    for stream, record, line in _json_records(path, values):
        objects, lines = by_stream.setdefault(stream, ([], []))
        objects.append(record)
        lines.append(line)
    if not by_stream:
        raise LogError(path, _JSON_EXPECTED, "none", _ADVICE)
    return walk_of_streams({key: from_objects(path, *rows) for key, rows in by_stream.items()}, name, path)


def _json_records(path: Path, values: Sequence[tuple[Any, int]]) -> Iterator[tuple[str, Mapping[str, Any], int]]:
    """Stream, fields and line of each record, those of messages in the order in which they were sent."""
    messages: dict[Any, tuple[list[Any], int]] = {}
    sessions: set[str] = set()
    for value, line in values:
        if not isinstance(value, Mapping):
            raise LogError(path, _JSON_EXPECTED, shown(str(value)), _ADVICE, line)
        if "payload" in value:
            number, payload = _message(path, value, line, len(messages))
            messages.setdefault(number, (payload, line))
            sessions.add(str(value.get("sessionId", "")))
        else:
            yield _record(path, value, "sensor", line)
    if len(sessions) > 1:
        raise LogError(path, "messages of one session", f"{len(sessions)} sessions", "one file per session")
    for number in sorted(messages):
        payload, line = messages[number]
        yield from (_record(path, one, "name", line) for one in payload)


def _message(path: Path, value: Mapping[str, Any], line: int, count: int) -> tuple[float, list[Any]]:
    number, payload = value.get("messageId", count), value["payload"]
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not isinstance(payload, list):
        raise LogError(path, "a message with messageId and payload", shown(str(value)), _ADVICE, line)
    if number != number:
        raise LogError(path, "a message with messageId and payload", shown(str(value)), _ADVICE, line)
    return number, payload


def _record(path: Path, value: Any, key: str, line: int) -> tuple[str, Mapping[str, Any], int]:
    if not isinstance(value, Mapping) or not isinstance(value.get(key), str):
        raise LogError(path, f"a record with {key}", shown(str(value)), _ADVICE, line)
    inner = value.get("values")
    return stream_name(value[key]), {**value, **inner} if isinstance(inner, Mapping) else value, line
