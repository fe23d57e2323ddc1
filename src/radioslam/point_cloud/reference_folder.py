"""The folder of reference paths, written whole or not at all:

trajectories/*.tum   per walk, poses in space at the odometry's times; what ``radioslam evaluate --reference`` reads
graph.g2o            nodes and edges, in the plane or in space
loops.csv            walk_i,time_i_s,walk_j,time_j_s,found_by,matched,sigma_m,accepted,reason
config.toml  summary.json  report.html
"""

from __future__ import annotations

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam import g2o, rigid
from radioslam.config import Config
from radioslam.formats.tum import write_spatial_tum
from radioslam.planar import align_rigid, transform
from radioslam.point_cloud.graph_solvers import planar_graph
from radioslam.point_cloud.reference import ReferenceResult
from radioslam.point_cloud.registration import ACCEPTED
from radioslam.point_cloud.spatial_graph import write_spatial_g2o
from radioslam.result_folder import whole_folder

Array = NDArray[np.float64]

COLUMNS = ("walk_i", "time_i_s", "walk_j", "time_j_s", "found_by", "matched", "sigma_m", "accepted", "reason")


def write_reference(
    result: ReferenceResult, summary: dict[str, Any], config: Config, folder: Path, force: bool
) -> None:
    """Write the folder.

    Raises:
        ResultError: it exists without ``force``, or the disk refuses.
    """
    from radioslam.point_cloud.reference_report import write_report

    with whole_folder(folder, force) as partial:
        (partial / "trajectories").mkdir()
        for recording, path in zip(result.recordings, result.paths, strict=True):
            write_spatial_tum(partial / "trajectories" / f"{recording.name}.tum", recording.time_s, path)
        if result.planar:
            g2o.write_g2o(planar_graph(result.graph), partial / "graph.g2o")
        else:
            write_spatial_g2o(result.graph, partial / "graph.g2o")
        _write_loops(result, partial / "loops.csv")
        (partial / "config.toml").write_text(config.to_toml(), "utf-8")
        (partial / "summary.json").write_text(json.dumps(summary, indent=1), "utf-8")
        write_report(result, summary, partial / "report.html")


def _write_loops(result: ReferenceResult, path: Path) -> None:
    nodes, names = result.nodes, [recording.name for recording in result.recordings]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for a in result.attempts:
            ends = [value for k in (a.i, a.j) for value in (names[nodes.walk[k]], f"{nodes.time_s[k]:.6f}")]
            taken = a.reason == ACCEPTED
            sigma_m = float(np.sqrt(np.linalg.eigvalsh(a.covariance[3:, 3:])[-1]))
            reason = "" if taken else a.reason
            writer.writerow([*ends, a.kind, f"{a.matched:.3f}", f"{sigma_m:.4f}", str(taken).lower(), reason])


def summarize(result: ReferenceResult) -> dict[str, Any]:
    """What a person or a script wants to know: walks, loops tried and accepted by kind, reasons, what was left out."""
    kinds = dict.fromkeys(attempt.kind for attempt in result.attempts)
    reasons = Counter(attempt.reason for attempt in result.attempts if attempt.reason != ACCEPTED)
    return {
        "walks": [_walk_summary(result, k) for k in range(len(result.recordings))],
        "planar": result.planar,
        "nodes": len(result.nodes),
        "parts": len(np.unique(result.part)),
        "loops": {kind: _counts(result, kind) for kind in kinds},
        "rejected": dict(reasons),
        "converged": result.converged,
        "skipped": list(result.nodes.skipped),
        "warnings": list(result.nodes.warnings),
        "seconds": result.seconds,
    }


def _counts(result: ReferenceResult, kind: str) -> dict[str, int]:
    mine = [attempt for attempt in result.attempts if attempt.kind == kind]
    return {"tried": len(mine), "accepted": sum(attempt.reason == ACCEPTED for attempt in mine)}


def _walk_summary(result: ReferenceResult, k: int) -> dict[str, Any]:
    recording, mine = result.recordings[k], np.flatnonzero(result.nodes.walk == k)
    steps = result.followed[k].steps
    ends = {w for a in result.attempts if a.reason == ACCEPTED for w in result.nodes.walk[[a.i, a.j]].tolist()}
    moved = np.linalg.norm(np.diff(recording.T_odom_body[:, :3, 3], axis=0), axis=1)
    return {
        "name": recording.name,
        "clouds": len(recording.clouds),
        "nodes": len(mine),
        "length_m": float(moved.sum()),
        "part": int(result.part[mine[0]]) if len(mine) else None,
        "followed": int(steps.registered.sum()) if steps else 0,
        "has_loops": k in ends,
        "error_m": _errors(result, k),
    }


def _errors(result: ReferenceResult, k: int) -> dict[str, float] | None:
    """Mean error (m) of odometry and of the reference path where the walk came with true positions."""
    recording = result.recordings[k]
    truth = recording.walk.reference if recording.walk else None
    if truth is None or len(truth) < 2:
        return None
    true_xy = truth.at(recording.time_s, 60.0)
    known = np.isfinite(true_xy[:, 0])
    if known.sum() < 2:
        return None
    layers = {"odometry": recording.T_odom_body, "reference": result.paths[k]}
    return {name: _aligned_error(rigid.to_planar(T)[known, :2], true_xy[known]) for name, T in layers.items()}


def _aligned_error(positions_xy: Array, true_xy: Array) -> float:
    """Mean distance after the best rigid motion: no two frames are the same otherwise."""
    laid = transform(align_rigid(positions_xy, true_xy), positions_xy)
    return float(np.linalg.norm(laid - true_xy, axis=1).mean())
