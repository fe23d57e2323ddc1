"""WiFine CSV: a scan per row at a known position, from anonymous access points; no motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from radioslam.errors import LogError
from radioslam.formats.lines import Layout, Lines, parse, split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.streams import make_reference, make_scans
from radioslam.walk import Walk

NOT_HEARD_DBM = -100.0
_KNOWN_COLUMNS = ("timestamp", "x", "y", "floorID")


def sniff(head: bytes) -> bool:
    """Whether the first line is the header of such a file."""
    return head.startswith(b"0,1,2,") or b"num_visible_APs" in head


def read(path: Path) -> Walk:
    """Read a file.

    Raises:
        LogError: it is damaged; the message names the line.
    """
    layout, lines = _layout_and_rows(path, split_lines(load(path)))
    table = parse(lines, layout)
    rss = table.numbers[:, len(_KNOWN_COLUMNS) :]
    time_s, x, y, floors = table.numbers[:, : len(_KNOWN_COLUMNS)].T
    row, access_point = np.nonzero(rss != NOT_HEARD_DBM)
    readings = Lines(path, [], [lines.number[i] for i in row])
    identity = [f"ap{layout.numbers[len(_KNOWN_COLUMNS) + column]}" for column in access_point]
    notes: list[str] = []
    return Walk(
        name=walk_name(path),
        wifi=make_scans(readings, time_s[row], identity, rss[row, access_point]),
        reference=make_reference(lines, time_s, np.column_stack([x, y]), notes),
        floor=f"{floors[0]:g}",
        path=path,
        notes=tuple(notes),
    )


def _layout_and_rows(path: Path, text: list[bytes]) -> tuple[Layout, Lines]:
    columns = tuple(name.strip() for name in text[0].decode("utf-8", "replace").split(","))
    access_points = tuple(name for name in columns if name.isdecimal())
    missing = [name for name in _KNOWN_COLUMNS if name not in columns]
    if missing or not access_points or len(set(columns)) < len(columns):
        expected = f"a header 0,1,…,num_visible_APs,{','.join(_KNOWN_COLUMNS)}"
        raise LogError(path, expected, shown(text[0]), "separate the columns by ','", 1)
    lines = Lines(path)
    for number, line in enumerate(text[1:], start=2):
        if line.strip():
            lines.add(line, number)
    if not len(lines):
        raise LogError(path, "a row per scan", "the header alone", "leave the file out")
    return Layout(columns, (*_KNOWN_COLUMNS, *access_points), separator=","), lines
