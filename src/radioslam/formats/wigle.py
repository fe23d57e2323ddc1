"""WiGLE CSV 1.4 to 1.6: networks heard at latitudes and longitudes; no motion, the positions are the reference.

A line with the program and the phone, then a header, then a row per network heard (https://api.wigle.net/csvFormat.html).
Columns are found by name, because many writers leave some out. Rows of one time are one scan.
"""

from __future__ import annotations

import csv
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.fixes import geodetic_reference
from radioslam.formats.lines import split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.readings import known_addresses, wifi_scans
from radioslam.formats.records import Records, from_csv
from radioslam.formats.streams import PHONE_SENTINELS_DBM, make_scans
from radioslam.walk import RadioScans, Reference, Walk

Array = NDArray[np.float64]

_MARK = b"WigleWifi-"
_NEEDED = ("mac", "firstseen", "rssi")


def sniff(head: bytes) -> bool:
    """Whether the first line is WiGLE's, or a header with its columns."""
    first = head.split(b"\n", 1)[0].lower().replace(b'"', b"")
    return head.startswith(_MARK) or {b"mac", b"firstseen", b"rssi"} <= {name.strip() for name in first.split(b",")}


def read(path: Path) -> Walk:
    """Read a file.

    Raises:
        LogError: it is damaged; the message names the line.
    """
    data = load(path)
    first, _, rest = data.partition(b"\n")
    is_marked = first.startswith(_MARK)
    records = from_csv(path, rest if is_marked else data, 2 if is_marked else 1, comment="#")
    missing = [name for name in _NEEDED if name not in records.cells]
    if missing:
        expected = f"a header with the columns {','.join(_NEEDED)}"
        raise LogError(path, expected, f"none called {missing[0]}", "export as WiGLE CSV", 2 if is_marked else 1)
    notes: list[str] = []
    kind = np.array([one.upper() or "WIFI" for one in records.text("type") or []] or [], dtype=np.str_)
    return Walk(
        name=walk_name(path),
        wifi=_wifi(records.take(kind == "WIFI"), notes),
        ble=_beacons(records.take(kind == "BLE"), notes),
        reference=_reference(records.take(np.isin(kind, ["WIFI", "BLE"])), notes),
        device=_device(first) if is_marked else "",
        path=path,
        notes=tuple(notes),
    )


def _wifi(records: Records, notes: list[str]) -> RadioScans:
    return wifi_scans(
        records.lines,
        _time_s(records),
        records.text("mac"),
        records.numbers("rssi"),
        notes,
        ssid=records.text("ssid") if "ssid" in records.cells else None,
        frequency_mhz=_known(records.numbers("frequency", blank=True)),
    )


def _beacons(records: Records, notes: list[str]) -> RadioScans | None:
    if not len(records):
        return None
    addresses = known_addresses(records.lines, records.text("mac"), "MAC")
    rss_dbm, time_s = records.numbers("rssi"), _time_s(records)
    return make_scans(records.lines, time_s, addresses, rss_dbm, sentinels=PHONE_SENTINELS_DBM, notes=notes)


def _reference(records: Records, notes: list[str]) -> Reference | None:
    """The first position of each time; (0, 0) is how writers without a fix fill the columns."""
    latitude, longitude = (records.numbers(f"current{axis}", blank=True) for axis in ("latitude", "longitude"))
    known = np.isfinite(latitude) & np.isfinite(longitude) & ~((latitude == 0) & (longitude == 0))
    if not known.any():
        return None
    if not known.all():
        notes.append(f"{np.sum(~known)} rows without a position")
    fixed = records.take(known)
    _, first = np.unique(_time_s(fixed), return_index=True)
    once = fixed.take(np.isin(np.arange(len(fixed)), first))
    accuracy_m = once.numbers("accuracymeters", blank=True)
    return geodetic_reference(
        once.lines,
        _time_s(once),
        once.numbers("currentlatitude"),
        once.numbers("currentlongitude"),
        notes,
        np.where(accuracy_m == 0, np.nan, accuracy_m),
    )


def _time_s(records: Records) -> Array:
    """Unix seconds (n,) of ``FirstSeen``, which WiGLE writes in UTC."""
    known: dict[str, float] = {}
    times = []
    for index, text in enumerate(records.text("firstseen")):
        if text not in known:
            known[text] = _unix_s(records, index, text)
        times.append(known[text])
    return np.array(times)


def _unix_s(records: Records, index: int, text: str) -> float:
    try:
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        expected = "a time such as 2024-05-17 09:30:00 as firstseen"
        raise records.lines.error(index, expected, shown(text), "mend or remove the line") from None


def _known(frequency_mhz: Array) -> Array:
    return np.where(frequency_mhz > 0, frequency_mhz, np.nan)


def _device(first: bytes) -> str:
    """Brand and model from the line before the header."""
    try:
        cells = next(csv.reader([split_lines(first)[0].decode("utf-8", "replace")]), [])
    except csv.Error:
        return ""
    told = dict(cell.strip().split("=", 1) for cell in cells if "=" in cell)
    return " ".join(filter(None, (told.get("brand", "").strip(), told.get("model", "").strip())))
