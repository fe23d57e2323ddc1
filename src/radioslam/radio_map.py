"""The radio map: the optimized tracks annotated with what was heard at each place.

Several floors can share one map; where it is georeferenced, ``georeference`` ties its metres to latitude and longitude.
Version 1 of the file had neither and is still read.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from scipy import sparse

from radioslam.errors import ResultError
from radioslam.whole_files import whole_file

if TYPE_CHECKING:
    from radioslam.positioning import Location

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

FORMAT_VERSION = 2
READABLE_VERSIONS = ("1", "2")
SCHEMA = pa.schema(
    [
        ("walk", pa.dictionary(pa.int32(), pa.string())),
        ("time_s", pa.float64()),
        ("x_m", pa.float64()),
        ("y_m", pa.float64()),
        ("heading_rad", pa.float64()),
        ("sigma_m", pa.float64()),
        ("map", pa.int32()),
        ("transmitter", pa.list_(pa.string())),
        ("rssi_dbm", pa.list_(pa.float32())),
    ]
)


@dataclass(frozen=True)
class RadioMap:
    """n samples: where and when a scan was made, and what it heard.

    Attributes:
        walks: names of the walks.  walk: (n,) index into them.  time_s: (n,) on the walk's own clock.
        poses: (n, 3) in the frame of the sample's map.  sigma_m: (n,) standard deviation of the position per axis.
        map: (n,) 0 for the largest connected part of the crowd.
        rss_dbm: (n, m) CSR; what is not stored was not heard.  transmitters: m identities.
        floors: the floor of each walk, or () where all are of one floor that has no name.
        georeference: latitude and longitude (degrees) of (0, 0), and the angle (rad) from east to the x axis, or None.
    """

    walks: tuple[str, ...]
    walk: Integers
    time_s: Array
    poses: Array
    sigma_m: Array
    map: Integers
    rss_dbm: sparse.csr_array
    transmitters: tuple[str, ...]
    floors: tuple[str, ...] = ()
    georeference: tuple[float, float, float] | None = None

    def __len__(self) -> int:
        return len(self.walk)

    @property
    def floor_of_sample(self) -> NDArray[np.str_]:
        """(n,) label of the floor, "" where it has none."""
        return np.array(self.floors or [""] * len(self.walks), dtype=np.str_)[self.walk]

    def by_floor(self) -> Iterator[tuple[str, RadioMap]]:
        """Label and samples of each floor, those of its largest map; one floor "" where they have no names."""
        main = self.select(self.map == 0)
        labels = main.floor_of_sample
        return ((str(floor), main.select(labels == floor)) for floor in np.unique(labels))

    def select(self, rows: NDArray[np.bool_] | Integers) -> RadioMap:
        """The samples that a mask (n,) or an index array picks; walks and access points keep their numbers."""
        columns = {name: getattr(self, name)[rows] for name in ("walk", "time_s", "poses", "sigma_m", "map")}
        return replace(self, **columns, rss_dbm=sparse.csr_array(self.rss_dbm[rows]))

    def locate(self, scan: Mapping[str, float]) -> Location:
        """The position of one scan, access point -> RSS in dBm.

        Learns the field at each call; make a ``positioning.Positioner`` once to locate many.

        Raises:
            PositioningError: the scan is empty or holds what is no RSS.
        """
        from radioslam.positioning import Positioner, scan_matrix

        scan_matrix([scan], self.transmitters)  # refuse bad scans before the work
        return Positioner.of(self).locate(scan)

    def save(self, path: Path) -> None:
        """Write Parquet, whole or not at all, a row per sample; readings are lists ``transmitter`` and ``rssi_dbm``."""
        names = pa.array(self.transmitters, pa.string()).take(pa.array(self.rss_dbm.indices))
        offsets = pa.array(self.rss_dbm.indptr, pa.int32())
        columns = [
            pa.DictionaryArray.from_arrays(pa.array(self.walk, pa.int32()), pa.array(self.walks, pa.string())),
            *(pa.array(column) for column in (self.time_s, *self.poses.T, self.sigma_m)),
            pa.array(self.map, pa.int32()),
            pa.ListArray.from_arrays(offsets, names),
            pa.ListArray.from_arrays(offsets, pa.array(self.rss_dbm.data, pa.float32())),
        ]
        facts = {"floors": self.floors, "georeference": self.georeference}
        metadata = {"radioslam_radio_map": str(FORMAT_VERSION), "radioslam_facts": json.dumps(facts)}
        with whole_file(path) as partial:
            pq.write_table(pa.Table.from_arrays(columns, schema=SCHEMA.with_metadata(metadata)), partial)

    @staticmethod
    def load(path: Path) -> RadioMap:
        """Read what ``save`` wrote.

        Raises:
            ResultError: no such file, not a radio map, cut short, or written by a newer version.
        """
        try:
            table = pq.read_table(path)
        except FileNotFoundError:
            raise ResultError(f"{path}: expected a radio map, found no such file") from None
        except (OSError, pa.ArrowException) as error:
            raise ResultError(f"{path}: expected a radio map (Parquet), found: {error}") from None
        version = (table.schema.metadata or {}).get(b"radioslam_radio_map", b"none").decode()
        if version not in READABLE_VERSIONS or table.schema.names != SCHEMA.names:
            raise ResultError(
                f"{path}: expected a radio map of version {FORMAT_VERSION}, found version {version}; "
                "update radioslam or map the walks again"
            )
        return _from_table(table)


def _from_table(table: pa.Table) -> RadioMap:
    column = {name: table[name].combine_chunks() for name in table.schema.names}
    walk = column["walk"]
    heard = column["transmitter"]
    names = heard.flatten().dictionary_encode()
    order = np.argsort(np.array(names.dictionary.to_pylist(), dtype=np.str_), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    indices = rank[names.indices.to_numpy(zero_copy_only=False).astype(np.int64)]
    data = column["rssi_dbm"].flatten().to_numpy(zero_copy_only=False).astype(np.float64)
    indptr = heard.offsets.to_numpy().astype(np.int64)
    facts = json.loads((table.schema.metadata or {}).get(b"radioslam_facts", b"{}"))
    return RadioMap(
        walks=tuple(walk.dictionary.to_pylist()),
        walk=walk.indices.to_numpy(zero_copy_only=False).astype(np.int64),
        time_s=column["time_s"].to_numpy(),
        poses=np.column_stack([column[name].to_numpy() for name in ("x_m", "y_m", "heading_rad")]),
        sigma_m=column["sigma_m"].to_numpy(),
        map=column["map"].to_numpy().astype(np.int64),
        rss_dbm=sparse.csr_array((data, indices, indptr - indptr[0]), shape=(len(table), len(order))),
        transmitters=tuple(names.dictionary[int(k)].as_py() for k in order),
        floors=tuple(facts.get("floors", ())),
        georeference=facts.get("georeference") and tuple(facts["georeference"]),
    )
