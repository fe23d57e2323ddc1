"""Lines of a log -> arrays, fast; and when that fails, slowly, to name the line that is wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from radioslam.errors import LogError
from radioslam.formats.loading import shown

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lines:
    """Lines of one kind: their bytes without line end, and their numbers in the file (1-based)."""

    path: Path
    text: list[bytes] = field(default_factory=list)
    number: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.text)

    def add(self, text: bytes, number: int) -> None:
        """Append a line."""
        self.text.append(text)
        self.number.append(number)

    def take(self, indices: NDArray[np.integer]) -> Lines:
        """Only these lines."""
        chosen = indices.tolist()
        return Lines(self.path, [self.text[i] for i in chosen], [self.number[i] for i in chosen])

    def error(self, index: int, expected: str, found: str, advice: str = "") -> LogError:
        """The error that names this line."""
        return LogError(self.path, expected, found, advice, self.number[index])


@dataclass(frozen=True)
class Layout:
    """How the lines of one kind are laid out.

    Attributes:
        columns: names of all columns, as the messages show them.
        numbers: names of those to be read as finite numbers.
        text: the one to be read as text (strict UTF-8), "" for none.
        separator: one character.
        blank: columns of ``numbers`` that may be empty (then NaN).
        optional: how many of the last columns a line may lack.
        free: the column that may itself contain the separator, "" for none.
    """

    columns: tuple[str, ...]
    numbers: tuple[str, ...]
    text: str = ""
    separator: str = "\t"
    blank: frozenset[str] = frozenset()
    optional: int = 0
    free: str = ""

    @property
    def title(self) -> str:
        """The line as a message shows it."""
        shown_separator = {"\t": " <tab> "}.get(self.separator, self.separator)
        head, tail = self.columns[:8], self.columns[8:]
        return shown_separator.join((*head, "…", tail[-1]) if len(tail) > 4 else self.columns)


@dataclass(frozen=True)
class Table:
    """``numbers`` (n, k) in the order of the layout's ``numbers``; ``text`` (n,) or empty."""

    numbers: Array
    text: list[str]

    def column(self, index: int) -> Array:
        """One column of numbers, (n,)."""
        column: Array = self.numbers[:, index]
        return column


def parse(lines: Lines, layout: Layout) -> Table:
    """Read the lines.

    Raises:
        LogError: a line has other columns, or a number is none or not finite; it names the first such line.
    """
    if not len(lines):
        return Table(np.empty((0, len(layout.numbers))), [])
    return _parse_fast(lines, layout) or _parse_carefully(lines, layout)


def split_lines(data: bytes) -> list[bytes]:
    """The lines of a text, without their ends."""
    return [line.rstrip(b"\r") for line in data.split(b"\n")]


def _parse_fast(lines: Lines, layout: Layout) -> Table | None:
    """All lines at once with the CSV reader of Arrow, or None where it balks or a number is not finite."""
    types = dict.fromkeys(layout.numbers, pa.float64()) | ({layout.text: pa.string()} if layout.text else {})
    try:
        table = csv.read_csv(
            pa.BufferReader(b"\n".join(lines.text) + b"\n"),
            csv.ReadOptions(use_threads=False, column_names=layout.columns),
            csv.ParseOptions(delimiter=layout.separator, quote_char=False),
            csv.ConvertOptions(column_types=types, include_columns=list(types), null_values=[""]),
        )
    except (pa.ArrowException, ValueError, KeyError):
        return None
    if table.num_rows != len(lines):
        return None
    numbers = np.stack([table[name].to_numpy() for name in layout.numbers], axis=1)
    text = table[layout.text].to_pylist() if layout.text else []
    doubtful = [i for i, name in enumerate(layout.numbers) if name not in layout.blank]
    blanks = sum(table[name].null_count for name in layout.numbers)
    if np.isnan(numbers).sum() != blanks or np.isinf(numbers).any():
        return None
    if not np.isfinite(numbers[:, doubtful]).all() or "" in text:
        return None
    return Table(numbers, text)


def _parse_carefully(lines: Lines, layout: Layout) -> Table:
    numbers = np.empty((len(lines), len(layout.numbers)))
    texts = []
    for index in range(len(lines)):
        fields = _split(lines, index, layout)
        for column, name in enumerate(layout.numbers):
            numbers[index, column] = _number(lines, index, fields[name], name in layout.blank, name)
        if layout.text:
            texts.append(_text(lines, index, fields[layout.text], layout.text))
    return Table(numbers, texts)


def _split(lines: Lines, index: int, layout: Layout) -> dict[str, bytes]:
    """The fields of a line by name; the free column takes what is too much."""
    separator = layout.separator.encode()
    fields, columns = lines.text[index].split(separator), layout.columns
    surplus = len(fields) - len(columns)
    if layout.free and surplus > 0:
        at = columns.index(layout.free)
        fields[at : at + surplus + 1] = [separator.join(fields[at : at + surplus + 1])]
    elif surplus > 0 or -surplus > layout.optional:
        found = f"{len(fields)} columns in {shown(lines.text[index])}"
        advice = "the line is cut short or the separator is another" if surplus < 0 else "mend the line"
        raise lines.error(index, f"{len(columns)} columns {layout.title}", found, advice)
    return dict(zip(columns, fields, strict=False))


def _number(lines: Lines, index: int, field_text: bytes, may_be_blank: bool, name: str) -> float:
    if may_be_blank and not field_text.strip():
        return math.nan
    try:
        value = float(field_text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or b"_" in field_text:
        raise lines.error(index, f"a finite number as {name}", shown(field_text), "mend or remove the line")
    return value


def _text(lines: Lines, index: int, field_text: bytes, name: str) -> str:
    try:
        text = field_text.decode()
    except UnicodeDecodeError:
        raise lines.error(index, f"UTF-8 text as {name}", shown(field_text), "save as UTF-8") from None
    if not text.strip():
        raise lines.error(index, f"text as {name}", "nothing", "mend or remove the line")
    return text.strip()
