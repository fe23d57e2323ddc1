"""Streams of the app Sensor Logger -> a walk: what its columns mean on Android and on iOS.

As its pages UNITS.md, COORDINATES.md and CROSSPLATFORM.md have it: ``time`` is Unix nanoseconds;
``TotalAcceleration`` holds gravity, ``Accelerometer`` does not, ``Gravity`` is the rest; iOS has the opposite sign of
Android in all three unless the metadata say ``standardisation``. WiFi has ``bssid``, ``ssid``, ``level`` in dBm and
``frequency``, Bluetooth ``id`` and ``rssi``, Location ``latitude``, ``longitude`` and ``horizontalAccuracy``.
Orientation is a quaternion ``qx``…``qw`` whose sense the pages leave open: that one of it and its inverse is taken
which turns the accelerometer's gravity upright, or neither.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from radioslam.formats.fixes import geodetic_reference
from radioslam.formats.readings import mac_address, wifi_scans
from radioslam.formats.records import Records
from radioslam.formats.streams import PHONE_SENTINELS_DBM, check_unit, group_scan_times, make_scans, make_signal
from radioslam.walk import Inertial, RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]
Streams = Mapping[str, Records]

MOTION = ("accelerometer", "totalacceleration", "gravity", "gyroscope", "magnetometer", "orientation")
STREAMS = frozenset((*MOTION, "wifi", "bluetooth", "location", "metadata"))
UPRIGHT_SHARE = 0.9
"""Share of the mean specific force that an attitude must turn upright to be believed."""

_NS = 1e-9
_AXES = ("x", "y", "z")
_QUATERNION = ("qx", "qy", "qz", "qw")
_EAST_FROM_NORTH = Rotation.from_euler("z", 90, degrees=True)
"""iOS counts from north, with west to the left; ours is east, north, up."""


def stream_name(name: str) -> str:
    """One name for ``WiFi``, ``wifi`` and ``Wi-Fi``, and for the streams ``bluetooth-…`` of single devices."""
    plain = re.sub(r"[^a-z]", "", name.lower())
    if plain.startswith("bluetooth"):
        return "bluetoothmetadata" if plain.startswith("bluetoothmetadata") else "bluetooth"
    return plain


def walk_of_streams(streams: Streams, name: str, path: Path) -> Walk:
    """The walk of a recording.

    Raises:
        LogError: a stream is damaged; the message names the line.
    """
    notes: list[str] = []
    about = _about(streams.get("metadata"))
    accelerometer = _specific_force(streams, about, notes)
    is_apple = accelerometer is not None and accelerometer[1]
    return Walk(
        name=name,
        wifi=_wifi(streams.get("wifi"), notes),
        ble=_beacons(streams.get("bluetooth"), notes),
        inertial=_inertial(streams, accelerometer[0], is_apple, notes) if accelerometer else None,
        reference=_reference(streams.get("location"), notes),
        device=about.get("device name", ""),
        path=path,
        notes=tuple(notes),
    )


def _about(metadata: Records | None) -> dict[str, str]:
    return (
        {}
        if metadata is None or not len(metadata)
        else {key: cells[0].strip() for key, cells in metadata.cells.items()}
    )


def _time_s(records: Records) -> Array:
    return records.numbers("time") * _NS


def _vectors(streams: Streams, name: str, columns: tuple[str, ...], notes: list[str]) -> Signal | None:
    """A stream in the order of its time, or None where it is not there."""
    records = streams.get(name)
    if records is None or not records.has(*columns):
        return None
    values = np.column_stack([records.numbers(column) for column in columns])
    if len(columns) == len(_QUATERNION):
        check_unit(records.lines, values)
        values = values / np.linalg.norm(values, axis=1, keepdims=True)
    return make_signal(records.lines, _time_s(records), values, name, notes)


def _specific_force(streams: Streams, about: Mapping[str, str], notes: list[str]) -> tuple[Signal, bool] | None:
    """Acceleration with gravity, positive upwards as Android has it, and whether the phone is Apple's."""
    total = _vectors(streams, "totalacceleration", _AXES, notes)
    if total is None:
        moved, gravity = (_vectors(streams, name, _AXES, notes) for name in ("accelerometer", "gravity"))
        if moved is None or gravity is None:
            if moved is not None:
                notes.append("acceleration without gravity left out; record gravity or total acceleration as well")
            return None
        resting = np.column_stack([np.interp(moved.time_s, gravity.time_s, axis) for axis in gravity.values.T])
        total = Signal(moved.time_s, moved.values + resting)
    platform = about.get("platform", "").lower()
    is_apple = platform == "ios"
    is_reversed = is_apple and about.get("standardisation", "").lower() != "true"
    if not platform:
        is_apple = is_reversed = bool(np.median(total.values[:, 1] + total.values[:, 2]) < 0)
        if is_apple:
            notes.append("no platform told; signs of iOS taken, else the phone would be upside down")
    return Signal(total.time_s, -total.values if is_reversed else total.values), is_apple


