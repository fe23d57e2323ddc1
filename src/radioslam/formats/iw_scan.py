"""What ``iw dev … scan`` prints, scan after scan in one file; no motion of its own.

Each network begins with ``BSS aa:bb:cc:dd:ee:ff(on wlan0)`` and holds ``signal: -52.00 dBm``, ``freq: 2437``, ``SSID:
…`` and ``last seen: 52 ms ago``, in newer versions also ``last seen: 2804.056s [boottime]``. A scan ends where a
network comes again, or at a line that holds nothing but Unix seconds, as ``date +%s.%N`` prints them before each
scan. That is the scan's time; without it the latest boot time is, and a file of one scan needs neither.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.lines import Lines, split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.pose_files import trajectory_beside
from radioslam.formats.readings import wifi_scans
from radioslam.walk import Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_BSS = re.compile(rb"\s*BSS ((?:[0-9a-f]{2}:){5}[0-9a-f]{2})\s*(?:\(on .*)?(?:-- associated)?\s*", re.IGNORECASE)
_TIME = re.compile(rb"[#=@ ]{0,3}(\d{9,11}(?:\.\d+)?)\s*")
_FIELDS = {
    "rss_dbm": re.compile(rb"\s*signal:\s*(\S+)\s*dBm\s*"),
    "frequency_mhz": re.compile(rb"\s*freq:\s*(\S+)\s*"),
    "age_ms": re.compile(rb"\s*last seen:\s*(\S+)\s*ms ago\s*"),
    "boot_s": re.compile(rb"\s*last seen:\s*(\S+?)s\s*\[boottime\]\s*"),
}
_SSID = re.compile(rb"\s*SSID:\s?(.*)", re.DOTALL)


@dataclass
class _Network:
    """One network of a scan, as its lines come: scan, line number, and what ``_FIELDS`` found (NaN: nothing)."""

    scan: int
    number: int
    bssid: str
    ssid: str | None = None
    values: dict[str, float] = field(default_factory=dict)

    def value(self, name: str) -> float:
        return self.values.get(name, np.nan)


def sniff(head: bytes) -> bool:
    """Whether a line is the first of a network."""
    return any(_BSS.fullmatch(line) for line in split_lines(head)[:-1]) and b"(on " in head


def read(path: Path) -> Walk:
    """Read a file, and a trajectory beside it.

    Raises:
        LogError: it is damaged; the message names the line.
    """
    notes: list[str] = []
    networks, stamp_s = _networks(path, split_lines(load(path)))
    lines = Lines(path, [one.bssid.encode() for one in networks], [one.number for one in networks])
    column = {name: np.array([one.value(name) for one in networks]) for name in _FIELDS}
    silent = np.isnan(column["rss_dbm"])
    if silent.any():
        raise lines.error(int(silent.argmax()), "signal: … dBm", "a network without it", "remove the network")
    time_s, seen_s = _times(lines, np.array([one.scan for one in networks]), stamp_s, column)
    return Walk(
        name=walk_name(path),
        wifi=wifi_scans(
            lines,
            time_s,
            [one.bssid for one in networks],
            column["rss_dbm"],
            notes,
            ssid=[one.ssid or "" for one in networks],
            frequency_mhz=column["frequency_mhz"],
            last_seen_s=seen_s,
        ),
        odometry=trajectory_beside(path, notes),
        path=path,
        notes=tuple(notes),
    )


def _networks(path: Path, lines: list[bytes]) -> tuple[list[_Network], dict[int, float]]:
    """All networks, numbered by scan, and the Unix seconds of the scans that have them."""
    networks: list[_Network] = []
    stamp_s: dict[int, float] = {}
    scan, heard = 0, set[str]()
    for number, line in enumerate(lines, start=1):
        begun, stamp = _BSS.fullmatch(line), _TIME.fullmatch(line)
        bssid = begun[1].decode().lower() if begun else ""
        if heard and (stamp or bssid in heard):
            scan, heard = scan + 1, set()
        if stamp:
            stamp_s[scan] = float(stamp[1])
        elif begun:
            heard.add(bssid)
            networks.append(_Network(scan, number, bssid))
        elif line.lstrip().startswith(b"BSS ") and b"(on" in line:
            raise LogError(path, "BSS aa:bb:cc:dd:ee:ff(on …)", shown(line), "mend or remove the network", number)
        elif networks:
            _take(path, networks[-1], line, number)
    if not networks:
        raise LogError(path, "networks 'BSS aa:bb:cc:dd:ee:ff(on wlan0)'", "none", "save what iw dev … scan prints")
    return networks, stamp_s


def _take(path: Path, network: _Network, line: bytes, number: int) -> None:
    """What a line tells of its network; the first of each kind counts, later ones are of other things."""
    name = _SSID.fullmatch(line)
    if name and network.ssid is None:
        network.ssid = name[1].decode("utf-8", "replace")
    for what, pattern in _FIELDS.items():
        match = pattern.fullmatch(line)
        if match and what not in network.values:
            network.values[what] = _number(path, match[1], line, number)


def _number(path: Path, text: bytes, line: bytes, number: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or b"_" in text:
        raise LogError(path, "a finite number", shown(line.strip()), "mend or remove the line", number)
    return value


def _times(lines: Lines, scan: Integers, stamp_s: dict[int, float], column: dict[str, Array]) -> tuple[Array, Array]:
    """Seconds (n,) of each reading's scan, and when its network was last heard (n,), NaN where unknown."""
    time_s, seen_s = np.empty(len(scan)), np.empty(len(scan))
    only = scan[-1] == scan[0]
    for k in np.unique(scan).tolist():
        rows = np.flatnonzero(scan == k)
        boot_s, age_s = column["boot_s"][rows], column["age_ms"][rows] / 1e3
        latest_s = np.nanmax(boot_s) if np.isfinite(boot_s).any() else np.nan
        at_s = stamp_s.get(k, 0.0 if only and np.isnan(latest_s) else latest_s)
        if np.isnan(at_s):
            advice = "write date +%s.%N before each scan"
            raise lines.error(int(rows[0]), "the time of each scan", "several scans and no clock", advice)
        time_s[rows] = at_s
        seen_s[rows] = np.where(np.isfinite(boot_s), at_s - (latest_s - boot_s), at_s - age_s)
    return time_s, seen_s
