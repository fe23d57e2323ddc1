r"""Traces of the Indoor Location Competition 2.0.

A record per line, ``<milliseconds>\tTYPE_<what>\t<fields>``, header lines begin with ``#``. A newline may be
missing, so that a record starts in the middle of a line: thirteen digits, a tab and ``TYPE_`` are its mark.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.lines import Layout, Lines, parse
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.streams import (
    PHONE_SENTINELS_DBM,
    make_reference,
    make_scans,
    make_signal,
    unit_quaternions,
)
from radioslam.walk import Inertial, RadioScans, Signal, Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Streams = dict[bytes, Lines]

_KINDS = (b"ACCELEROMETER", b"GYROSCOPE", b"MAGNETIC_FIELD", b"ROTATION_VECTOR", b"WIFI", b"BEACON", b"WAYPOINT")
_COMMENT = b"#\t"
_MARK = b"\tTYPE_"
_TIME_DIGITS = 13
_KIND_AT = _TIME_DIGITS + len(_MARK)
_WORD_BYTES = 24
_RECORD = re.compile(rb"\d{13}\tTYPE_")
_HEADER = re.compile(rb"#\t[A-Za-z]{4,}:")
_SNIFF = re.compile(rb"\d{13}\s+TYPE_[A-Z]|^#\s+startTime:", re.MULTILINE)

_VECTOR = Layout(("time ms", "TYPE", "x", "y", "z", "accuracy"), ("time ms", "x", "y", "z"))
_WAYPOINT = Layout(("time ms", "TYPE_WAYPOINT", "x", "y"), ("time ms", "x", "y"))
_WIFI = Layout(
    ("time ms", "TYPE_WIFI", "SSID", "BSSID", "RSS", "MHz", "last seen ms"),
    ("time ms", "RSS", "MHz", "last seen ms"),
    text="BSSID",
    free="SSID",
)
_BEACON = Layout(
    ("time ms", "TYPE_BEACON", "UUID", "major", "minor", "power", "RSS", "distance", "MAC", "time ms again"),
    ("time ms", "RSS"),
    text="MAC",
    optional=1,
)


def sniff(head: bytes) -> bool:
    """Whether the first bytes of a file look like such a trace."""
    return _SNIFF.search(head) is not None


def read(path: Path) -> Walk:
    """Read a trace.

    Raises:
        LogError: it is damaged; the message names the line.
    """
    data = load(path)
    streams = _split_records(path, data)
    notes: list[str] = []
    header = _header(data)
    waypoints = parse(streams[b"WAYPOINT"], _WAYPOINT).numbers
    return Walk(
        name=walk_name(path),
        wifi=_wifi(streams[b"WIFI"], notes),
        ble=_beacons(streams[b"BEACON"], notes),
        inertial=_inertial(streams, notes),
        reference=make_reference(streams[b"WAYPOINT"], waypoints[:, 0] / 1e3, waypoints[:, 1:], notes),
        device=" ".join(filter(None, (header.get("Brand"), header.get("Model")))),
        floor=_floor(path) or header.get("FloorName", ""),
        path=path,
        notes=tuple(notes),
    )


def _split_records(path: Path, data: bytes) -> Streams:
    """The records by kind: as lines, which is fast; by the mark of a record where lines are odd."""
    start, end = _line_bounds(data)
    words = _words_after_time(data, start)
    is_record = _begins_with(words, _MARK)
    others = [data[start[i] : end[i]] for i in np.flatnonzero(~is_record)]
    is_odd = any(line.strip() and not line.startswith(b"#") for line in others)
    comments = sum(line.startswith(_COMMENT) for line in others)
    records = int(np.count_nonzero(is_record))
    if is_odd or not records or records < data.count(_MARK) or comments < data.count(_COMMENT):
        return _split_odd_records(path, data)
    streams = {}
    for kind in _KINDS:
        rows = np.flatnonzero(_begins_with(words, _MARK + kind + b"\t"))
        bounds = zip(start[rows].tolist(), end[rows].tolist(), strict=True)
        streams[kind] = Lines(path, [data[i:j] for i, j in bounds], (rows + 1).tolist())
    return streams


def _line_bounds(data: bytes) -> tuple[Integers, Integers]:
    """Where each line starts, and where its line break or the end of the data is."""
    end = np.append(np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n")), len(data))
    return np.concatenate([[0], end[:-1] + 1]), end


def _words_after_time(data: bytes, start: Integers) -> NDArray[np.uint64]:
    """The bytes of each line behind its time, as words (n, 3): kinds compare faster so than as text."""
    padded = np.frombuffer(data + bytes(_TIME_DIGITS + _WORD_BYTES), np.uint8)
    windows = np.lib.stride_tricks.sliding_window_view(padded, _WORD_BYTES)
    return np.ascontiguousarray(windows[start + _TIME_DIGITS]).view(np.uint64)


def _begins_with(words: NDArray[np.uint64], mark: bytes) -> NDArray[np.bool_]:
    wanted = np.frombuffer(mark.ljust(_WORD_BYTES, b"\0"), np.uint64)
    mask = np.frombuffer((b"\xff" * len(mark)).ljust(_WORD_BYTES, b"\0"), np.uint64)
    fits: NDArray[np.bool_] = np.ones(len(words), dtype=bool)
    for column in range(words.shape[1]):
        fits &= (words[:, column] & mask[column]) == wanted[column]
    return fits


def _split_odd_records(path: Path, data: bytes) -> Streams:
    streams = {kind: Lines(path) for kind in _KINDS}
    starts = [match.start() for match in _RECORD.finditer(data)]
    if not starts:
        raise LogError(path, "records '<13 digits> <tab> TYPE_…'", shown(data), "separate the fields by tabs", 1)
    _check_no_foreign_lines(path, data[: starts[0]].split(b"\n"), 1)
    number = 1 + data.count(b"\n", 0, starts[0])
    for start, end in zip(starts, [*starts[1:], len(data)], strict=True):
        record = _odd_record(path, data[start:end], number)
        kind = record[_KIND_AT:].split(b"\t", 1)[0].rstrip()
        if kind in streams:
            streams[kind].add(record, number)
        number += data.count(b"\n", start, end)
    return streams


def _odd_record(path: Path, chunk: bytes, number: int) -> bytes:
    """The record that begins the chunk, without what follows before the next record."""
    first, *others = chunk.split(b"\n")
    is_wifi = first.startswith(b"WIFI\t", _KIND_AT)
    if is_wifi and first.count(b"\t") < len(_WIFI.columns) - 1:
        return chunk.strip()  # the network's name holds a line break
    _check_no_foreign_lines(path, others, number + 1)
    return _HEADER.split(first)[0]


def _check_no_foreign_lines(path: Path, lines: list[bytes], first_number: int) -> None:
    for number, line in enumerate(lines, start=first_number):
        if line.strip() and not line.startswith(b"#"):
            expected = "a record '<13 digits> <tab> TYPE_…'"
            raise LogError(path, expected, shown(line), "the log is cut or damaged there", number)


def _wifi(lines: Lines, notes: list[str]) -> RadioScans:
    table = parse(lines, _WIFI)
    time_ms, rss, frequency, seen_ms = table.numbers.T
    identity = [bssid.lower() for bssid in table.text]
    return make_scans(lines, time_ms / 1e3, identity, rss, frequency, seen_ms / 1e3, PHONE_SENTINELS_DBM, notes)


def _beacons(lines: Lines, notes: list[str]) -> RadioScans | None:
    table = parse(lines, _BEACON)
    if not len(lines):
        return None
    identity = [address.lower() for address in table.text]
    shifted = next((index for index, address in enumerate(identity) if address.isdecimal()), None)
    if shifted is not None:
        raise lines.error(shifted, _BEACON.title, f"the number {identity[shifted]} as MAC", "mend the line")
    time_ms, rss = table.numbers.T
    return make_scans(lines, time_ms / 1e3, identity, rss, sentinels=PHONE_SENTINELS_DBM, notes=notes)


def _inertial(streams: Streams, notes: list[str]) -> Inertial | None:
    accelerometer = _signal(streams[b"ACCELEROMETER"], "accelerometer", notes)
    if accelerometer is None:
        return None
    return Inertial(
        accelerometer,
        gyroscope=_signal(streams[b"GYROSCOPE"], "gyroscope", notes),
        magnetometer=_signal(streams[b"MAGNETIC_FIELD"], "magnetometer", notes),
        rotation_vector=_signal(streams[b"ROTATION_VECTOR"], "rotation vector", notes),
    )


def _signal(lines: Lines, what: str, notes: list[str]) -> Signal | None:
    if not len(lines):
        return None
    table = parse(lines, _VECTOR).numbers
    values = table[:, 1:]
    if what == "rotation vector":
        values = unit_quaternions(lines, values)
    return make_signal(lines, table[:, 0] / 1e3, values, what, notes)


def _header(data: bytes) -> dict[str, str]:
    """Keys and values of the header lines, ``#\tkey:value\tkey:value``."""
    text = data[:4096].decode("utf-8", "replace")
    lines = [line for line in text.splitlines() if line.startswith("#")]
    pairs = [pair.partition(":") for line in lines for pair in line.split("\t")]
    return {key: value.strip() for key, _, value in reversed(pairs)}


def _floor(path: Path) -> str:
    folder = path.resolve().parent
    return folder.parent.name if folder.name == "path_data_files" else ""
