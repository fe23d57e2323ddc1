"""A growing map on disk: Parquet and JSON, written whole or not at all.

growing.json        version, the walks by number, what the last full optimization learned and how it went
config.toml         uncertainty.json
tracks.parquet      number,time_s,x_m,y_m,heading_rad,distance_m,translation_variance,heading_variance
steps.parquet       number,shape
scans.parquet       number,time_s,x_m,y_m,heading_rad,sigma_m                a row per WiFi scan
beacons.parquet     number,time_s                                            a row per scan for beacons
readings.parquet    number,radio,scan,transmitter,rss_dbm,frequency_mhz,last_seen_s
references.parquet  number,time_s,x_m,y_m
ties.parquet        walk_i,scan_i,walk_j,scan_j,similarity,reason
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from radioslam.config import load_config
from radioslam.errors import ResultError
from radioslam.fingerprints import collect_fingerprints
from radioslam.incremental import GrowingMap
from radioslam.mapped_walk import MappedWalk, Ties, split
from radioslam.odometry import Track
from radioslam.result_folder import whole_folder
from radioslam.results import SolverStatus
from radioslam.settling import Knowledge
from radioslam.uncertainty import UncertaintyModel
from radioslam.walk import RadioScans, Reference, Walk

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Columns = dict[str, NDArray[Any]]

VERSION = 2
POSE = ("x_m", "y_m", "heading_rad")
RADIOS = ("wifi", "ble")


def write_growing(grown: GrowingMap, folder: Path, force: bool) -> Path:
    """Write the folder; see ``GrowingMap.save``."""
    with whole_folder(folder, force) as partial:
        write_growing_parts(grown, partial)
    return folder


def write_growing_parts(grown: GrowingMap, folder: Path) -> None:
    """Fill an empty folder with the map."""
    walks = [grown.mapped[name] for name in grown.walks]
    ties = Ties.concatenate(grown.ties)
    tables = {
        "tracks": [(one.number, _track_columns(one.track)) for one in walks],
        "steps": [(one.number, {"shape": one.track.step_shapes}) for one in walks],
        "scans": [(one.number, _scan_columns(one)) for one in walks],
        "beacons": [(one.number, {"time_s": one.track.walk.ble.scan_time_s}) for one in walks if one.track.walk.ble],
        "references": [(one.number, _fixes(one.track.walk.reference)) for one in walks if one.track.walk.reference],
    }
    for name, parts in tables.items():
        _write(folder / f"{name}.parquet", _stacked(parts))
    _write(folder / "readings.parquet", _reading_columns(walks))
    _write(folder / "ties.parquet", {name: getattr(ties, name) for name in Ties.__dataclass_fields__})
    (folder / "config.toml").write_text(grown.config.to_toml(), "utf-8")
    if grown.knowledge is not None:
        grown.knowledge.uncertainty.save(folder / "uncertainty.json")
    (folder / "growing.json").write_text(json.dumps(_state(grown, walks), indent=1), "utf-8")


def read_growing(folder: Path) -> GrowingMap:
    """Read a folder; see ``GrowingMap.load``."""
    try:
        return _read_parts(folder)
    except (OSError, ValueError, KeyError, TypeError, IndexError, pa.ArrowException) as error:
        raise ResultError(f"{folder}: expected a growing map, found: {error}") from None


# Writing ---------------------------------------------------------------------------------------------------------


def _state(grown: GrowingMap, walks: Sequence[MappedWalk]) -> dict[str, Any]:
    known = grown.knowledge
    return {
        "radioslam_growing_map": VERSION,
        "rebuilt": grown.rebuilt,
        "status": None if grown.status is None else asdict(grown.status),
        "radio_lag_s": known and known.radio_lag_s,
        "axis_rad": known and known.axis_rad,
        "walks": [_facts(one) for one in walks],
    }


def _facts(one: MappedWalk) -> dict[str, Any]:
    walk, fix = one.track.walk, one.fix
    return {
        "number": one.number,
        "name": one.name,
        "device": walk.device,
        "floor": walk.floor,
        "log_scale_sigma": one.track.log_scale_sigma,
        "reason": one.reason,
        "fix": fix and [float(fix.time_s[0]), *fix.positions_xy[0].tolist(), fix.sigma_m],
        "origin_wgs84": walk.reference and walk.reference.origin_wgs84,
        "reference_sigma_m": walk.reference and walk.reference.sigma_m,
    }


def _track_columns(track: Track) -> Columns:
    names = ("time_s", "distance_m", "translation_variance", "heading_variance")
    return {**{name: getattr(track, name) for name in names}, **dict(zip(POSE, track.poses.T, strict=True))}


def _scan_columns(one: MappedWalk) -> Columns:
    pose = dict(zip(POSE, one.poses.T, strict=True))
    return {"time_s": one.track.walk.wifi.scan_time_s, **pose, "sigma_m": one.sigma_m}


def _fixes(reference: Reference) -> Columns:
    return {"time_s": reference.time_s, "x_m": reference.positions_xy[:, 0], "y_m": reference.positions_xy[:, 1]}


def _reading_columns(walks: Sequence[MappedWalk]) -> dict[str, Any]:
    radios = [(one.number, k, r) for one in walks for k, r in enumerate(_radios(one.track.walk)) if r is not None]
    names = sorted({name for _, _, scans in radios for name in scans.transmitters})
    code = {name: k for k, name in enumerate(names)}
    parts: list[tuple[int, Columns]] = []
    for number, k, scans in radios:
        codes = np.array([code[name] for name in scans.transmitters], dtype=np.int32)[scans.reading_transmitter]
        kind = np.full(len(codes), k, np.int8)
        readings = {name: getattr(scans, name) for name in ("rss_dbm", "frequency_mhz", "last_seen_s")}
        parts.append((number, {"radio": kind, "scan": scans.reading_scan, "transmitter": codes, **readings}))
    columns = {"transmitter": np.zeros(0, np.int32), **_stacked(parts)}
    dictionary = pa.DictionaryArray.from_arrays(
        pa.array(columns["transmitter"], pa.int32()), pa.array(names, pa.string())
    )
    return {**columns, "transmitter": dictionary}


def _radios(walk: Walk) -> tuple[RadioScans | None, RadioScans | None]:
    return walk.wifi, walk.ble


def _stacked(parts: Iterable[tuple[int, Columns]]) -> Columns:
    """One table of the walks' tables, with their numbers."""
    parts = list(parts)
    counts = [len(next(iter(columns.values()))) for _, columns in parts]
    stacked: Columns = {"number": np.repeat(np.array([number for number, _ in parts], np.int64), counts)}
    for name in parts[0][1] if parts else ():
        stacked[name] = np.concatenate([columns[name] for _, columns in parts])
    return stacked


