"""Reference paths of simulated walks with clouds beside the simulator's truth: ``… reference_walks WALKS REFERENCE``.

*Start given*: the first pose, position and heading, is the true one; *aligned*: the best rigid motion. *Right*: within
5 cm and 3° of the truth.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.reference import RIGHT_M, RIGHT_RAD
from radioslam import planar, rigid
from radioslam.formats import open_format
from radioslam.formats.tum import read_spatial_tum
from radioslam.simulator.cloud_frames import true_poses
from radioslam.walk import Reference

Array = NDArray[np.float64]


def truth_of(walk: Path) -> Reference:
    """The true positions of a walk's folder."""
    reference = open_format.read(walk / open_format.FOLDER_NAMES["scans"]).reference
    if reference is None:
        raise SystemExit(f"{walk}: expected a simulated walk with its true positions, found none")
    return reference


def true_at(truth: Reference, time_s: Array) -> Array:
    """Poses (n, 4, 4) of the body."""
    return rigid.interpolate(truth.time_s, rigid.from_planar(true_poses(truth.positions_xy)), time_s)


def errors(trajectory: Path, truth: Reference) -> tuple[float, float]:
    """Mean distance (m) in the plane with the start given, and aligned."""
    time_s, T = read_spatial_tum(trajectory)
    true = true_at(truth, time_s)
    moved = true[0] @ rigid.inverse(T[0]) @ T
    xy, true_xy = T[:, :2, 3], true[:, :2, 3]
    aligned_xy = planar.transform(planar.align_rigid(xy, true_xy), xy)
    start, aligned = (np.linalg.norm(found - true_xy, axis=1).mean() for found in (moved[:, :2, 3], aligned_xy))
    return float(start), float(aligned)


def right_loops(result: Path, truths: dict[str, Reference]) -> int:
    """How many of the accepted registrations are right."""
    with (result / "loops.csv").open(encoding="utf-8") as file:
        taken = [row for row in csv.DictReader(file) if row["accepted"] == "true"]
    edges = [line.split() for line in (result / "graph.g2o").read_text("utf-8").splitlines()]
    edges = [words for words in edges if words[0] == "EDGE_SE2"][-len(taken) :]  # odometry comes first
    right = 0
    for row, words in zip(taken, edges if taken else [], strict=True):
        i, j = (true_at(truths[row[f"walk_{end}"]], np.array([float(row[f"time_{end}_s"])])) for end in "ij")
        found = rigid.from_planar(np.array([words[3:6]], dtype=float))
        metres, radians = rigid.apart(rigid.inverse(i) @ j, found)
        right += int(metres[0] <= RIGHT_M and radians[0] <= RIGHT_RAD)
    return right


def row(walk: dict[str, Any], layers: list[tuple[float, float]], loops: str, minutes: float) -> str:
    """Markdown."""
    shown = [f"{error:.2f}" for layer in layers for error in layer]
    cells = [walk["name"], f"{walk['length_m']:.0f} m", walk["clouds"], walk["nodes"], walk["followed"], loops, *shown]
    return "| " + " | ".join(str(cell) for cell in [*cells, f"{minutes:.1f}"]) + " |"


def run(walks: Path, result: Path) -> None:
    """Print a row per walk."""
    summary = json.loads((result / "summary.json").read_text("utf-8"))
    truths = {walk["name"]: truth_of(walks / walk["name"]) for walk in summary["walks"]}
    tried, accepted = (sum(kind[name] for kind in summary["loops"].values()) for name in ("tried", "accepted"))
    loops = f"{right_loops(result, truths)}, {accepted}, {tried}"
    print(
        "| walk | length | clouds | nodes | clouds followed | loops right, accepted, tried | odometry: start given, m "
        "| aligned, m | reference: start given, m | aligned, m | minutes |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for walk in summary["walks"]:
        name = walk["name"]
        paths = walks / name / open_format.FOLDER_NAMES["trajectory"], result / "trajectories" / f"{name}.tum"
        layers = [errors(path, truths[name]) for path in paths]
        print(row(walk, layers, loops, sum(summary["seconds"].values()) / 60))


if __name__ == "__main__":
    run(Path(sys.argv[1]), Path(sys.argv[2]))
