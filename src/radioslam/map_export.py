"""Radio maps for other tools (Parquet, CSV, GeoJSON, heat map PNG), and several maps in one."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import sparse

from radioslam.coverage import HEARD, Form, grid, strength_map
from radioslam.errors import ResultError
from radioslam.map_geojson import geojson
from radioslam.radio_map import RadioMap
from radioslam.whole_files import whole_file

KINDS = (".parquet", ".csv", ".geojson", ".png")
GRID_M = 2.0


def export_map(radio_map: RadioMap, path: Path, transmitter: str | None = None, form: Form | None = None) -> None:
    """Write by the ending of ``path``; ``transmitter`` chooses the heat map.

    ``form``: the annotated samples or the field on a grid; default the field for a heat map, else the samples.

    Raises:
        ResultError: unknown ending or access point, the field as Parquet, or the disk refuses.
    """
    if path.suffix not in KINDS:
        raise ResultError(f"{path}: expected an ending of {', '.join(KINDS)}, found {path.suffix!r}")
    if path.suffix == ".parquet" and form == "field":
        raise ResultError(f"{path}: expected --form samples for .parquet, found field; write the field as .csv")
    with whole_file(path) as partial:
        if path.suffix == ".parquet":
            radio_map.save(partial)
        elif path.suffix == ".csv":
            (_write_field_csv if form == "field" else _write_csv)(radio_map, partial)
        elif path.suffix == ".geojson":
            partial.write_text(json.dumps(geojson(radio_map, form or "samples")), "utf-8")
        else:
            from radioslam.heat_maps import save_heat_map_png

            save_heat_map_png(radio_map, partial, transmitter, form or "field")


def _write_csv(radio_map: RadioMap, path: Path) -> None:
    """A row per reading."""
    entries = radio_map.rss_dbm.tocoo()
    floors = radio_map.floor_of_sample
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["walk", "time_s", "x_m", "y_m", "sigma_m", "floor", "transmitter", "rssi_dbm"])
        for row, column, rss in zip(entries.row, entries.col, entries.data, strict=True):
            x, y = radio_map.poses[row, :2]
            walk, name = radio_map.walks[radio_map.walk[row]], radio_map.transmitters[column]
            time_s, sigma = float(radio_map.time_s[row]), radio_map.sigma_m[row]
            writer.writerow([walk, time_s, f"{x:.3f}", f"{y:.3f}", f"{sigma:.3f}", floors[row], name, f"{rss:g}"])


def _write_field_csv(radio_map: RadioMap, path: Path) -> None:
    """A row per place of the field and access point that most scans there hear."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["x_m", "y_m", "floor", "transmitter", "mean_dbm", "sigma_db", "detection", "strongest"])
        for floor, part in radio_map.by_floor():
            places = grid(part.poses[:, :2], GRID_M)
            at = strength_map(part, "field").predict(places)
            heard = at.detection >= HEARD
            best = np.where(heard, at.mean_dbm, -np.inf).argmax(axis=1)
            for row, column in np.argwhere(heard).tolist():
                x, y = places[row]
                name, strongest = part.transmitters[column], int(best[row] == column)
                numbers = (f"{table[row, column]:.2f}" for table in (at.mean_dbm, at.sigma_db, at.detection))
                writer.writerow([f"{x:.1f}", f"{y:.1f}", floor, name, *numbers, strongest])


def merge(maps: Sequence[RadioMap], floors: Sequence[str] | None = None) -> RadioMap:
    """Samples of several maps that share one frame; a later map's walk replaces an earlier one of the same name.

    ``floors`` names the floor of each map; walks of different floors may bear the same name.

    Raises:
        ResultError: no maps, floors that do not match them, or different georeferences.
    """
    if not maps or (floors is not None and len(floors) != len(maps)):
        raise ResultError(f"expected a floor for each of {len(maps)} maps, found {len(floors or ())}")
    if floors is not None:
        maps = [_on_floor(one, floor) for one, floor in zip(maps, floors, strict=True)]
    ties = {one.georeference for one in maps if one.georeference}
    if len(ties) > 1:
        raise ResultError("expected maps of one georeference, found several; georeference the merged map instead")
    later: set[tuple[str, str]] = set()
    parts = []
    for one in reversed(maps):
        keys = [(name, floor) for name, floor in zip(one.walks, one.floors or [""] * len(one.walks), strict=True)]
        keep = np.array([key not in later for key in keys], dtype=bool)
        later |= set(keys)
        parts.append(one.select(keep[one.walk]))
    parts.reverse()
    return _joined(parts, next(iter(ties), None))


def _on_floor(one: RadioMap, floor: str) -> RadioMap:
    return replace(one, walks=tuple(f"{floor}/{name}" for name in one.walks), floors=(floor,) * len(one.walks))


def _joined(parts: Sequence[RadioMap], georeference: tuple[float, float, float] | None) -> RadioMap:
    names = tuple(sorted({name for part in parts for name in part.transmitters}))
    column = {name: k for k, name in enumerate(names)}
    offsets = np.cumsum([0, *(len(part.walks) for part in parts)])
    blocks = []
    for part in parts:
        entries = part.rss_dbm.tocoo()
        place = np.array([column[name] for name in part.transmitters], dtype=np.int64)
        blocks.append(
            sparse.csr_array((entries.data, (entries.row, place[entries.col])), shape=(len(part), len(names)))
        )
    floors = [floor for part in parts for floor in (part.floors or ("",) * len(part.walks))]
    columns = {
        name: np.concatenate([getattr(p, name) for p in parts]) for name in ("time_s", "poses", "sigma_m", "map")
    }
    return RadioMap(
        walks=tuple(name for part in parts for name in part.walks),
        walk=np.concatenate([part.walk + offset for part, offset in zip(parts, offsets, strict=False)]),
        rss_dbm=sparse.csr_array(sparse.vstack(blocks)),
        transmitters=names,
        floors=tuple(floors) if any(floors) else (),
        georeference=georeference,
        **columns,
    )
