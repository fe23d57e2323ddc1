"""The radio map: the optimized tracks annotated with what was heard at each place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from scipy import sparse

from radioslam.errors import ResultError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

FORMAT_VERSION = 1
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
    """

    walks: tuple[str, ...]
    walk: Integers
    time_s: Array
    poses: Array
    sigma_m: Array
    map: Integers
    rss_dbm: sparse.csr_array
    transmitters: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.walk)

    def save(self, path: Path) -> None:
        """Write Parquet, a row per sample; readings are the lists ``transmitter`` and ``rssi_dbm``."""
        names = pa.array(self.transmitters, pa.string()).take(pa.array(self.rss_dbm.indices))
        offsets = pa.array(self.rss_dbm.indptr, pa.int32())
        columns = [
            pa.DictionaryArray.from_arrays(pa.array(self.walk, pa.int32()), pa.array(self.walks, pa.string())),
            *(pa.array(column) for column in (self.time_s, *self.poses.T, self.sigma_m)),
            pa.array(self.map, pa.int32()),
            pa.ListArray.from_arrays(offsets, names),
            pa.ListArray.from_arrays(offsets, pa.array(self.rss_dbm.data, pa.float32())),
        ]
        metadata = {"radioslam_radio_map": str(FORMAT_VERSION)}
        pq.write_table(pa.Table.from_arrays(columns, schema=SCHEMA.with_metadata(metadata)), path)

    @staticmethod
    def load(path: Path) -> RadioMap:
        """Read what ``save`` wrote.

        Raises:
            ResultError: no such file, not a radio map, cut short, or written by a newer version.
        """
        try:
            table = pq.read_table(path)
        except (OSError, pa.ArrowException) as error:
            raise ResultError(f"{path}: expected a radio map (Parquet), found: {error}") from None
        version = (table.schema.metadata or {}).get(b"radioslam_radio_map", b"none").decode()
        if version != str(FORMAT_VERSION) or table.schema.names != SCHEMA.names:
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
    return RadioMap(
        walks=tuple(walk.dictionary.to_pylist()),
        walk=walk.indices.to_numpy(zero_copy_only=False).astype(np.int64),
        time_s=column["time_s"].to_numpy(),
        poses=np.column_stack([column[name].to_numpy() for name in ("x_m", "y_m", "heading_rad")]),
        sigma_m=column["sigma_m"].to_numpy(),
        map=column["map"].to_numpy().astype(np.int64),
        rss_dbm=sparse.csr_array((data, indices, indptr - indptr[0]), shape=(len(table), len(order))),
        transmitters=tuple(names.dictionary[int(k)].as_py() for k in order),
    )
