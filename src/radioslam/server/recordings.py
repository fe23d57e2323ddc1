"""Batches <-> walks: what is stored of a recording and how a walk is put together again.

A body is the batch as JSON, deflated, addresses hidden and SSIDs gone. A walk read from a file is one batch, so that
all walks are stored alike; numbers keep all their digits.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import from_json, to_json

from radioslam.errors import ServiceError
from radioslam.privacy import may_be_mapped
from radioslam.server.messages import Batch, Scan
from radioslam.server.privacy import Hide
from radioslam.walk import Inertial, RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]
Body = dict[str, Any]
POSE, FIX = ("time_s", "x_m", "y_m", "heading_rad"), ("time_s", "x_m", "y_m")
SENSORS = {"accelerometer": 3, "gyroscope": 3, "magnetometer": 3, "rotation_vector": 4}
_DEFLATE_LEVEL = 1


def packed(batch: Batch, hide: Hide) -> tuple[bytes, str, int]:
    """Body, its digest, and how many readings were left out.

    Raises:
        ServiceError: sensor samples of the wrong shape.
    """
    scans, dropped = _kept(batch.scans, hide)
    beacons, dropped_beacons = _kept(batch.beacons, hide)
    body = {
        "poses": [(p.time_s, p.x_m, p.y_m, p.heading_rad) for p in batch.poses],
        "scans": scans,
        "beacons": beacons,
        "fixes": [(f.time_s, f.x_m, f.y_m) for f in batch.fixes],
        "origin": batch.fix_origin and (batch.fix_origin.latitude_deg, batch.fix_origin.longitude_deg),
        "sigma_m": batch.fix_sigma_m,
        "inertial": _checked_inertial(batch),
    }
    return *sealed({key: value for key, value in body.items() if value}), dropped + dropped_beacons


def sealed(body: Body) -> tuple[bytes, str]:
    """A body's bytes and its digest."""
    text = to_json(body)
    return zlib.compress(text, _DEFLATE_LEVEL), hashlib.sha256(text).hexdigest()


def unpacked(body: bytes) -> Body:
    """What ``sealed`` packed."""
    content: Body = from_json(zlib.decompress(body))
    return content


def _kept(scans: Sequence[Scan], hide: Hide) -> tuple[list[Any], int]:
    """Per scan its time and rows of address, strength, frequency, last seen; and the number of readings dropped."""
    rows, dropped = [], 0
    for scan in scans:
        kept = [reading for reading in scan.readings if may_be_mapped(reading.ssid)]
        dropped += len(scan.readings) - len(kept)
        rows.append((scan.time_s, [(hide(r.bssid), r.rssi_dbm, r.frequency_mhz, r.last_seen_s) for r in kept]))
    return rows, dropped


def _checked_inertial(batch: Batch) -> Body:
    found: Body = {}
    for sensor, width in SENSORS.items():
        samples = getattr(batch.inertial, sensor, None)
        if samples is None:
            continue
        if len(samples.time_s) != len(samples.values) or any(len(row) != width for row in samples.values):
            raise ServiceError(f"inertial.{sensor}: expected a row of {width} values for each of the times")
        if sensor == "rotation_vector" and any(abs(sum(v * v for v in row) - 1) > 0.2 for row in samples.values):
            raise ServiceError("inertial.rotation_vector: expected unit quaternions x, y, z, w")
        found[sensor] = {"time_s": samples.time_s, "values": samples.values}
    return found


def body_of(walk: Walk, hide: Hide) -> Body:
    """A whole walk as one body."""
    reference, inertial = walk.reference, walk.inertial
    body: Body = {
        "poses": [] if walk.odometry is None else _rows(walk.odometry),
        "scans": _scan_rows(walk.wifi, hide),
        "beacons": [] if walk.ble is None else _scan_rows(walk.ble, hide),
        "fixes": [] if reference is None else np.column_stack([reference.time_s, reference.positions_xy]).tolist(),
        "origin": reference and reference.origin_wgs84,
        "sigma_m": reference and reference.sigma_m,
        "inertial": {} if inertial is None else _sensors(inertial),
    }
    return {key: value for key, value in body.items() if value}


def _rows(signal: Signal) -> list[list[float]]:
    return np.column_stack([signal.time_s, signal.values]).tolist()


