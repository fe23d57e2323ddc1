"""The result folder: the contract with everything outside.

The folder is written whole or not at all:

    trajectories.csv      walk,time_s,x_m,y_m,heading_rad,sigma_m,map     a row per scan
    trajectories/*.tum    the same per walk, for evo and other tools
    odometry.csv          walk,time_s,x_m,y_m,heading_rad,distance_m      the same scans by odometry alone
    reference.csv         walk,time_s,x_m,y_m                             fixes: true positions that the logs had
    loops.csv             walk_i,time_i_s,walk_j,time_j_s,similarity,sigma_m,kept,reason
    uncertainty.json      similarity -> variance
    radio_map.parquet  graph.g2o  config.toml  summary.json  report.html
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
from numpy.typing import NDArray

from radioslam import g2o
from radioslam.config import load_config
from radioslam.errors import GraphError, ResultError
from radioslam.formats.tum import write_tum
from radioslam.loops import KEPT, REASONS, Loops
from radioslam.radio_map import RadioMap
from radioslam.results import SlamResult, SolverStatus
from radioslam.similarity import Pairs
from radioslam.uncertainty import UncertaintyModel
from radioslam.walk import Reference

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def write_result(result: SlamResult, folder: Path, force: bool, peak_memory_mb: float | None) -> Path:
    """Write the folder whole or not at all; see ``SlamResult.save``."""
    with whole_folder(folder, force) as partial:
        write_parts(result, partial, peak_memory_mb)
    return folder


def read_result(folder: Path) -> SlamResult:
    """Read a folder; see ``SlamResult.load``."""
    try:
        return _read_parts(folder)
    except (OSError, ValueError, KeyError, TypeError, GraphError, pa.ArrowException) as error:
        raise ResultError(f"{folder}: expected a result folder, found: {error}") from None


OWN_MARKS = ("summary.json", ".radioslam-walks", "growing.json")
"""Files that only folders written by this package hold."""


def check_target(folder: Path, force: bool, inputs: Iterable[Path] = ()) -> None:
    """Refuse early what could not, or should not, be written in the end.

    Raises:
        ResultError: ``folder`` is a file; exists without ``force``; holds what this package did not write; or is or
            holds one of the ``inputs``.
    """
    target = folder.resolve()
    for path in inputs:
        if target == path.resolve() or target in path.resolve().parents:
            raise ResultError(f"{folder}: expected a folder apart from the input {path}; choose another --out")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultError(f"{folder}: expected a folder, found a file; choose another --out")
    if not force:
        raise ResultError(f"{folder}: expected a new folder, found one that exists; use --force to replace it")
    if any(folder.iterdir()) and not any((folder / mark).exists() for mark in OWN_MARKS):
        raise ResultError(f"{folder}: --force replaces results and simulated walks only, found other files there")


@contextmanager
def whole_folder(folder: Path, force: bool, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A folder to fill that takes its place only when the block ends well; else nothing is left of it.

    Raises:
        ResultError: as ``check_target`` does, or the disk refuses.
    """
    check_target(folder, force, inputs)
    partial: Path | None = None
    try:
        folder.absolute().parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.absolute().parent))
        yield partial
        partial.chmod(0o777 & ~_umask())
        _take_place(partial, folder)
    except OSError as error:
        raise ResultError(f"{folder}: could not be written: {error.strerror or error}; nothing was changed") from None
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)