def _write(path: Path, columns: dict[str, Any]) -> None:
    pq.write_table(pa.table(columns), path)


# Reading ---------------------------------------------------------------------------------------------------------


def _read_parts(folder: Path) -> GrowingMap:
    state = json.loads((folder / "growing.json").read_text("utf-8"))
    if state["radioslam_growing_map"] != VERSION:
        raise ValueError(f"version {state['radioslam_growing_map']}, not {VERSION}")
    grown = GrowingMap(load_config(file=folder / "config.toml", environment={}))
    names = ("tracks", "steps", "scans", "beacons", "references", "readings")
    tables = {name: _by_number(folder / f"{name}.parquet") for name in names}
    tracks = [_track(facts, tables) for facts in state["walks"]]
    ties = pq.read_table(folder / "ties.parquet")
    grown.ties = [Ties(**{name: ties[name].to_numpy() for name in Ties.__dataclass_fields__})]
    grown.rebuilt = state["rebuilt"]
    if tracks:
        parts = split(collect_fingerprints(tracks, grown.config.fingerprints))
        for facts, track, part in zip(state["walks"], tracks, parts, strict=True):
            scans, fix = tables["scans"][facts["number"]], facts["fix"]
            poses = np.column_stack([scans[name] for name in POSE])
            held = fix and Reference(np.array(fix[:1]), np.array([fix[1:3]]), sigma_m=fix[3])
            walk = MappedWalk(facts["number"], track, part, poses, scans["sigma_m"], held or None, facts["reason"])
            grown.mapped[walk.name] = walk
        model = UncertaintyModel.load(folder / "uncertainty.json")
        grown.knowledge = Knowledge(model, state["radio_lag_s"], state["axis_rad"])
        grown.status = SolverStatus(**state["status"])
    grown.condense_places()
    return grown


