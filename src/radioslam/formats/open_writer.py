"""Write a walk in RadioSLAM's own format; the same walk gives the same bytes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import tomli_w
from numpy.typing import NDArray

from radioslam.formats.open_format import FOLDER_NAMES, INERTIAL_GROUPS
from radioslam.formats.tum import write_tum
from radioslam.walk import Inertial, RadioScans, Reference, Walk

Array = NDArray[np.float64]


def write_walk(walk: Walk, folder: Path | str) -> Path:
    """Write the walk below ``folder``, in a folder named as the walk, and return that.

    Times and metres have six decimals. Partners that stand there from an earlier walk are replaced, or removed
    where this walk has none. Notes and the path are not written.

    Raises:
        ValueError: the walk's name cannot be a folder's.
    """
    if walk.name in ("", ".", "..") or {"/", "\\", "\0"} & set(walk.name):
        raise ValueError(f"expected a walk name that can be a folder's, found {walk.name!r}")
    target = Path(folder) / walk.name
    target.mkdir(parents=True, exist_ok=True)
    for name in FOLDER_NAMES.values():
        for stale in (target / name, target / f"{name}.gz"):
            stale.unlink(missing_ok=True)
    _write_lines(target / FOLDER_NAMES["scans"], _reading_rows(walk.wifi, "bssid"))
    if walk.odometry is not None:
        write_tum(target / FOLDER_NAMES["trajectory"], walk.odometry.time_s, walk.odometry.values)
    if walk.ble is not None:
        _write_lines(target / FOLDER_NAMES["ble"], _reading_rows(walk.ble, "identity"))
    if walk.inertial is not None:
        _write_lines(target / FOLDER_NAMES["inertial"], _inertial_rows(walk.inertial))
    if walk.reference is not None:
        _write_lines(target / FOLDER_NAMES["reference"], _reference_rows(walk.reference))
    about = _about(walk)
    if about:
        (target / FOLDER_NAMES["about"]).write_bytes(tomli_w.dumps(about).encode())
    return target


def _write_lines(path: Path, lines: Iterable[str]) -> None:
    path.write_text("".join(line + "\n" for line in lines), encoding="utf-8", newline="\n")


def _reading_rows(scans: RadioScans, identity: str) -> Iterator[str]:
    extra = [
        (name, values)
        for name, values in (("frequency_mhz", scans.frequency_mhz), ("last_seen_s", scans.last_seen_s))
        if np.isfinite(values).any()
    ]
    yield ",".join(["time_s", identity, "rssi_dbm", *(name for name, _ in extra)])
    time_s = scans.scan_time_s[scans.reading_scan]
    for i, (time, transmitter) in enumerate(zip(time_s, scans.reading_transmitter, strict=True)):
        cells = [_decimal(time), scans.transmitters[transmitter], f"{scans.rss_dbm[i]:g}"]
        cells += [_reading_cell(name, values[i]) for name, values in extra]
        yield ",".join(cells)


def _reading_cell(name: str, value: float) -> str:
    if np.isnan(value):
        return ""
    return _decimal(value) if name == "last_seen_s" else f"{value:g}"


def _reference_rows(reference: Reference) -> Iterator[str]:
    yield "time_s,x_m,y_m"
    for time, (x, y) in zip(reference.time_s, reference.positions_xy, strict=True):
        yield f"{_decimal(time)},{_decimal(x)},{_decimal(y)}"


def _inertial_rows(inertial: Inertial) -> Iterator[str]:
    """A row per time; a sensor that has no sample at that time leaves its cells blank."""
    streams = {what: getattr(inertial, what) for what in INERTIAL_GROUPS}
    streams = {what: signal for what, signal in streams.items() if signal is not None}
    yield ",".join(["time_s", *(column for what in streams for column in INERTIAL_GROUPS[what])])
    samples: dict[tuple[str, int], dict[str, str]] = {}
    for what, signal in streams.items():
        seen: dict[str, int] = {}
        for time, values in zip(signal.time_s, signal.values, strict=True):
            shown_time = _decimal(time)
            seen[shown_time] = seen.get(shown_time, -1) + 1  # samples of one time keep their order
            cells = ",".join(_decimal(value, 9) for value in values)
            samples.setdefault((shown_time, seen[shown_time]), {})[what] = cells
    blank = {what: "," * (len(INERTIAL_GROUPS[what]) - 1) for what in streams}
    for key in sorted(samples, key=lambda row: (float(row[0]), row[1])):
        yield ",".join([key[0], *(samples[key].get(what, blank[what]) for what in streams)])


def _about(walk: Walk) -> dict[str, str | float]:
    about: dict[str, str | float] = {}
    if walk.device:
        about["device"] = walk.device
    if walk.floor:
        about["floor"] = walk.floor
    if walk.reference is not None and walk.reference.origin_wgs84 is not None:
        latitude, longitude = walk.reference.origin_wgs84
        about |= {"origin_latitude_deg": float(latitude), "origin_longitude_deg": float(longitude)}
    return about


def _decimal(value: float, digits: int = 6) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"
