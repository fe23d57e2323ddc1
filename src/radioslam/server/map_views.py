"""What the page shows of a map, as rows for JSON."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.coverage import cover, walk_next
from radioslam.errors import NotFoundError
from radioslam.evaluation import evaluate
from radioslam.radio_map import RadioMap
from radioslam.results import MAX_GAP_S, SlamResult

HEAT_CELL_M = 1.0


def heat(result: SlamResult, access_point: str) -> dict[str, Any]:
    """One access point's field on a grid: rows of x, y, mean dBm, σ dB, probability of being heard.

    Raises:
        NotFoundError: it is not in the map.
    """
    samples = main_part(result.radio_map)
    if access_point not in samples.transmitters:
        raise NotFoundError(f"expected an access point of the map, found {access_point!r}")
    column = np.array([samples.transmitters.index(access_point)])
    field = cover(samples, HEAT_CELL_M, column)
    rows = np.column_stack([field.positions_xy, field.mean_dbm, field.uncertainty, field.detection])
    return {"cell_m": HEAT_CELL_M, "rows": rows}


def walk_here_next(result: SlamResult) -> list[tuple[float, float, float]]:
    """Places where the map knows least: x, y, σ in dB."""
    return walk_next(main_part(result.radio_map))


def errors(result: SlamResult) -> dict[str, Any]:
    """Errors against the references.

    Raises:
        NotFoundError: there are none.
    """
    if not result.judged.any():
        raise NotFoundError("expected walks with true positions, found none")
    return evaluate(result, None, MAX_GAP_S).as_dict()


@lru_cache(maxsize=8)
def load(folder: Path) -> SlamResult:
    """A floor's result; versions never change, so that the last ones can be kept."""
    return SlamResult.load(folder)


def main_part(radio_map: RadioMap) -> RadioMap:
    """The largest connected part."""
    return radio_map.select(radio_map.map == 0)


def paths(result: SlamResult) -> list[dict[str, Any]]:
    """Each walk before, after and in truth, at its scans and in the map's frame."""
    from radioslam.plots import reference_in_map

    samples, rows = result.radio_map, []
    reference_xy = reference_in_map(result)
    for k, name in enumerate(samples.walks):
        here = samples.walk == k
        rows.append(
            {
                "walk": name,
                "map": int(result.map_of_walk[k]),
                "device": result.devices[k] if result.devices else "",
                "time_s": samples.time_s[here],
                "odometry": result.odometry_poses[here, :2],
                "estimate": samples.poses[here],
                "sigma_m": samples.sigma_m[here],
                "reference": reference_xy[here] if np.isfinite(reference_xy[here]).any() else None,
            }
        )
    return rows


def loops(result: SlamResult) -> dict[str, Any]:
    """The loops that were kept, a row each."""
    kept, samples = result.loops.kept, result.radio_map
    apart_m = np.hypot(*(samples.poses[kept.i, :2] - samples.poses[kept.j, :2]).T)
    columns = (
        samples.walk[kept.i], samples.time_s[kept.i], samples.walk[kept.j], samples.time_s[kept.j],
        samples.poses[kept.i, :2], samples.poses[kept.j, :2],
        kept.similarity, result.uncertainty.sigma(kept.similarity), apart_m,
    )  # fmt: skip
    names = ["walk_i", "time_i_s", "walk_j", "time_j_s", "x_i_m", "y_i_m", "x_j_m", "y_j_m", "similarity", "sigma_m"]
    rows = np.column_stack(columns)
    return {"walks": samples.walks, "candidates": len(result.loops.pairs), "columns": [*names, "apart_m"], "rows": rows}


def plain(content: Any) -> Any:
    """For JSON: arrays as lists, what is no number as None."""
    if isinstance(content, np.ndarray):
        return _finite(content)
    if isinstance(content, dict):
        return {key: plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [plain(value) for value in content]
    if isinstance(content, float | np.floating):
        return round(float(content), 4) if np.isfinite(content) else None
    return content.item() if isinstance(content, np.generic) else content


def _finite(array: NDArray[Any]) -> Any:
    rounded = np.round(array.astype(float), 4).astype(object)
    rounded[~np.isfinite(array.astype(float))] = None
    return rounded.tolist()
