"""How far off is an estimate? Arrays in, numbers out.

Errors are distances in metres between estimated and true positions at the same instants.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from radioslam import planar

Array = NDArray[np.float64]
Alignment = Literal["none", "start", "rigid"]


@dataclass(frozen=True)
class ErrorStatistics:
    """Errors in metres: count, mean, standard deviation, percentiles, maximum and root mean square."""

    count: int
    mean: float
    std: float
    median: float
    p75: float
    p90: float
    p95: float
    max: float
    rmse: float

    @staticmethod
    def of(errors_m: Array) -> ErrorStatistics:
        """Statistics of errors (n,), NaN left out.

        Raises:
            ValueError: nothing is left.
        """
        errors = errors_m[np.isfinite(errors_m)]
        if not len(errors):
            raise ValueError("expected at least one error, found none")
        median, p75, p90, p95 = np.percentile(errors, [50, 75, 90, 95])
        return ErrorStatistics(
            count=len(errors),
            mean=float(errors.mean()),
            std=float(errors.std()),
            median=float(median),
            p75=float(p75),
            p90=float(p90),
            p95=float(p95),
            max=float(errors.max()),
            rmse=float(np.sqrt(np.mean(errors**2))),
        )

    def as_dict(self) -> dict[str, float]:
        """Name to number, for tables and JSON."""
        return asdict(self)


def position_errors(estimate_xy: Array, reference_xy: Array) -> Array:
    """Distances (n,) between positions (n, 2); NaN where either is unknown."""
    return np.hypot(*(estimate_xy - reference_xy).T)


def alignment_pose(estimate_xy: Array, reference_xy: Array, how: Alignment, starts: NDArray[np.bool_]) -> Array:
    """The pose T_reference_estimate (3,) under which estimate and reference, (n, 2) each, are to be compared.

    ``none``: as they are. ``start``: a shift that brings the walks' starts together, headings as they are (the mean
    over the rows marked in ``starts`` (n,)). ``rigid``: the best rotation and shift of all, no scale.
    """
    known = np.isfinite(estimate_xy).all(axis=1) & np.isfinite(reference_xy).all(axis=1)
    if how == "none" or not known.any():
        return np.zeros(3)
    if how == "rigid":
        return planar.align_rigid(estimate_xy[known], reference_xy[known])
    at_start = known & starts
    chosen = at_start if at_start.any() else known & (np.cumsum(known) == 1)
    return np.append((reference_xy[chosen] - estimate_xy[chosen]).mean(axis=0), 0.0)


def size_ratio(estimate_xy: Array, reference_xy: Array) -> float:
    """Spread of the estimate over spread of the reference, positions (n, 2); below 1 the map has contracted.

    Spread is the root mean square distance from the centre of the positions. NaN where there is no spread.
    """
    known = np.isfinite(estimate_xy).all(axis=1) & np.isfinite(reference_xy).all(axis=1)
    estimate, reference = estimate_xy[known], reference_xy[known]
    if len(reference) < 2 or np.ptp(reference, axis=0).max() == 0:
        return float("nan")
    return float(_spread(estimate) / _spread(reference))


def _spread(positions_xy: Array) -> float:
    return float(np.sqrt(np.mean(np.sum((positions_xy - positions_xy.mean(axis=0)) ** 2, axis=1))))


def segment_errors(estimate_xy: Array, reference_xy: Array, length_m: float) -> Array:
    """Relative errors (k,), in metres per metre, over segments of ``length_m`` walked by the reference.

    A segment begins at each position of one walk, (n, 2) each, and ends at the first position that lies
    ``length_m`` further along the reference; its error is the distance between the two displacements, over the
    segment's true length.
    """
    along = planar.path_length(reference_xy) if len(reference_xy) else np.zeros(0)
    end = np.searchsorted(along, along + length_m - 1e-9)
    begin = np.flatnonzero(end < len(along))
    end = end[begin]
    difference = (estimate_xy[end] - estimate_xy[begin]) - (reference_xy[end] - reference_xy[begin])
    return np.hypot(*difference.T) / (along[end] - along[begin])
