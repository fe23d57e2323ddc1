"""What ``termux-wifi-scaninfo`` prints on Android, scan after scan; no motion of its own.

Each scan is an array of ``{"bssid", "frequency_mhz", "rssi", "ssid", "timestamp", …}``, where ``timestamp`` is when
the network was last heard, in microseconds since the phone started. Scans follow each other in the file
(``termux-wifi-scaninfo >> walk.json``), or stand in one array; each may be wrapped in an object that bears its time,
``{"time": 1715936400.2, "scan": [...]}``. A scan without a time has that of its latest network.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.clocks import STEP_OF_SCANS_S, is_time_name, unix_or_boot_s
from radioslam.formats.lines import Lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.pose_files import trajectory_beside
from radioslam.formats.readings import wifi_scans
from radioslam.formats.records import Records, from_objects, json_documents
from radioslam.walk import RadioScans, Walk

Array = NDArray[np.float64]

_EXPECTED = "scans as termux-wifi-scaninfo prints them"
_ADVICE = "append its output to the file, scan after scan"


@dataclass(frozen=True)
class _Scan:
    """The networks of a scan; its time as the log writes it and the time's name, "" and None where it has none."""

    networks: list[Mapping[str, Any]]
    line: int
    time: Any = None
    time_name: str = ""


def sniff(head: bytes) -> bool:
    """Whether the first bytes are JSON with the fields of such a scan."""
    begins = head.lstrip()[:1] in (b"[", b"{")
    return begins and b'"bssid"' in head and b'"rssi"' in head and b'"sensor"' not in head and b'"payload"' not in head


def read(path: Path) -> Walk:
    """Read a file, and a trajectory beside it.

    Raises:
        LogError: it is damaged, or scans with a time and scans without are mixed.
    """
    notes: list[str] = []
    scans = [scan for value, line in json_documents(path, load(path)) for scan in _scans(path, value, line)]
    scans = [scan for scan in scans if scan.networks]
    if not scans:
        raise LogError(path, _EXPECTED, "none", _ADVICE)
    return Walk(
        name=walk_name(path),
        wifi=_wifi(path, scans, notes),
        odometry=trajectory_beside(path, notes),
        path=path,
        notes=tuple(notes),
    )


def _scans(path: Path, value: Any, line: int, time: Any = None, time_name: str = "") -> Iterator[_Scan]:
    """The scans in a JSON value: networks, or what holds such."""
    if isinstance(value, Mapping):
        if "API_ERROR" in value:
            raise LogError(path, "a scan", shown(str(value["API_ERROR"])), "switch location on and scan again", line)
        inner = [part for part in value.values() if isinstance(part, list)]
        times = [name for name in value if is_time_name(name.lower()) and not isinstance(value[name], (list, Mapping))]
        if len(inner) != 1 or len(times) > 1:
            raise LogError(path, _EXPECTED, shown(str(value)), _ADVICE, line)
        yield from _scans(path, inner[0], line, value[times[0]] if times else None, times[0] if times else "")
    elif not isinstance(value, list):
        raise LogError(path, _EXPECTED, shown(str(value)), _ADVICE, line)
    elif all(isinstance(one, Mapping) and "bssid" in one for one in value):
        yield _Scan(value, line, time, time_name)
    elif time_name:
        raise LogError(path, _EXPECTED, shown(str(value)), _ADVICE, line)
    else:
        for one in value:
            yield from _nested(path, one, line)


def _nested(path: Path, value: Any, line: int) -> Iterator[_Scan]:
    """A scan in an array of scans; arrays go no deeper."""
    networks = value if isinstance(value, list) else []
    if not all(isinstance(one, Mapping) and "bssid" in one for one in networks):
        raise LogError(path, _EXPECTED, shown(str(value)), _ADVICE, line)
    yield from _scans(path, value, line)


def _wifi(path: Path, scans: list[_Scan], notes: list[str]) -> RadioScans:
    networks = [one for scan in scans for one in scan.networks]
    count = [len(scan.networks) for scan in scans]
    records = from_objects(path, networks, np.repeat([scan.line for scan in scans], count).tolist())
    scan_of = np.repeat(np.arange(len(scans)), count)
    heard_s = records.numbers("timestamp", blank=True) / 1e6
    latest_s = np.full(len(scans), -np.inf)
    np.maximum.at(latest_s, scan_of, np.nan_to_num(heard_s, nan=-np.inf))
    scan_s = _scan_times(path, scans, latest_s)
    return wifi_scans(
        records.lines,
        scan_s[scan_of],
        records.text("bssid"),
        records.numbers("rssi"),
        notes,
        ssid=_names(records),
        frequency_mhz=records.numbers("frequency_mhz", blank=True),
        last_seen_s=scan_s[scan_of] - (latest_s[scan_of] - heard_s),
    )


def _names(records: Records) -> list[str] | None:
    return records.text("ssid") if "ssid" in records.cells else None


def _scan_times(path: Path, scans: list[_Scan], latest_s: Array) -> Array:
    """Seconds (n,) of each scan: as the log has them, else of the latest network; one scan needs no clock."""
    names = {scan.time_name for scan in scans}
    lines = Lines(path, [b""] * len(scans), [scan.line for scan in scans])
    if len(names) > 1:
        index = next(k for k, scan in enumerate(scans) if scan.time_name != scans[0].time_name)
        raise lines.error(index, "times of one name in all scans or in none", shown(scans[index].time_name), _ADVICE)
    if names != {""}:
        (name,) = names
        times = from_objects(path, [{name: scan.time} for scan in scans], lines.number).numbers(name.lower())
        return unix_or_boot_s(lines, times, name.lower(), STEP_OF_SCANS_S)
    if len(scans) == 1 and not np.isfinite(latest_s[0]):
        return np.zeros(1)
    if not np.isfinite(latest_s).all():
        index = int(np.argmin(np.isfinite(latest_s)))
        raise lines.error(index, "a time of each scan", "neither a time nor timestamps", _ADVICE)
    return latest_s