def _inertial(streams: Streams, accelerometer: Signal, is_apple: bool, notes: list[str]) -> Inertial:
    return Inertial(
        accelerometer,
        gyroscope=_vectors(streams, "gyroscope", _AXES, notes),
        magnetometer=_vectors(streams, "magnetometer", _AXES, notes),
        rotation_vector=_attitude(streams, accelerometer, is_apple, notes),
    )


def _attitude(streams: Streams, accelerometer: Signal, is_apple: bool, notes: list[str]) -> Signal | None:
    """Orientation as phone to world (east, north, up), if the accelerometer agrees."""
    told = _vectors(streams, "orientation", _QUATERNION, notes)
    if told is None:
        return None
    force = np.column_stack([np.interp(told.time_s, accelerometer.time_s, axis) for axis in accelerometer.values.T])
    length = max(float(np.linalg.norm(force, axis=1).mean()), 1e-9)
    senses = (Rotation.from_quat(told.values), Rotation.from_quat(told.values).inv())
    upright = [float(sense.apply(force)[:, 2].mean()) / length for sense in senses]
    best = int(np.argmax(upright))
    if upright[best] < UPRIGHT_SHARE:
        notes.append(f"orientation left out: it turns only {100 * max(upright[best], 0):.0f} % of gravity upright")
        return None
    magnetometer = _vectors(streams, "magnetometer", _AXES, [])
    north = (
        _north(told.time_s, senses[best], magnetometer)
        if magnetometer
        else (_EAST_FROM_NORTH if is_apple else Rotation.identity())
    )
    return Signal(told.time_s, (north * senses[best]).as_quat(canonical=True))


def _north(time_s: Array, attitude: Rotation, magnetometer: Signal) -> Rotation:
    """The quarter turn about the vertical that brings the mean magnetic field nearest to north, the y axis."""
    field = np.column_stack([np.interp(time_s, magnetometer.time_s, axis) for axis in magnetometer.values.T])
    east, north, _ = attitude.apply(field).mean(axis=0)
    return Rotation.from_euler("z", 90.0 * np.round(np.degrees(np.arctan2(east, north)) / 90.0), degrees=True)


def _wifi(records: Records | None, notes: list[str]) -> RadioScans:
    if records is None or not len(records):
        return RadioScans.from_readings([], [], [])
    return wifi_scans(
        records.lines,
        group_scan_times(_time_s(records)),
        records.text("bssid"),
        records.numbers("level"),
        notes,
        ssid=records.text("ssid") if "ssid" in records.cells else None,
        frequency_mhz=records.numbers("frequency", blank=True),
    )


def _beacons(records: Records | None, notes: list[str]) -> RadioScans | None:
    """Advertisements with an RSS; what iOS calls a device is its own invention and says nothing to other phones."""
    if records is None or not records.has("id", "rssi"):
        return None
    rss_dbm, addresses = records.numbers("rssi", blank=True), [mac_address(one) for one in records.text("id")]
    keep = np.isfinite(rss_dbm) & np.array([address is not None for address in addresses], dtype=bool)
    if not keep.all():
        notes.append(f"{np.sum(~keep)} advertisements without RSS or address left out")
    kept = records.take(keep)
    known = [address for address, good in zip(addresses, keep, strict=True) if good and address]
    if not known:
        return None
    return make_scans(kept.lines, _time_s(kept), known, rss_dbm[keep], sentinels=PHONE_SENTINELS_DBM, notes=notes)


def _reference(records: Records | None, notes: list[str]) -> Reference | None:
    if records is None or not records.has("latitude", "longitude"):
        return None
    accuracy_m = records.numbers("horizontalaccuracy", blank=True)
    latitude, longitude = records.numbers("latitude"), records.numbers("longitude")
    return geodetic_reference(records.lines, _time_s(records), latitude, longitude, notes, accuracy_m)
