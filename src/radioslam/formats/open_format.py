"""RadioSLAM's own format, for anybody's tracker or robot: a scans CSV with partners beside it.

A walk is a folder with ``scans.csv``, ``trajectory.tum``, ``reference.csv``, ``inertial.csv``, ``ble.csv`` and
``walk.toml``, or flat files ``NAME.scans.csv``, ``NAME.tum``, ``NAME.reference.csv`` and so on; docs/formats.md
has the columns. Only the scans are needed to read it; mapping needs a trajectory or inertial data as well.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats import pose_files, tum
from radioslam.formats.lines import Layout, Lines, Table, parse, split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.streams import check_unit, make_reference, make_scans, make_signal
from radioslam.walk import Inertial, RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]

FOLDER_NAMES = {
    "scans": "scans.csv",
    "trajectory": "trajectory.tum",
    "reference": "reference.csv",
    "inertial": "inertial.csv",
    "ble": "ble.csv",
    "about": "walk.toml",
}
FLAT_ENDINGS = {
    "scans": ".scans.csv",
    "trajectory": ".tum",
    "reference": ".reference.csv",
    "inertial": ".inertial.csv",
    "ble": ".ble.csv",
    "about": ".toml",
}
INERTIAL_GROUPS = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "magnetometer": ("mx", "my", "mz"),
    "rotation_vector": ("qx", "qy", "qz", "qw"),
}
_OPTIONAL_READING = ("frequency_mhz", "last_seen_s")
_ABOUT_KEYS = ("device", "floor", "origin_latitude_deg", "origin_longitude_deg")


def sniff(head: bytes) -> bool:
    """Whether the first bytes of a file are a scans CSV or a TUM trajectory."""
    first = head.split(b"\n", 1)[0].lower()
    is_scans = b"rssi_dbm" in first and (b"bssid" in first or b"time_s" in first)
    return is_scans or (tum.sniff(head) and not pose_files.sniff(head))


def is_scans(path: Path) -> bool:
    """Whether a file is a walk's scans by its name."""
    name = _bare_name(path)
    return name == FOLDER_NAMES["scans"] or name.endswith(FLAT_ENDINGS["scans"])


def is_partner(path: Path) -> bool:
    """Whether a file within a folder belongs to a walk, or is a bare trajectory, by its name."""
    name = _bare_name(path)
    if name == FOLDER_NAMES["trajectory"]:
        return log_of(path) != path
    kinds = ("reference", "inertial", "ble")
    return name.endswith((".tum", ".toml", *(FLAT_ENDINGS[kind] for kind in kinds))) or name in {
        FOLDER_NAMES[kind] for kind in kinds
    }


def log_of(path: Path) -> Path:
    """The scans beside a trajectory, if there are any; other paths as they are."""
    if not _bare_name(path).endswith(".tum"):
        return path
    return _partner(path, "scans") or path


def read(path: Path) -> Walk:
    """Read the walk of a scans CSV or of a trajectory.

    Raises:
        LogError: the file or a partner is damaged; the message names file and line.
    """
    log = log_of(path)
    is_bare_trajectory = _bare_name(log).endswith(".tum")
    notes: list[str] = []
    trajectory, beacons = _partner(log, "trajectory"), _partner(log, "ble")
    about = _read_about(_partner(log, "about"))
    no_scans = RadioScans.from_readings([], [], [])
    return Walk(
        name=_name(log),
        wifi=no_scans if is_bare_trajectory else _read_scans(log, "bssid"),
        ble=_read_scans(beacons, "identity") if beacons else None,
        odometry=tum.read_tum(trajectory, notes) if trajectory else None,
        inertial=_read_inertial(_partner(log, "inertial"), notes),
        reference=_read_reference(_partner(log, "reference"), _origin(about), notes),
        device=str(about.get("device", "")),
        floor=str(about.get("floor", "")),
        path=log,
        notes=tuple(notes),
    )


def _bare_name(path: Path) -> str:
    return path.name.removesuffix(".gz")


def _in_folder(path: Path) -> bool:
    return _bare_name(path) in (FOLDER_NAMES["scans"], FOLDER_NAMES["trajectory"])


def _name(log: Path) -> str:
    return log.resolve().parent.name or "walk" if _in_folder(log) else walk_name(log)


def _partner(path: Path, kind: str) -> Path | None:
    """The partner file of this kind, packed or not, if there is one."""
    name = FOLDER_NAMES[kind] if _in_folder(path) else walk_name(path) + FLAT_ENDINGS[kind]
    candidates = (path.with_name(name), path.with_name(name + ".gz"))
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _read_scans(path: Path, identity: str) -> RadioScans:
    lines, layout, table = _read_csv(path, ("time_s", "rssi_dbm"), _OPTIONAL_READING, identity)
    known = {name: table.column(index) for index, name in enumerate(layout.numbers)}
    return make_scans(
        lines,
        known["time_s"],
        table.text,
        known["rssi_dbm"],
        known.get("frequency_mhz"),
        known.get("last_seen_s"),
    )


