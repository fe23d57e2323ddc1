"""Named arrays as Parquet in a folder anywhere that fsspec reaches: a disk that all machines see, S3 and its like."""

from __future__ import annotations

import io
import json
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from radioslam.errors import ResultError

Arrays = dict[str, NDArray[Any]]


class ObjectStore:
    """A folder of named sets of arrays, each written whole or not at all.

    ``url`` is a path, or what fsspec knows: ``s3://bucket/folder``, ``memory://folder``.
    """

    def __init__(self, url: str) -> None:
        import fsspec

        self.url = url
        self.files, self.root = fsspec.core.url_to_fs(url)

    def write(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> str:
        """Keep arrays of any shapes under a name, which is returned."""
        columns = {key: pa.array([array.ravel()]) for key, array in arrays.items()}
        shapes = json.dumps({key: array.shape for key, array in arrays.items()})
        file = io.BytesIO()
        pq.write_table(pa.table(columns).replace_schema_metadata({"shapes": shapes}), file)
        partial = self._path(f".{uuid.uuid4().hex}")
        self.files.makedirs(self.root, exist_ok=True)
        self.files.pipe_file(partial, file.getvalue())
        self.files.mv(partial, self._path(name))
        return name

    def read(self, name: str) -> Arrays:
        """The arrays of a name.

        Raises:
            ResultError: no such name, or not whole.
        """
        try:
            table = pq.read_table(io.BytesIO(self.files.cat_file(self._path(name))))
            shapes = json.loads(table.schema.metadata[b"shapes"])
            flat = {key: table[key].combine_chunks().flatten().to_numpy(zero_copy_only=False) for key in shapes}
        except (OSError, KeyError, ValueError, pa.ArrowException) as error:
            raise ResultError(f"{self.url}: expected the arrays {name!r}, found: {error}") from None
        return {key: array.reshape(shapes[key]) for key, array in flat.items()}

    def remove(self, *names: str) -> None:
        """Forget names."""
        for name in names:
            self.files.rm_file(self._path(name))

    def put_folder(self, folder: Path, name: str) -> None:
        """Copy a folder here; it takes the place of one of that name once it is whole."""
        partial, target = (f"{self.root}/{part}" for part in (f".{uuid.uuid4().hex}", name))
        self.files.makedirs(self.root, exist_ok=True)
        self.files.put(f"{folder}/", f"{partial}/", recursive=True)
        if self.files.exists(target):
            self.files.rm(target, recursive=True)
        self.files.mv(partial, target, recursive=True)

    def _path(self, name: str) -> str:
        return f"{self.root}/{name}.parquet"
