"""A result against the truth: errors per walk and in all, odometry alone beside the estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.accuracy import Alignment, ErrorStatistics, position_errors, segment_errors, size_ratio
from radioslam.errors import ResultError
from radioslam.results import ALIGNMENT_OF_STARTS, MAX_GAP_S, SlamResult, reference_at_scans
from radioslam.walk import Reference

Array = NDArray[np.float64]

SEGMENT_LENGTHS_M = (10.0, 30.0, 100.0)


@dataclass(frozen=True)
class Row:
    """One walk, or all of them.

    Attributes:
        name: the walk, or ``all``.
        scans: scans with a known true position.
        errors: ``odometry`` and ``estimate``, in metres.
        ratio: mean error of the estimate over that of odometry.
        size_ratio: spread of positions over spread of the reference, for both.
        segments: for both, segment length (m) -> mean relative error (m per m), where walks are long enough.
    """

    name: str
    scans: int
    errors: dict[str, ErrorStatistics]
    ratio: float
    size_ratio: dict[str, float]
    segments: dict[str, dict[float, float]]

    def as_dict(self) -> dict[str, Any]:
        """Plain dicts and numbers, None where a number is not known."""
        return {
            "name": self.name,
            "scans": self.scans,
            "errors": {name: errors.as_dict() for name, errors in self.errors.items()},
            "ratio": _known(self.ratio),
            "size_ratio": {name: _known(value) for name, value in self.size_ratio.items()},
            "segments": {n: {f"{length:g}": v for length, v in s.items()} for n, s in self.segments.items()},
        }


@dataclass(frozen=True)
class Evaluation:
    """Errors of a result.

    Attributes:
        alignment: how the map was laid over the truth.  max_gap_s: fixes farther apart were not interpolated.
        rows: a row per walk that has a reference.  total: all of them.
        truth: (n, 2) true positions, NaN where unknown.
        positions: (n, 2) for ``odometry`` and ``estimate``, laid over the truth.
        tied: walks of map 0.  walks: all of them. Where starts had to be found, only the former are judged.
    """

    alignment: Alignment
    max_gap_s: float
    rows: tuple[Row, ...]
    total: Row
    truth: Array
    positions: dict[str, Array]
    tied: int
    walks: int

    @property
    def errors(self) -> dict[str, Array]:
        """(n,) per scan in metres, for ``odometry`` and ``estimate``; NaN where the truth is unknown."""
        return {name: position_errors(xy, self.truth) for name, xy in self.positions.items()}

    @property
    def without_truth(self) -> int:
        """Scans that could not be judged."""
        return int(np.sum(~np.isfinite(self.truth[:, 0])))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "alignment": self.alignment,
            "max_gap_s": self.max_gap_s,
            "without_truth": self.without_truth,
            "tied": {"walks": self.tied, "of": self.walks},
            "walks": [row.as_dict() for row in self.rows],
            "total": self.total.as_dict(),
        }


def with_references(result: SlamResult, references: Mapping[str, Reference]) -> SlamResult:
    """The same result judged by other true positions, given by walk.

    Raises:
        ResultError: a name that is none of the result's walks.
    """
    strangers = sorted(set(references) - set(result.walks))
    if strangers:
        raise ResultError(f"expected references of the result's {len(result.walks)} walks, found {strangers[0]!r}")
    return replace(result, references=tuple(references.get(name) for name in result.walks))


def evaluate(result: SlamResult, alignment: Alignment | None = None, max_gap_s: float = MAX_GAP_S) -> Evaluation:
    """Judge a result.

    Args:
        result: what ``map_walks`` or ``SlamResult.load`` gave.
        alignment: ``none``, ``start`` or ``rigid``; default by the result's starts (known and mixed, common,
            unknown).
        max_gap_s: the truth between fixes farther apart counts as unknown.

    Raises:
        ResultError: no scan has a known true position.
    """
    truth = reference_at_scans(result.radio_map, result.references, max_gap_s)
    truth[~result.judged] = np.nan
    known = np.isfinite(truth[:, 0])
    if not known.any():
        raise ResultError(
            f"expected true positions for some scans of {len(result.walks)} walks, found none; give --reference with "
            "the walks' names and clocks, or a larger --max-gap"
        )
    how = alignment or ALIGNMENT_OF_STARTS[result.config.merging.starts]
    positions = {
        "odometry": result.aligned(result.odometry_poses[:, :2], how, truth),
        "estimate": result.aligned(result.radio_map.poses[:, :2], how, truth),
    }
    walk = result.radio_map.walk
    walks = [k for k in range(len(result.walks)) if known[walk == k].any()]
    rows = tuple(_row(result.walks[k], positions, truth, known & (walk == k), walk) for k in walks)
    total, tied = _row("all", positions, truth, known, walk), int(np.sum(result.map_of_walk == 0))
    return Evaluation(how, max_gap_s, rows, total, truth, positions, tied, len(result.walks))


def _row(
    name: str, positions: Mapping[str, Array], truth: Array, mask: NDArray[np.bool_], walk: NDArray[np.int64]
) -> Row:
    here = np.flatnonzero(mask)
    errors = {n: ErrorStatistics.of(position_errors(xy[here], truth[here])) for n, xy in positions.items()}
    return Row(
        name=name,
        scans=len(here),
        errors=errors,
        ratio=errors["estimate"].mean / errors["odometry"].mean if errors["odometry"].mean else float("nan"),
        size_ratio={n: size_ratio(xy[here], truth[here]) for n, xy in positions.items()},
        segments={n: _segments(xy[here], truth[here], walk[here]) for n, xy in positions.items()},
    )


def _segments(positions_xy: Array, truth: Array, walk: NDArray[np.int64]) -> dict[float, float]:
    means = {}
    for length in SEGMENT_LENGTHS_M:
        parts = [segment_errors(positions_xy[walk == k], truth[walk == k], length) for k in np.unique(walk)]
        errors = np.concatenate(parts)
        if len(errors):
            means[length] = float(errors.mean())
    return means


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def load_references(path: Path, walks: Sequence[str]) -> dict[str, Reference]:
    """True positions by walk from ``walk,time_s,x_m,y_m`` (CSV), a folder of ``WALK.tum``, or one TUM file.

    A TUM file alone belongs to the walk of its name, or to the only walk.

    Raises:
        ResultError: nothing there that is one of these, or no walk of that name.
    """
    from radioslam.result_folder import read_references

    if path.is_dir():
        files = {file.stem: file for file in sorted(path.glob("*.tum")) if file.stem in walks}
        if not files:
            raise ResultError(f"{path}: expected WALK.tum for some of the result's walks, found none")
        return {name: _tum_reference(file) for name, file in files.items()}
    if path.suffix == ".tum":
        name = path.stem if path.stem in walks else walks[0]
        if name != path.stem and len(walks) > 1:
            raise ResultError(f"{path}: expected a file named like one of {len(walks)} walks, found {path.stem!r}")
        return {name: _tum_reference(path)}
    return read_references(path)


def _tum_reference(path: Path) -> Reference:
    from radioslam.formats import read_tum

    signal = read_tum(path)
    return Reference(signal.time_s, signal.values[:, :2])


def write_tum_pairs(result: SlamResult, evaluation: Evaluation, folder: Path) -> None:
    """Write each walk's aligned estimate, odometry and truth at the same instants, for evo and other tools.

    ``folder/estimate/WALK.tum``, ``folder/odometry/WALK.tum`` and ``folder/reference/WALK.tum`` hold the scans whose
    truth is known, so that ``evo_ape tum`` without alignment gives the same figures. Headings are the estimate's.
    """
    from radioslam.formats import write_tum

    samples = result.radio_map
    known = np.isfinite(evaluation.truth[:, 0])
    layers = {"reference": evaluation.truth, **evaluation.positions}
    for layer, positions_xy in layers.items():
        (folder / layer).mkdir(parents=True, exist_ok=True)
        for k, name in enumerate(result.walks):
            here = known & (samples.walk == k)
            poses = np.column_stack([positions_xy[here], samples.poses[here, 2]])
            if len(poses):
                write_tum(folder / layer / f"{name}.tum", samples.time_s[here], poses)
