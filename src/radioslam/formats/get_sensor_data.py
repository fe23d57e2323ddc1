"""Logs of the Android app GetSensorData, as used by the IPIN competitions.

Fields are separated by ``;``, the first is the kind of the record, comments begin with ``%``. Records bear
the app's time (common to all, but jittery) and mostly the sensor's (even, but with another zero). Motion keeps
the sensor's spacing, moved to the app's clock; WiFi, beacons and reference fixes are on the app's clock.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.fixes import geodetic_reference
from radioslam.formats.lines import Layout, Lines, Table, parse, split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.streams import (
    PHONE_SENTINELS_DBM,
    check_times,
    group_scan_times,
    make_scans,
    make_signal,
    unit_quaternions,
)
from radioslam.walk import Inertial, RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]
Streams = dict[bytes, Lines]

CLOCK_JITTER_S = 5.0
"""The app's clock may lag behind the sensor's by as much; beyond, the sensor's clock is not to be trusted."""

_SNIFF = re.compile(rb"'GetSensorData' App|^(ACCE|GYRO|MAGN|AHRS|WIFI|POSI|BLE4)\s?[;,\t|]\s?-?\d", re.MULTILINE)
_KIND = re.compile(rb"[A-Z][A-Z0-9]{3}$")
_KINDS = (b"ACCE", b"GYRO", b"MAGN", b"AHRS", b"WIFI", b"BLE4", b"POSI")
_TIMES = ("app s", "sensor s")
_VECTOR = Layout(("kind", *_TIMES, "x", "y", "z", "accuracy"), (*_TIMES, "x", "y", "z"), separator=";")
_AHRS = Layout(
    ("AHRS", *_TIMES, "pitch", "roll", "yaw", "q2", "q3", "q4", "accuracy"), (*_TIMES, "q2", "q3", "q4"), separator=";"
)
_POSI = Layout(
    ("POSI", "s", "counter", "latitude", "longitude", "floor", "building"),
    ("s", "latitude", "longitude", "floor"),
    separator=";",
)
_WIFI_TITLE = "WIFI;app s;sensor s;SSID;MAC;[MHz;]RSS"
_WIFI = re.compile(  # the network's name may hold anything, so the line is taken from both ends
    rb"WIFI;([^;]*);([^;]*);.*;((?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2});(?:([^;]*);)?([^;]+);?\s*", re.DOTALL
)
_BLE_TITLE = "BLE4;app s;type;MAC;RSS;…"
_BLE = re.compile(rb"BLE4;([^;]*);[^;]*;((?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2});([^;]+)(?:;.*)?\s*", re.DOTALL)


def sniff(head: bytes) -> bool:
    """Whether the first bytes of a file look like such a log."""
    return _SNIFF.search(head) is not None


def read(path: Path) -> Walk:
    """Read a log.

    Raises:
        LogError: it is damaged; the message names the line.
    """
    lines = split_lines(load(path))
    streams = _split_records(path, lines)
    notes: list[str] = []
    reference, floor = _reference(streams[b"POSI"], notes)
    return Walk(
        name=walk_name(path),
        wifi=_wifi(streams[b"WIFI"], notes),
        ble=_beacons(streams[b"BLE4"], notes),
        inertial=_inertial(streams, notes),
        reference=reference,
        device=_device(lines),
        floor=floor,
        path=path,
        notes=tuple(notes),
    )


def _split_records(path: Path, lines: list[bytes]) -> Streams:
    streams = {kind: Lines(path) for kind in _KINDS}
    records = 0
    for number, line in enumerate(lines, start=1):
        if line[4:5] == b";" and _KIND.match(line[:4]):
            records += 1
            if line[:4] in streams:
                streams[line[:4]].add(line.rstrip(b"; "), number)
        elif line.strip() and not line.startswith(b"%"):
            advice = "separate the fields by ';', or remove the line"
            raise LogError(path, "a record 'KIND;field;field;…'", shown(line), advice, number)
    if not records:
        raise LogError(path, "records 'KIND;field;field;…'", "comments only", "record again")
    return streams


