"""Sessions of ARCore or ARKit loggers: a CSV of WiFi scans by the names of its columns, and a pose file beside it.

The scans are a row per reading with a time, a BSSID and an RSS; frequency and network name may be there. Their times
are on the poses' clock; ``pose_files`` tells what poses may look like and which belong to which scans.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from radioslam.errors import LogError
from radioslam.formats import pose_files
from radioslam.formats.clocks import STEP_OF_SCANS_S, is_time_name, unix_or_boot_s
from radioslam.formats.loading import HEAD_BYTES, load, load_head, shown, walk_name
from radioslam.formats.readings import wifi_scans
from radioslam.formats.records import from_csv
from radioslam.walk import RadioScans, Walk

_BSSID = ("bssid", "mac", "mac_address", "macaddress", "address")
_RSS = ("rssi", "rss", "level", "signal", "signal_strength", "signalstrength", "dbm", "rssi_dbm", "level_dbm")
_FREQUENCY = ("frequency", "freq", "frequency_mhz", "freq_mhz")
_SSID = ("ssid", "name", "network")


def sniff(head: bytes) -> bool:
    """Whether the first bytes are a pose file's or the header of a WiFi CSV; the open format's names are not."""
    return _is_wifi(head) or pose_files.sniff(head)


def read(path: Path) -> Walk:
    """Read the scans with the poses beside them, or poses alone.

    Raises:
        LogError: one of them is damaged; the message names the line.
    """
    notes: list[str] = []
    data = load(path)
    is_bare = not _is_wifi(data) and pose_files.sniff(data[:HEAD_BYTES])
    scans = RadioScans.from_readings([], [], []) if is_bare else _read_wifi(path, data, notes)
    odometry = (pose_files.read_poses if is_bare else pose_files.trajectory_beside)(path, notes)
    return Walk(walk_name_of(path), scans, odometry=odometry, path=path, notes=tuple(notes))


def log_of(path: Path) -> Path:
    """The scans that poses belong to, if there are any; scans as they are."""
    if not pose_files.is_pose_name(path):
        return path
    candidates = [other for other in pose_files.scans_of(path) if _holds_wifi(other)]
    return candidates[0] if len(candidates) == 1 else path


def walk_name_of(path: Path) -> str:
    """The file's name; of a file that is called just wifi or scans, the folder's."""
    return walk_name(path) if pose_files.has_own_name(path) else path.resolve().parent.name or walk_name(path)


def _holds_wifi(path: Path) -> bool:
    try:
        return _is_wifi(load_head(path))
    except LogError:
        return False


def _names(data: bytes) -> list[str]:
    first = next((line for line in data[:HEAD_BYTES].split(b"\n") if line.strip()), b"")
    return [name.strip().strip('"').lower() for name in first.decode("utf-8", "replace").split(",")]


def _is_wifi(head: bytes) -> bool:
    names = _names(head)
    is_other = "seconds_elapsed" in names or "firstseen" in names
    is_open = "rssi_dbm" in names and ("bssid" in names or "time_s" in names)
    parts = (_BSSID, _RSS)
    return not is_other and not is_open and all(_first(names, part) for part in parts) and any(map(is_time_name, names))


def _first(names: list[str], known: tuple[str, ...]) -> str:
    return next((name for name in known if name in names), "")


def _read_wifi(path: Path, data: bytes, notes: list[str]) -> RadioScans:
    records = from_csv(path, data)
    names = list(records.cells)
    time, bssid, rss = next(filter(is_time_name, names), ""), _first(names, _BSSID), _first(names, _RSS)
    if not (time and bssid and rss):
        expected, found = "columns with a time, a BSSID and an RSS", shown(",".join(names))
        raise LogError(path, expected, found, "name the columns timestamp,bssid,rssi", 1)
    if not len(records):
        raise LogError(path, "a row per reading", "the header alone", "leave the file out")
    ssid, frequency = _first(names, _SSID), _first(names, _FREQUENCY)
    times = records.numbers(time)
    return wifi_scans(
        records.lines,
        unix_or_boot_s(records.lines, times, time, STEP_OF_SCANS_S),
        records.text(bssid),
        records.numbers(rss),
        notes,
        ssid=records.text(ssid) if ssid else None,
        frequency_mhz=records.numbers(frequency, blank=True) if frequency else np.full(len(records), np.nan),
    )
