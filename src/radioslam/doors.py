"""Bodies of the location APIs of Google and of Mozilla's ichnaea -> scans and walks; no web framework.

Fields and rules are those of https://ichnaea.readthedocs.io/en/latest/api/geolocate.html and geosubmit2.html, numbers
those of ichnaea's models/constants.py and api/locate/constants.py. A MAC address is twelve hex digits with ``:``,
``-``, ``.`` or nothing between them, but neither all 0, all f nor 01005e901000. A position is asked for with two WiFi
networks or two beacons, which keeps a single device from being followed; a report holds two networks or a beacon.
WiFi is heard at -100 to -10 dBm, Bluetooth at -127 to 0. Positions older than 20 s, worse than 200 m or faster than
50 m/s are set aside. A field that breaks a rule is as if it were not there. Frequencies reach to 7.2 GHz, as networks
do by now. Google's own API further leaves out locally administered addresses; ichnaea does not, and neither do we,
because many real networks have them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from radioslam.errors import DoorError
from radioslam.formats.fixes import geodetic_reference
from radioslam.formats.lines import Lines
from radioslam.formats.readings import mac_address
from radioslam.privacy import may_be_mapped
from radioslam.walk import RadioScans, Walk

Scan = dict[str, float]

LEAST_NETWORKS = 2
LARGEST_BODY_ITEMS = 10_000
_WIFI_DBM = (-100.0, -10.0)
_BEACON_DBM = (-127.0, 0.0)
_AGE_MS = (-3_600_000.0, 3_600_000.0)
_TIMESTAMP_MS = (1e12, 1e13)
_WORST_ACCURACY_M = 200.0
_WORST_AGE_MS = 20_000.0
_FASTEST_M_S = 50.0
_NO_ADDRESSES = frozenset(("00:00:00:00:00:00", "ff:ff:ff:ff:ff:ff", "01:00:5e:90:10:00"))


@dataclass(frozen=True)
class Reading:
    """One transmitter of a report: its address, RSS in dBm or NaN, MHz or NaN, and how many seconds ago or NaN."""

    address: str
    rss_dbm: float
    frequency_mhz: float
    age_s: float


@dataclass(frozen=True)
class Report:
    """What was heard at ``time_s`` (Unix), and the position, None where a rule sets it aside.

    ``position`` is latitude and longitude (degrees) and the accuracy in metres, NaN where not told.
    """

    time_s: float
    wifi: tuple[Reading, ...]
    beacons: tuple[Reading, ...]
    position: tuple[float, float, float] | None


def scan_of_geolocate(body: Any) -> Scan:
    """The scan, access point -> RSS in dBm, of a ``POST /v1/geolocate`` body; beacons are ``ble:`` and their address.

    Networks without a strength count for the rule of two, and are left out.

    Raises:
        DoorError: ``parseError`` where the body is not such JSON; ``notFound`` where the networks are too few, which is
            how these APIs answer a question that cannot be answered.
    """
    wifi, beacons = _readings(_object(body), "wifiAccessPoints"), _readings(_object(body), "bluetoothBeacons")
    scan = {one.address: one.rss_dbm for one in wifi} if len(wifi) >= LEAST_NETWORKS else {}
    if len(beacons) >= LEAST_NETWORKS:
        scan |= {f"ble:{one.address}": one.rss_dbm for one in beacons}
    heard = {address: rss for address, rss in scan.items() if not math.isnan(rss)}
    if not heard:
        found = f"{len(wifi)} networks and {len(beacons)} beacons"
        raise DoorError("notFound", f"expected {LEAST_NETWORKS} or more networks with a signalStrength, found {found}")
    return heard


def reports_of_geosubmit(body: Any, now_s: float) -> list[Report]:
    """The reports of a ``POST /v2/geosubmit`` body that keep the rules, in the body's order.

    Args:
        body: ``{"items": [...]}``.
        now_s: Unix seconds, the time of reports that have none.

    Raises:
        DoorError: ``parseError``: the body is not such JSON, or holds more than ``LARGEST_BODY_ITEMS`` items.
    """
    items = _object(body).get("items")
    if not isinstance(items, list):
        raise DoorError("parseError", "expected an array items, found none")
    if len(items) > LARGEST_BODY_ITEMS:
        raise DoorError("parseError", f"expected at most {LARGEST_BODY_ITEMS} items, found {len(items)}; send less")
    reports = (_report(_object(item), now_s) for item in items)
    return [one for one in reports if len(one.wifi) >= LEAST_NETWORKS or one.beacons]


def walk_of_reports(reports: Sequence[Report], name: str) -> Walk:
    """One sender's reports as a walk without motion: scans, and the positions as its reference.

    A reading without a strength is left out; its report still tells where somebody stood.
    """
    placed = [one for one in reports if one.position is not None]
    table = np.array([one.position for one in placed], dtype=float).reshape(-1, 3)
    lines = Lines(Path(name), [b""] * len(placed), list(range(1, len(placed) + 1)))
    notes: list[str] = []
    times_s = np.array([one.time_s for one in placed])
    return Walk(
        name=name,
        wifi=_scans(reports, "wifi"),
        ble=_scans(reports, "beacons") if any(one.beacons for one in reports) else None,
        reference=geodetic_reference(lines, times_s, table[:, 0], table[:, 1], notes, table[:, 2]),
        notes=tuple(notes),
    )


def _scans(reports: Sequence[Report], kind: str) -> RadioScans:
    rows = [(report.time_s, one) for report in reports for one in getattr(report, kind) if not math.isnan(one.rss_dbm)]
    return RadioScans.from_readings(
        [time_s for time_s, _ in rows],
        [one.address for _, one in rows],
        [one.rss_dbm for _, one in rows],
        [one.frequency_mhz for _, one in rows],
        [time_s - one.age_s for time_s, one in rows],
    )


def _report(item: Mapping[str, Any], now_s: float) -> Report:
    timestamp_ms = _within(item.get("timestamp"), _TIMESTAMP_MS)
    return Report(
        time_s=now_s if math.isnan(timestamp_ms) else timestamp_ms / 1e3,
        wifi=tuple(_readings(item, "wifiAccessPoints")),
        beacons=tuple(_readings(item, "bluetoothBeacons")),
        position=_position(item.get("position")),
    )


def _position(position: Any) -> tuple[float, float, float] | None:
    if position is None:
        return None
    told = _object(position)
    latitude, longitude = _within(told.get("latitude"), (-90, 90)), _within(told.get("longitude"), (-180, 180))
    accuracy_m = _within(told.get("accuracy"), (0, math.inf))
    age_ms, speed = _within(told.get("age"), (-math.inf, math.inf)), _within(told.get("speed"), (0, math.inf))
    is_bad = abs(age_ms) > _WORST_AGE_MS or speed > _FASTEST_M_S or accuracy_m > _WORST_ACCURACY_M
    if is_bad or math.isnan(latitude) or math.isnan(longitude):
        return None
    return latitude, longitude, accuracy_m or math.nan


def _readings(body: Mapping[str, Any], name: str) -> list[Reading]:
    """The transmitters of one kind, each once with its strongest reading; networks not to be mapped are left out."""
    found: dict[str, Reading] = {}
    limits = _WIFI_DBM if name == "wifiAccessPoints" else _BEACON_DBM
    for entry in _entries(body, name):
        ssid = entry.get("ssid") if name == "wifiAccessPoints" else None
        address = mac_address(entry["macAddress"]) if isinstance(entry.get("macAddress"), str) else None
        if address is None or address in _NO_ADDRESSES or not may_be_mapped(None if ssid is None else str(ssid)):
            continue
        strength = _within(entry.get("signalStrength"), limits)
        one = Reading(
            address,
            math.nan if strength == 0 else strength,
            _within(entry.get("frequency"), (2400, 7200)),
            _within(entry.get("age"), _AGE_MS) / 1e3,
        )
        before = found.get(address)
        if before is None or math.isnan(before.rss_dbm) or one.rss_dbm > before.rss_dbm:
            found[address] = one
    return list(found.values())


def _entries(body: Mapping[str, Any], name: str) -> Iterator[Mapping[str, Any]]:
    entries = body.get(name)
    if entries is None:
        return
    if not isinstance(entries, list):
        raise DoorError("parseError", f"expected an array {name}, found {type(entries).__name__}")
    if len(entries) > LARGEST_BODY_ITEMS:
        raise DoorError("parseError", f"expected at most {LARGEST_BODY_ITEMS} in {name}, found {len(entries)}")
    yield from map(_object, entries)


def _object(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise DoorError("parseError", f"expected a JSON object, found {type(value).__name__}")
    return value


def _within(value: Any, limits: tuple[float, float]) -> float:
    """The number, or NaN where there is none, or it lies outside the limits; numbers may come as text."""
    if value is None or isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return math.nan
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return math.nan
    return number if limits[0] <= number <= limits[1] and math.isfinite(number) else math.nan
