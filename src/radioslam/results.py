"""What a mapping run found, and its summary in numbers."""

from __future__ import annotations

import functools
import importlib.metadata
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.accuracy import Alignment, ErrorStatistics, alignment_pose, position_errors, size_ratio
from radioslam.config import Config
from radioslam.loops import KEPT, REASONS, Loops
from radioslam.planar import transform
from radioslam.pose_graph import PoseGraph
from radioslam.radio_map import RadioMap
from radioslam.uncertainty import UncertaintyModel
from radioslam.walk import Reference

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ALIGNMENT_OF_STARTS: dict[str, Alignment] = {
    "known": "none",
    "mixed": "none",
    "common": "start",
    "unknown": "rigid",
}
"""How each protocol compares a map with the truth."""
FOUND_STARTS = ("unknown", "mixed")
"""Protocols in which some walks are placed by their scans, or not at all."""
MAX_GAP_S = 60.0
"""Between fixes farther apart the truth counts as unknown."""


@dataclass(frozen=True)
class SolverStatus:
    """How the last optimization went: ``cost`` is F of equation (1).

    ``radio_lag_s`` is how much older than its time a scan's content was found to be, ``axis_rad`` the direction in
    [0, π/2) that the building's axes were found to run in; None where they were no unknowns.
    """

    converged: bool
    iterations: int
    cost_before: float
    cost_after: float
    seconds: float
    radio_lag_s: float | None = None
    axis_rad: float | None = None


@dataclass(frozen=True)
class SlamResult:
    """What a mapping run found; n scans of w walks.

    Attributes:
        config: the effective configuration.
        radio_map: the n optimized poses with their standard deviations and what was heard there.
        odometry_poses: (n, 3) the same scans by odometry alone, placed as the walks' starts say.
        distance_m: (n,) walked so far.
        references: (w,) true positions of each walk, or None.
        loops: candidates between scans (indices into the n) with their verdicts.
        uncertainty: similarity -> variance.
        graph: the last pose graph.  solver: how its optimization went.
        devices: (w,) the phones.  seconds: wall clock per step.
        skipped: (path, reason) of logs that could not be used.
        placed_sigma_m: (w,) standard deviation with which a walk's first place was found; NaN where it was given, or
            where nothing tells. Empty like ``untied_reason`` where no start had to be found.
        untied_reason: (w,) why a walk is not in the main map; empty texts for those that are.
    """

    config: Config
    radio_map: RadioMap
    odometry_poses: Array
    distance_m: Array
    references: tuple[Reference | None, ...]
    loops: Loops
    uncertainty: UncertaintyModel
    graph: PoseGraph
    solver: SolverStatus
    devices: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    skipped: tuple[tuple[str, str], ...] = ()
    placed_sigma_m: tuple[float, ...] = ()
    untied_reason: tuple[str, ...] = ()

    @property
    def walks(self) -> tuple[str, ...]:
        """Names of the walks, sorted."""
        return self.radio_map.walks

    @functools.cached_property
    def reference_xy(self) -> Array:
        """(n, 2) true positions at the scans, NaN where unknown; see ``reference_at_scans``."""
        return reference_at_scans(self.radio_map, self.references)

    @property
    def map_of_walk(self) -> Integers:
        """(w,) the map that each walk belongs to; 0 is the largest."""
        first = np.searchsorted(self.radio_map.walk, np.arange(len(self.walks)))
        return self.radio_map.map[first]

    @property
    def judged(self) -> NDArray[np.bool_]:
        """(n,) scans whose errors count: where starts were found, those of map 0, which has one frame; else all.

        A walk that could not be tied would be laid over the truth all by itself and look good.
        """
        found = self.config.merging.starts in FOUND_STARTS
        return self.radio_map.map == 0 if found else np.ones(len(self.radio_map), bool)

    def aligned(self, positions_xy: Array, how: Alignment, reference_xy: Array | None = None) -> Array:
        """Positions (n, 2) in the frame of the reference (n, 2), each map aligned for itself."""
        reference_xy = self.reference_xy if reference_xy is None else reference_xy
        walk, maps = self.radio_map.walk, self.radio_map.map
        starts = np.concatenate([[True], walk[1:] != walk[:-1]])
        aligned = np.empty_like(positions_xy)
        for number in np.unique(maps):
            here = maps == number
            pose = alignment_pose(positions_xy[here], reference_xy[here], how, starts[here])
            aligned[here] = transform(pose, positions_xy[here])
        return aligned

    def summary(self) -> dict[str, Any]:
        """Counts, lengths, errors, seconds: what stands in ``summary.json``."""
        return summarize(self)

    def save(self, folder: Path | str, force: bool = False, peak_memory_mb: float | None = None) -> Path:
        """Write the result folder, whole or not at all.

        Raises:
            ResultError: the folder exists and ``force`` is not given, or cannot be written.
        """
        from radioslam.result_folder import write_result

        return write_result(self, Path(folder), force, peak_memory_mb)

    @staticmethod
    def load(folder: Path | str) -> SlamResult:
        """Read a result folder.

        Raises:
            ResultError: a file is missing, cut short or not of this form.
        """
        from radioslam.result_folder import read_result

        return read_result(Path(folder))


