"""PCD, the Point Cloud Library's files (version 0.7), in its three encodings: ascii, binary, binary_compressed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError

Array = NDArray[np.float64]

_KINDS = {"F": "f", "I": "i", "U": "u"}


def read_pcd(path: Path) -> Array:
    """Points (n, 3); in organized clouds (HEIGHT above 1) NaN says that a pixel has no reading, and is left out.

    Raises:
        LogError: no PCD, cut off, or without x, y, z.
    """
    try:
        header, body = _split(path.read_bytes())
        names, dtype = _fields(header)
        count = int(header["POINTS"][0]) if "POINTS" in header else int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
        columns = _DECODERS[header["DATA"][0]](body, dtype, count)
        points = np.column_stack([columns[names.index(axis)] for axis in "xyz"]).astype(float)
    except (KeyError, ValueError, IndexError) as error:
        raise LogError(path, "a PCD file with fields x y z", f"one that is broken ({error})") from None
    organized = int(header.get("HEIGHT", ["1"])[0]) > 1
    return points[~np.isnan(points).all(axis=1)] if organized else points


def write_pcd(path: Path, points: Array) -> None:
    """Write points (n, 3) in binary, 32 bits per coordinate."""
    fields = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    header = f"{fields}WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
    path.write_bytes(header.encode("ascii") + points.astype("<f4").tobytes())


def _split(data: bytes) -> tuple[dict[str, list[str]], bytes]:
    """The header's lines by their first word, and what follows the line DATA."""
    header: dict[str, list[str]] = {}
    while "DATA" not in header:
        line, newline, data = data.partition(b"\n")
        words = line.decode("ascii").split()
        if not newline:
            raise ValueError("no DATA line")
        if words and not words[0].startswith("#"):
            header[words[0]] = words[1:]
    return header, data


def _fields(header: dict[str, list[str]]) -> tuple[list[str], np.dtype[np.void]]:
    """The first column of each field, and the record of one point."""
    names, counts = header["FIELDS"], header.get("COUNT", ["1"] * len(header["FIELDS"]))
    kinds = [_KINDS[kind] + size for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    # Padding may bear one name ("_") many times: fields are told apart by number.
    record = [(f"f{k}", f"<{kind}", (int(n),)) for k, (kind, n) in enumerate(zip(kinds, counts, strict=True))]
    return names, np.dtype(record)


def _ascii(body: bytes, dtype: np.dtype[np.void], count: int) -> list[Array]:
    widths = [dtype[k].shape[0] for k in range(len(dtype.names or ()))]
    numbers = np.array(body.split(), dtype=float).reshape(-1, sum(widths))
    if len(numbers) != count:
        raise ValueError(f"{len(numbers)} points instead of {count}")
    starts = np.concatenate([[0], np.cumsum(widths)[:-1]])
    return [numbers[:, start] for start in starts]


def _binary(body: bytes, dtype: np.dtype[np.void], count: int) -> list[Array]:
    records = np.frombuffer(body, dtype, count)
    return [records[name][:, 0] for name in dtype.names or ()]


def _compressed(body: bytes, dtype: np.dtype[np.void], count: int) -> list[Array]:
    """Two sizes, then LZF of the fields one after the other instead of point after point."""
    packed, unpacked = (int(size) for size in np.frombuffer(body, "<u4", 2))
    data = lzf_decompress(body[8 : 8 + packed], unpacked)
    columns, start = [], 0
    for k in range(len(dtype.names or ())):
        base, width = dtype[k].base, dtype[k].shape[0]
        columns.append(np.frombuffer(data, base, count * width, start).reshape(count, width)[:, 0])
        start += count * width * base.itemsize
    return columns


def lzf_decompress(data: bytes, size: int) -> bytes:
    """Unpack Marc Lehmann's LZF: runs of literals, and copies of what stands a little before.

    A control byte c below 32 is followed by c + 1 literals. Else its upper three bits are the length less 2 (7: the
    next byte is added), its lower five and the next byte the distance less 1.

    Raises:
        ValueError: the data are cut off, or do not give ``size`` bytes.
    """
    out, at = bytearray(), 0
    try:
        while at < len(data):
            control = data[at]
            at += 1
            if control < 32:
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            back = ((control & 31) << 8) + data[at] + 1
            at += 1
            start, length = len(out) - back, length + 2
            if start < 0:
                raise ValueError("a copy from before the beginning")
            piece = out[start : start + length]
            out += (piece * (length // len(piece) + 1))[:length]  # a copy may overlap what it writes
    except IndexError:
        raise ValueError("compressed data are cut off") from None
    if len(out) != size:
        raise ValueError(f"{len(out)} unpacked bytes instead of {size}")
    return bytes(out)


_DECODERS: dict[str, Callable[[bytes, np.dtype[np.void], int], list[Array]]] = {
    "ascii": _ascii,
    "binary": _binary,
    "binary_compressed": _compressed,
}