def _sensors(inertial: Inertial) -> Body:
    signals = {sensor: getattr(inertial, sensor) for sensor in SENSORS}
    return {
        sensor: {"time_s": signal.time_s.tolist(), "values": signal.values.tolist()}
        for sensor, signal in signals.items()
        if signal is not None
    }


def _scan_rows(scans: RadioScans, hide: Hide) -> list[Any]:
    bounds = np.searchsorted(scans.reading_scan, np.arange(len(scans) + 1))
    names = [hide(name.lower()) for name in scans.transmitters]
    frequency, seen = (
        [None if np.isnan(value) else value for value in column.tolist()]
        for column in (scans.frequency_mhz, scans.last_seen_s)
    )
    address = [names[k] for k in scans.reading_transmitter]
    readings = list(zip(address, scans.rss_dbm.tolist(), frequency, seen, strict=True))
    return [
        (time_s, readings[start:end])
        for time_s, start, end in zip(scans.scan_time_s.tolist(), bounds[:-1], bounds[1:], strict=True)
    ]


def assembled(name: str, bodies: Sequence[Body], device: str = "", floor: str = "") -> Walk:
    """The walk of its bodies in the order of their sequence numbers; it may be one that cannot be mapped.

    Raises:
        LogError: messages of Sensor Logger that make no walk.
    """
    if any("message" in body for body in bodies):
        from radioslam.formats.sensor_logger import walk_of_messages

        walk = walk_of_messages([body["message"] for body in bodies if "message" in body], name)
        return replace(walk, device=device, floor=floor)
    poses = _first_by_time(_columns(body.get("poses"), len(POSE)) for body in bodies)
    fixes = _first_by_time(_columns(body.get("fixes"), len(FIX)) for body in bodies)
    beacons = [scan for body in bodies for scan in body.get("beacons", ())]
    first = next((body for body in bodies if body.get("fixes")), {})
    origin = first.get("origin")
    reference = None
    if len(fixes):
        fixes = fixes[np.unique(fixes[:, 0], return_index=True)[1]]
        reference = Reference(
            fixes[:, 0], fixes[:, 1:], (origin[0], origin[1]) if origin else None, first.get("sigma_m")
        )
    return Walk(
        name=name,
        wifi=_scans([scan for body in bodies for scan in body.get("scans", ())]),
        ble=_scans(beacons) if beacons else None,
        odometry=Signal(poses[:, 0], poses[:, 1:]) if len(poses) else None,
        inertial=_inertial([body.get("inertial", {}) for body in bodies]),
        reference=reference,
        device=device,
        floor=floor,
    )


def _columns(rows: Any, width: int) -> Array:
    return np.array(rows or [], dtype=float).reshape(-1, width)


def _first_by_time(tables: Iterable[Array]) -> Array:
    """Rows of all tables sorted by time, their first column; a time that an earlier table has counts there."""
    kept: list[Array] = []
    known = np.empty(0)
    for table in tables:
        kept.append(table[~np.isin(table[:, 0], known)])
        known = np.union1d(known, table[:, 0])
    if not kept:  # a walk that has only begun
        return np.empty((0, 1))
    rows = np.concatenate(kept)
    sorted_rows: Array = rows[np.argsort(rows[:, 0], kind="stable")]
    return sorted_rows


def _scans(scans: Sequence[Any]) -> RadioScans:
    readings = [(time_s, *reading) for time_s, of_scan in scans for reading in of_scan]
    if not readings:
        return RadioScans.from_readings([], [], [])
    time_s, address, rss, frequency, seen = zip(*readings, strict=True)
    unknown = [[np.nan if value is None else value for value in column] for column in (frequency, seen)]
    return RadioScans.from_readings(time_s, address, rss, *unknown)


def _inertial(parts: Sequence[Body]) -> Inertial | None:
    signals = {}
    for sensor, width in SENSORS.items():
        rows = _first_by_time(_sensor_rows(part.get(sensor), width) for part in parts)
        signals[sensor] = Signal(rows[:, 0], rows[:, 1:]) if len(rows) else None
    accelerometer = signals.pop("accelerometer")
    return Inertial(accelerometer, **signals) if accelerometer else None


def _sensor_rows(samples: Body | None, width: int) -> Array:
    if not samples:
        return np.empty((0, width + 1))
    return np.column_stack([samples["time_s"], _columns(samples["values"], width)])