def _take_place(partial: Path, folder: Path) -> None:
    """Move ``partial`` to ``folder``; what stood there goes only once the new one stands."""
    if not folder.exists():
        partial.rename(folder)
        return
    aside = partial.with_name(partial.name + ".old")
    folder.rename(aside)
    try:
        partial.rename(folder)
    except BaseException:
        aside.rename(folder)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_parts(result: SlamResult, folder: Path, peak_memory_mb: float | None) -> None:
    """Fill an empty folder with a result."""
    from radioslam.report import write_report

    summary = {**result.summary(), "peak_memory_mb": peak_memory_mb}
    samples = result.radio_map
    name = pa.DictionaryArray.from_arrays(pa.array(samples.walk, pa.int32()), pa.array(samples.walks, pa.string()))
    pose = dict(zip(("x_m", "y_m", "heading_rad"), samples.poses.T, strict=True))
    key = {"walk": name, "time_s": samples.time_s}
    _write_csv(folder / "trajectories.csv", {**key, **pose, "sigma_m": samples.sigma_m, "map": samples.map})
    pose = dict(zip(pose, result.odometry_poses.T, strict=True))
    _write_csv(folder / "odometry.csv", {**key, **pose, "distance_m": result.distance_m})
    fixes = [(name, reference) for name, reference in zip(samples.walks, result.references, strict=True) if reference]
    if fixes:
        write_references(folder / "reference.csv", fixes)
    (folder / "trajectories").mkdir()
    for k, walk in enumerate(samples.walks):
        here = samples.walk == k
        write_tum(folder / "trajectories" / f"{walk}.tum", samples.time_s[here], samples.poses[here])
    _write_loops(result, folder / "loops.csv")
    result.uncertainty.save(folder / "uncertainty.json")
    samples.save(folder / "radio_map.parquet")
    g2o.write_g2o(result.graph, folder / "graph.g2o")
    (folder / "config.toml").write_text(result.config.to_toml(), "utf-8")
    (folder / "summary.json").write_text(json.dumps(summary, indent=1), "utf-8")
    write_report(result, folder / "report.html", summary)


def write_references(path: Path, fixes: Iterable[tuple[str, Reference]]) -> None:
    """Write fixes of walks by name as ``walk,time_s,x_m,y_m``."""
    parts = [(np.full(len(r), name), r.time_s, *r.positions_xy.T) for name, r in fixes]
    names = ("walk", "time_s", "x_m", "y_m")
    _write_csv(path, dict(zip(names, (np.concatenate(c) for c in zip(*parts, strict=True)), strict=True)))


def read_references(path: Path, origin_wgs84: tuple[float, float] | None = None) -> dict[str, Reference]:
    """Read ``walk,time_s,x_m,y_m``; fixes of each walk by its name, sorted by time.

    Raises:
        ResultError: no such file, a column is missing or not a number.
    """
    try:
        table = _read_csv(path)
        walk = np.array(table["walk"].to_pylist(), dtype=np.str_)
        time_s, x, y = (table[name].to_numpy().astype(float) for name in ("time_s", "x_m", "y_m"))
        references = {}
        for name in np.unique(walk):
            here = np.flatnonzero(walk == name)
            here = here[np.argsort(time_s[here], kind="stable")]
            references[str(name)] = Reference(time_s[here], np.column_stack([x, y])[here], origin_wgs84)
    except (OSError, KeyError, ValueError, pa.ArrowException) as error:
        raise ResultError(f"{path}: expected columns walk,time_s,x_m,y_m, found: {error}") from None
    return references


def _write_loops(result: SlamResult, path: Path) -> None:
    pairs, samples = result.loops.pairs, result.radio_map
    names = pa.array(samples.walks, pa.string())
    columns: dict[str, Any] = {}
    for end, rows in (("i", pairs.i), ("j", pairs.j)):
        columns[f"walk_{end}"] = names.take(pa.array(samples.walk[rows]))
        columns[f"time_{end}_s"] = samples.time_s[rows]
    kept = result.loops.reason == KEPT
    columns |= {"similarity": pairs.similarity, "sigma_m": result.uncertainty.sigma(pairs.similarity)}
    why = pa.array(["" if k == KEPT else reason for k, reason in enumerate(REASONS)])
    columns |= {"kept": kept, "reason": why.take(pa.array(result.loops.reason))}
    _write_csv(path, columns)


def _write_csv(path: Path, columns: dict[str, Any]) -> None:
    table = pa.table({name: _plain(column) for name, column in columns.items()})
    with path.open("wb") as file:
        file.write((",".join(columns) + "\n").encode())
        for quoting in ("none", "needed"):  # quotes only where a name asks for them
            try:
                pacsv.write_csv(table, file, pacsv.WriteOptions(include_header=False, quoting_style=quoting))
                break
            except pa.ArrowInvalid:
                file.truncate(file.seek(len(",".join(columns)) + 1))