def _read_reference(path: Path | None, origin_wgs84: tuple[float, float] | None, notes: list[str]) -> Reference | None:
    if path is None:
        return None
    lines, _, table = _read_csv(path, ("time_s", "x_m", "y_m"))
    return make_reference(lines, table.column(0), table.numbers[:, 1:], notes, origin_wgs84)


def _read_inertial(path: Path | None, notes: list[str]) -> Inertial | None:
    if path is None:
        return None
    optional = tuple(column for group in INERTIAL_GROUPS.values() for column in group)
    lines, layout, table = _read_csv(path, ("time_s",), optional)
    streams = {}
    for what, group in INERTIAL_GROUPS.items():
        present = [column for column in group if column in layout.numbers]
        if present and len(present) < len(group):
            raise LogError(path, f"the columns {','.join(group)} together", ",".join(present), line=1)
        if present:
            values = table.numbers[:, [layout.numbers.index(column) for column in group]]
            streams[what] = _inertial_signal(lines, table.column(0), values, what, notes)
    accelerometer = streams.pop("accelerometer", None)
    if accelerometer is None:
        raise LogError(path, "accelerometer columns ax,ay,az with values", "none", "add them or remove the file")
    return Inertial(accelerometer, **streams)


def _inertial_signal(lines: Lines, time_s: Array, values: Array, what: str, notes: list[str]) -> Signal | None:
    """One sensor's samples; it has none in the rows where all its cells are blank."""
    known = ~np.isnan(values)
    partly = known.any(axis=1) & ~known.all(axis=1)
    if partly.any():
        expected = f"all of {','.join(INERTIAL_GROUPS[what])} or none"
        raise lines.error(int(partly.argmax()), expected, "some blank", "mend or remove the line")
    rows = np.flatnonzero(known.all(axis=1))
    if not len(rows):
        return None
    sampled, values = lines.take(rows), values[rows]
    if what == "rotation_vector":
        check_unit(sampled, values)
        values = values / np.linalg.norm(values, axis=1, keepdims=True)
    return make_signal(sampled, time_s[rows], values, what, notes)


def _read_csv(
    path: Path, required: tuple[str, ...], optional: tuple[str, ...] = (), text: str = ""
) -> tuple[Lines, Layout, Table]:
    """A CSV whose columns are found by the names in its first line; columns unknown to us are passed over."""
    header, *rows = split_lines(load(path))
    columns = tuple(name.strip() for name in header.decode("utf-8", "replace").split(","))
    wanted = (*required, text) if text else required
    if not set(wanted) <= set(columns) or len(set(columns)) < len(columns):
        expected = f"a header with the columns {','.join(wanted)}, each once"
        raise LogError(path, expected, shown(header), "name the columns and separate them by ','", 1)
    numbers = (*required, *(name for name in optional if name in columns))
    layout = Layout(columns, numbers, text, ",", blank=frozenset(optional))
    lines = Lines(path)
    for number, row in enumerate(rows, start=2):
        if row.strip():
            lines.add(row, number)
    return lines, layout, parse(lines, layout)


def _read_about(path: Path | None) -> Mapping[str, Any]:
    if path is None:
        return {}
    advice = f"known keys: {', '.join(_ABOUT_KEYS)}"
    try:
        about = tomllib.loads(load(path).decode())
    except (ValueError, RecursionError) as error:
        raise LogError(path, "TOML in UTF-8", shown(str(error)), advice) from None
    unknown = [key for key in about if key not in _ABOUT_KEYS]
    if unknown:
        raise LogError(path, "known keys", shown(unknown[0]), advice)
    _check_origin(path, about)
    return about


def _check_origin(path: Path, about: Mapping[str, Any]) -> None:
    for key, largest in (("origin_latitude_deg", 90), ("origin_longitude_deg", 180)):
        value = about.get(key)
        if value is None and not {"origin_latitude_deg", "origin_longitude_deg"} & set(about):
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= largest:
            expected = f"{key} as a number within ±{largest}"
            raise LogError(path, expected, shown(str(value)), "give both parts of the origin or none")


def _origin(about: Mapping[str, Any]) -> tuple[float, float] | None:
    if "origin_latitude_deg" not in about:
        return None
    return float(about["origin_latitude_deg"]), float(about["origin_longitude_deg"])
