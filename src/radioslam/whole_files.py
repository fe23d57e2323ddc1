"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from radioslam.errors import ResultError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A file of the same ending to write, which takes the place of ``path`` only when the block ends well.

    Raises:
        ResultError: the disk refuses.
    """
    partial: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.absolute().parent)
        os.close(handle)
        partial = Path(name)
        yield partial
        partial.chmod(0o644)
        partial.replace(path)
    except OSError as error:
        raise ResultError(f"{path}: could not be written: {error.strerror or error}; nothing was changed") from None
    finally:
        if partial is not None:
            partial.unlink(missing_ok=True)