def _inertial(streams: Streams, notes: list[str]) -> Inertial | None:
    accelerometer = _signal(streams[b"ACCE"], "accelerometer", notes)
    if accelerometer is None:
        return None
    return Inertial(
        accelerometer,
        gyroscope=_signal(streams[b"GYRO"], "gyroscope", notes),
        magnetometer=_signal(streams[b"MAGN"], "magnetometer", notes),
        rotation_vector=_signal(streams[b"AHRS"], "rotation vector", notes),
    )


def _signal(lines: Lines, what: str, notes: list[str]) -> Signal | None:
    if not len(lines):
        return None
    is_ahrs = what == "rotation vector"
    table = parse(lines, _AHRS if is_ahrs else _VECTOR).numbers
    app_s, sensor_s, values = table[:, 0], table[:, 1], table[:, 2:]
    check_times(lines, app_s)
    check_times(lines, sensor_s)
    values = unit_quaternions(lines, values) if is_ahrs else values
    return make_signal(lines, _app_clock(app_s, sensor_s, what, notes), values, what, notes)


def _app_clock(app_s: Array, sensor_s: Array, what: str, notes: list[str]) -> Array:
    """The sensor's times (n,) moved to the app's clock by the median offset of the stream."""
    offset_s = app_s - sensor_s
    moved_s: Array = sensor_s + np.median(offset_s)
    if np.abs(moved_s - app_s).max() <= CLOCK_JITTER_S:
        return moved_s
    notes.append(f"{what}: sensor clock differs from the app's by more than {CLOCK_JITTER_S:g} s, app's taken")
    return app_s


def _wifi(lines: Lines, notes: list[str]) -> RadioScans:
    table = _readings(lines, _WIFI, _WIFI_TITLE, numbers=(1, 5, 4), identity=3)
    app_s, rss, frequency = table.numbers.T
    check_times(lines, app_s)
    scan_s = group_scan_times(app_s)
    return make_scans(lines, scan_s, table.text, rss, frequency, sentinels=PHONE_SENTINELS_DBM, notes=notes)


def _beacons(lines: Lines, notes: list[str]) -> RadioScans | None:
    if not len(lines):
        return None
    table = _readings(lines, _BLE, _BLE_TITLE, numbers=(1, 3), identity=2)
    app_s, rss = table.numbers.T
    return make_scans(lines, app_s, table.text, rss, sentinels=PHONE_SENTINELS_DBM, notes=notes)


def _readings(lines: Lines, pattern: re.Pattern[bytes], title: str, numbers: tuple[int, ...], identity: int) -> Table:
    """The groups of ``pattern`` that are numbers, NaN where the line lacks one, and the addresses."""
    values, addresses = np.full((len(lines), len(numbers)), np.nan), []
    for index, text in enumerate(lines.text):
        match = pattern.fullmatch(text)
        if match is None:
            raise lines.error(index, title, shown(text), "the line is cut short or damaged; remove it")
        for column, group in enumerate(numbers):
            if match[group] is not None:
                values[index, column] = _finite(lines, index, match[group], title)
        addresses.append(match[identity].decode().lower())
    return Table(values, addresses)


def _finite(lines: Lines, index: int, text: bytes, title: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or b"_" in text:
        raise lines.error(index, f"finite numbers in {title}", shown(text), "mend or remove the line")
    return value


def _reference(lines: Lines, notes: list[str]) -> tuple[Reference | None, str]:
    """Fixes in metres east and north of the log's first fix, and the floor."""
    if not len(lines):
        return None, ""
    time_s, latitude, longitude, floors = parse(lines, _POSI).numbers.T
    if len(set(floors)) > 1:
        notes.append(f"reference on {len(set(floors))} floors, all taken as one plane")
    return geodetic_reference(lines, time_s, latitude, longitude, notes), f"{floors[time_s.argmin()]:g}"


def _device(lines: list[bytes]) -> str:
    """Manufacturer and model from the comments."""
    parts: dict[str, str] = {}
    for line in lines[:100]:
        key, _, value = line.decode("utf-8", "replace").lstrip("% ").partition(":")
        parts.setdefault(key.strip(), value.strip())
    return " ".join(filter(None, (parts.get("Manufacturer"), parts.get("Model"))))
