"""Records by the names of their fields, from CSV with quotes or from JSON objects, with the line of each."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import LogError
from radioslam.formats.lines import Lines, split_lines
from radioslam.formats.loading import shown

Array = NDArray[np.float64]

_JSON_SPACE = " \t\r\n"


@dataclass(frozen=True)
class Records:
    """n records: ``cells`` by field as text, "" where one lacks it, and ``lines``, without text, to name them."""

    lines: Lines
    cells: Mapping[str, Sequence[str]]

    def __len__(self) -> int:
        return len(self.lines)

    def has(self, *names: str) -> bool:
        """Whether there are records with all these fields."""
        return len(self) > 0 and all(name in self.cells for name in names)

    def take(self, keep: NDArray[np.bool_]) -> Records:
        """The records that a mask (n,) picks."""
        rows = np.flatnonzero(keep)
        chosen = rows.tolist()
        return Records(self.lines.take(rows), {name: [of[k] for k in chosen] for name, of in self.cells.items()})

    def text(self, name: str) -> list[str]:
        """A field (n,) as it stands, stripped."""
        return [cell.strip() for cell in self.cells.get(name, [""] * len(self))]

    def numbers(self, name: str, *, blank: bool = False) -> Array:
        """A field (n,) as finite numbers; NaN where it is blank, if it may be, or where no record has it.

        Raises:
            LogError: a cell is no finite number; it names the line.
        """
        if name not in self.cells and blank:
            return np.full(len(self), np.nan)
        cells = self.text(name)
        try:
            values = np.array([float(cell) if cell or not blank else math.nan for cell in cells])
        except ValueError:
            values = np.array([_number(cell) if cell or not blank else math.nan for cell in cells])
        wrong = ~np.isfinite(values) & np.array([bool(cell) or not blank for cell in cells], dtype=bool)
        wrong |= np.array(["_" in cell for cell in cells], dtype=bool)
        if wrong.any():
            index = int(wrong.argmax())
            raise self.lines.error(index, f"a finite number as {name}", shown(cells[index]), "mend or remove the line")
        return values


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def from_csv(path: Path, data: bytes, first_line: int = 1, comment: str = "") -> Records:
    """Records of a CSV whose first line names the columns; names are lower case, cells may be quoted.

    Args:
        path: for messages.
        data: the text.
        first_line: the number of its first line in the file.
        comment: lines that begin so are passed over, "" for none.

    Raises:
        LogError: quotes that do not close, two columns of one name, or a row with fewer columns than the header.
    """
    lines = [line.decode("utf-8", "replace") for line in split_lines(data)]
    reader = csv.reader((f"{line}\n" for line in lines), strict=True)
    header: list[str] = []
    found = Lines(path)
    rows: list[list[str]] = []
    try:
        for row in reader:
            number = first_line + reader.line_num - 1
            if not any(map(str.strip, row)) or (comment and row[0].startswith(comment)):
                continue
            if not header:
                header = _header(path, row, number)
            else:
                rows.append(_row(path, row, header, number))
                found.add(b"", number)
    except csv.Error as error:
        place = first_line + max(reader.line_num, 1) - 1
        raise LogError(path, "CSV with cells in whole quotes", str(error), "mend the line", place) from None
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(header)
    return Records(found, dict(zip(header, columns, strict=True)))


def _header(path: Path, row: list[str], number: int) -> list[str]:
    names = [name.strip().lower() for name in row]
    named = [name for name in names if name]
    if len(set(named)) < len(named):
        raise LogError(path, "column names, each once", shown(",".join(row)), "rename one of them", number)
    return [name or f"unnamed {k}" for k, name in enumerate(names)]


def _row(path: Path, row: list[str], header: list[str], number: int) -> list[str]:
    if len(row) < len(header) or any(map(str.strip, row[len(header) :])):
        found = f"{len(row)} columns in {shown(','.join(row))}"
        raise LogError(path, f"{len(header)} columns as the header has", found, "mend or remove the line", number)
    return row[: len(header)]


def from_objects(path: Path, objects: Sequence[Mapping[str, Any]], numbers: Sequence[int]) -> Records:
    """Records of JSON objects, with the line number of each; names are lower case, null is blank."""
    lowered = [{str(name).lower(): value for name, value in one.items()} for one in objects]
    names = dict.fromkeys(name for one in lowered for name in one)
    cells = {name: [_cell(one.get(name)) for one in lowered] for name in names}
    return Records(Lines(path, [b""] * len(objects), list(numbers)), cells)


def _cell(value: object) -> str:
    return "" if value is None else str(value)


def json_documents(path: Path, data: bytes) -> Iterator[tuple[Any, int]]:
    """JSON values that follow each other, one a line or spread over many, each with the line that it begins in.

    Raises:
        LogError: what stands there is no JSON, or not UTF-8.
    """
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        raise LogError(path, "UTF-8 text", "other bytes", "save as UTF-8", line) from None
    decoder, at, line = json.JSONDecoder(), _next_word(text, 0), 1
    line += text.count("\n", 0, at)
    while at < len(text):
        try:
            value, end = decoder.raw_decode(text, at)
        except json.JSONDecodeError as error:
            found, advice = shown(text[max(at, error.pos - 20) : error.pos + 40]), "the log is cut or damaged there"
            raise LogError(path, "JSON", found, advice, error.lineno) from None
        except (ValueError, RecursionError):
            found, advice = "numbers or brackets beyond all measure", "remove the line"
            raise LogError(path, "JSON", found, advice, line) from None
        yield value, line
        start, at = at, _next_word(text, end)
        line += text.count("\n", start, at)


def _next_word(text: str, at: int) -> int:
    while at < len(text) and text[at] in _JSON_SPACE:
        at += 1
    return at