def _plain(column: Any) -> pa.Array:
    array = column if isinstance(column, pa.Array) else pa.array(column)
    return array.cast(pa.string()) if pa.types.is_dictionary(array.type) else array


def _read_parts(folder: Path) -> SlamResult:
    samples = RadioMap.load(folder / "radio_map.parquet")
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    odometry = pacsv.read_csv(folder / "odometry.csv")
    _check_count(folder / "odometry.csv", "rows", len(samples), len(odometry))
    place = {key: row for row, key in enumerate(_keys(samples.walks, samples.walk, samples.time_s))}
    origin = summary["origin_wgs84"] and tuple(summary["origin_wgs84"])
    fixes = read_references(folder / "reference.csv", origin) if (folder / "reference.csv").exists() else {}
    graph = g2o.read_g2o((folder / "graph.g2o").read_text("utf-8"), str(folder / "graph.g2o"))
    loops = _read_loops(folder / "loops.csv", place)
    _check_count(folder / "graph.g2o", "edges", summary["graph"]["edges"], graph.edge_count)
    _check_count(folder / "loops.csv", "candidates", summary["loops"]["candidates"], len(loops.pairs))
    return SlamResult(
        config=load_config(file=folder / "config.toml", environment={}),
        radio_map=samples,
        odometry_poses=np.column_stack([odometry[n].to_numpy() for n in ("x_m", "y_m", "heading_rad")]),
        distance_m=odometry["distance_m"].to_numpy(),
        references=tuple(fixes.get(name) for name in samples.walks),
        loops=loops,
        uncertainty=UncertaintyModel.load(folder / "uncertainty.json"),
        graph=graph,
        solver=SolverStatus(**summary["solver"]),
        devices=tuple(summary["devices"]),
        seconds=summary["seconds"],
        skipped=tuple((s["path"], s["reason"]) for s in summary["skipped"]),
        **_read_places(summary["walks"]),
    )


def _read_places(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Confidence and reasons of the walks where their starts were found, else nothing."""
    sigmas, reasons = ([row[name] for row in rows] for name in ("placed_sigma_m", "reason"))
    if not any(value is not None for value in (*sigmas, *reasons)):
        return {}
    return {
        "placed_sigma_m": tuple(float("nan") if sigma_m is None else sigma_m for sigma_m in sigmas),
        "untied_reason": tuple(reason or "" for reason in reasons),
    }


def _check_count(path: Path, what: str, expected: int, found: int) -> None:
    if found != expected:
        raise ResultError(f"{path}: expected {expected} {what}, found {found}; the file is not whole")


def _keys(walks: tuple[str, ...], walk: Integers, time_s: Array) -> Iterator[tuple[str, float]]:
    return zip((walks[k] for k in walk), time_s.tolist(), strict=True)


def _read_csv(path: Path) -> pa.Table:
    text = {name: pa.string() for name in ("walk", "walk_i", "walk_j", "reason")}
    options = pacsv.ConvertOptions(column_types=text, strings_can_be_null=False)
    return pacsv.read_csv(path, convert_options=options)


def _read_loops(path: Path, place: dict[tuple[str, float], int]) -> Loops:
    table = _read_csv(path)
    ends = []
    for end in ("i", "j"):
        names, times = table[f"walk_{end}"].to_pylist(), table[f"time_{end}_s"].to_pylist()
        ends.append(np.array([place[key] for key in zip(names, times, strict=True)], dtype=np.int64))
    similarity = table["similarity"].to_numpy().astype(float)
    code = {reason: k for k, reason in enumerate(REASONS)} | {"": KEPT}
    reason = np.array([code[text] for text in table["reason"].to_pylist()], dtype=np.uint8)
    return Loops(Pairs(ends[0], ends[1], similarity), reason)