def reference_at_scans(
    samples: RadioMap, references: Sequence[Reference | None], max_gap_s: float = MAX_GAP_S
) -> Array:
    """True positions (n, 2) of the samples, linear between the fixes of each walk.

    NaN outside the fixes, between fixes more than ``max_gap_s`` apart, and for walks without reference.
    """
    positions = np.full((len(samples), 2), np.nan)
    for k, reference in enumerate(references):
        if reference is not None:
            here = samples.walk == k
            positions[here] = reference.at(samples.time_s[here], max_gap_s)
    return positions


def summarize(result: SlamResult) -> dict[str, Any]:
    """The summary as plain dicts, lists and numbers."""
    how = ALIGNMENT_OF_STARTS[result.config.merging.starts]
    truth = np.where(result.judged[:, None], result.reference_xy, np.nan)
    estimate = result.aligned(result.radio_map.poses[:, :2], how)
    odometry = result.aligned(result.odometry_poses[:, :2], how)
    errors = {"estimate": position_errors(estimate, truth), "odometry": position_errors(odometry, truth)}
    kept = result.loops.kept
    walk, maps = result.radio_map.walk, result.map_of_walk
    everywhere = np.ones(len(walk), bool)
    counts = np.bincount(result.loops.reason, minlength=len(REASONS)).tolist()
    rejected = {
        reason: count for k, (reason, count) in enumerate(zip(REASONS, counts, strict=True)) if k != KEPT and count
    }
    rows = []
    for k, name in enumerate(result.walks):
        loops = int(np.sum((walk[kept.i] == k) | (walk[kept.j] == k)))
        row = {"name": name, **_row(result, walk == k, errors), "loops": loops, "map": int(maps[k])}
        rows.append({**row, **_place(result, k)})
    total = {"name": "all", **_row(result, everywhere, errors), "loops": len(kept), "map": None}
    total["size_ratio"] = _number(size_ratio(estimate, truth))
    return {
        "versions": _versions(),
        "alignment": how,
        "max_gap_s": MAX_GAP_S,
        "walks": rows,
        "total": total,
        "access_points": int(np.sum(np.bincount(result.radio_map.rss_dbm.indices) > 0)),
        "loops": {
            "candidates": len(result.loops.pairs),
            "kept": len(kept),
            "rejected": dict(sorted(rejected.items())),
        },
        "graph": {"nodes": len(result.graph.poses), "edges": result.graph.edge_count},
        "solver": asdict(result.solver),
        "seconds": result.seconds,
        "maps": [
            {"map": int(m), "walks": [result.walks[k] for k in np.flatnonzero(maps == m)]} for m in np.unique(maps)
        ],
        "untied": [result.walks[k] for k in np.flatnonzero(maps > 0)],
        "devices": list(result.devices),
        "origin_wgs84": next((r.origin_wgs84 for r in result.references if r and r.origin_wgs84), None),
        "skipped": [{"path": path, "reason": reason} for path, reason in result.skipped],
    }


def _row(result: SlamResult, mask: NDArray[np.bool_], errors: dict[str, Array]) -> dict[str, Any]:
    walk = result.radio_map.walk[mask]
    last = np.concatenate([walk[1:] != walk[:-1], [True]])
    first = np.concatenate([[True], walk[1:] != walk[:-1]])
    distance, time_s = result.distance_m[mask], result.radio_map.time_s[mask]
    known = {name: values[mask] for name, values in errors.items()}
    has_reference = bool(np.isfinite(known["estimate"]).any())
    return {
        "length_m": float(distance[last].sum()),
        "duration_s": float((time_s[last] - time_s[first]).sum()),
        "scans": int(mask.sum()),
        "sigma_m": _number(float(result.radio_map.sigma_m[mask].mean())),
        "error": {name: ErrorStatistics.of(e).as_dict() for name, e in known.items()} if has_reference else None,
    }


def _place(result: SlamResult, k: int) -> dict[str, Any]:
    """How well a walk's first place was found and why it is not in the main map; None where nothing is to be said."""
    sigma_m = result.placed_sigma_m[k] if result.placed_sigma_m else float("nan")
    reason = result.untied_reason[k] if result.untied_reason else ""
    return {"placed_sigma_m": _number(sigma_m), "reason": reason or None}


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _versions() -> dict[str, str]:
    packages = ("radioslam", "numpy", "scipy", "qdldl", "pyarrow")
    return {"python": platform.python_version(), **{name: importlib.metadata.version(name) for name in packages}}