def _by_number(path: Path) -> dict[int, Columns]:
    """The rows of each walk of a table; transmitters stay numbers, beside their names."""
    table = pq.read_table(path).combine_chunks()
    if "transmitter" not in table.schema.names:
        columns = {name: table[name].to_numpy() for name in table.schema.names}
        names: NDArray[Any] = np.zeros(0, np.str_)
    else:
        coded = table["transmitter"].chunk(0) if table["transmitter"].num_chunks else None
        columns = {name: table[name].to_numpy() for name in table.schema.names if name != "transmitter"}
        columns["transmitter"] = np.zeros(0, np.int64) if coded is None else coded.indices.to_numpy()
        names = np.array([] if coded is None else coded.dictionary.to_pylist(), np.str_)
    number = columns["number"]
    bounds = np.flatnonzero(np.diff(number, prepend=-1, append=-1) != 0)
    parts = {}
    for first, last in itertools.pairwise(bounds.tolist()):
        part = {name: column[first:last] for name, column in columns.items()}
        parts[int(number[first])] = {**part, "names": names} if "transmitter" in part else part
    return parts


def _track(facts: dict[str, Any], tables: dict[str, dict[int, Columns]]) -> Track:
    number = facts["number"]
    track, steps = tables["tracks"][number], tables["steps"].get(number, {"shape": np.zeros(0)})
    return Track(
        walk=_walk(facts, tables),
        time_s=track["time_s"],
        poses=np.column_stack([track[name] for name in POSE]),
        distance_m=track["distance_m"],
        translation_variance=track["translation_variance"],
        heading_variance=track["heading_variance"],
        log_scale_sigma=facts["log_scale_sigma"],
        step_shapes=steps["shape"],
    )


def _walk(facts: dict[str, Any], tables: dict[str, dict[int, Columns]]) -> Walk:
    number, reference = facts["number"], None
    readings = tables["readings"].get(number)
    if number in tables["references"]:
        fixes, origin = tables["references"][number], facts["origin_wgs84"]
        positions = np.column_stack([fixes["x_m"], fixes["y_m"]])
        sigma_m = facts["reference_sigma_m"]
        reference = Reference(fixes["time_s"], positions, tuple(origin) if origin else None, sigma_m)
    beacons = tables["beacons"].get(number)
    return Walk(
        name=facts["name"],
        wifi=_scans(tables["scans"][number]["time_s"], readings, 0),
        ble=None if beacons is None else _scans(beacons["time_s"], readings, 1),
        reference=reference,
        device=facts["device"],
        floor=facts["floor"],
    )


def _scans(time_s: Array, readings: Columns | None, radio: int) -> RadioScans:
    if readings is None:
        nothing, none = np.zeros(0), np.zeros(0, np.int64)
        return RadioScans(time_s, none, none, nothing, (), nothing, nothing)
    here = readings["radio"] == radio
    codes, transmitter = np.unique(readings["transmitter"][here], return_inverse=True)
    return RadioScans(
        scan_time_s=time_s,
        reading_scan=readings["scan"][here],
        reading_transmitter=transmitter.astype(np.int64),
        rss_dbm=readings["rss_dbm"][here],
        transmitters=tuple(readings["names"][codes].tolist()),
        frequency_mhz=readings["frequency_mhz"][here],
        last_seen_s=readings["last_seen_s"][here],
    )
