"""Radio maps as GeoJSON (RFC 7946): samples or places of the field, and where the access points stand.

Longitude and latitude where the map is georeferenced, else local metres; ``kind`` tells the features apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.access_points import access_points
from radioslam.coverage import HEARD, Form, cover
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
Feature = dict[str, Any]


def geojson(radio_map: RadioMap, form: Form = "samples") -> dict[str, Any]:
    """A feature collection of the map in one of its forms, with all access points whose position is known.

    Raises:
        MappingError: the field of a map that heard nothing is asked for.
    """
    body = _samples(radio_map) if form == "samples" else _places(radio_map)
    frame = "local metres" if radio_map.georeference is None else "WGS84"
    return {"type": "FeatureCollection", "frame": frame, "features": [*body, *_access_points(radio_map)]}


def _features(radio_map: RadioMap, positions_xy: Array, properties: Iterator[Feature]) -> Iterator[Feature]:
    from radioslam.georeference import to_wgs84

    placed = positions_xy if radio_map.georeference is None else to_wgs84(radio_map, positions_xy)[:, ::-1]
    for local, at, own in zip(positions_xy.tolist(), placed.tolist(), properties, strict=True):
        geometry = {"type": "Point", "coordinates": at}
        yield {"type": "Feature", "geometry": geometry, "properties": {**own, "x_m": local[0], "y_m": local[1]}}


def _samples(radio_map: RadioMap) -> Iterator[Feature]:
    floors, rss = radio_map.floor_of_sample, radio_map.rss_dbm

    def properties() -> Iterator[Feature]:
        for k in range(len(radio_map)):
            part = slice(*rss.indptr[k : k + 2])
            names = (radio_map.transmitters[c] for c in rss.indices[part])
            heard = dict(zip(names, rss.data[part].tolist(), strict=True))
            walk = radio_map.walks[radio_map.walk[k]]
            yield {"kind": "sample", "walk": walk, "floor": str(floors[k]), "rssi_dbm": heard}

    return _features(radio_map, radio_map.poses[:, :2], properties())


def _places(radio_map: RadioMap) -> Iterator[Feature]:
    """The field on its grid: the strongest access point of each place, and those that most scans hear."""
    for floor, part in radio_map.by_floor():
        coverage = cover(part, form="field")

        def properties(floor: str = floor, coverage: Any = coverage, part: RadioMap = part) -> Iterator[Feature]:
            for k, best in enumerate(coverage.strongest):
                heard = np.flatnonzero(coverage.detection[k] >= HEARD)
                means = {part.transmitters[c]: round(float(coverage.mean_dbm[k, c]), 1) for c in heard}
                strongest = part.transmitters[best] if best >= 0 else None
                yield {"kind": "place", "floor": floor, "strongest": strongest, "mean_dbm": means}

        yield from _features(radio_map, coverage.positions_xy, properties())


def _access_points(radio_map: RadioMap) -> Iterator[Feature]:
    known = [point for point in access_points(radio_map) if point.position_xy is not None]
    properties = (
        {
            "kind": "access point",
            "bssid": point.transmitter,
            "floor": point.floor,
            "samples": point.samples,
            "strongest_dbm": point.strongest_dbm,
            "sigma_m": round(point.sigma_m, 2),
        }
        for point in known
    )
    return _features(radio_map, np.array([point.position_xy for point in known]).reshape(-1, 2), properties)
