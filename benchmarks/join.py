"""The similarity join beside what else one could do, all in one process and one run, in processor seconds.

References: the plain Python double loop, SciPy's sparse product, ``sparse_dot_topn``, and ``textbook_join.cpp``, every
pair of std::map, compiled by g++ for the purpose. All find the same number of pairs, or the run stops.
"""

from __future__ import annotations

import itertools
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import sparse

from benchmarks.worlds import campus_scans, crowd_scans
from radioslam.similarity import similar_pairs, unit_rows

THRESHOLD = 0.8
WORLDS = {
    "748, campus": (campus_scans, 748),
    "3,000, campus": (campus_scans, 3_000),
    "10,000, campus": (campus_scans, 10_000),
    "100,000, campus": (campus_scans, 100_000),
    "300,000, campus": (campus_scans, 300_000),
    "30,000, crowd": (crowd_scans, 30_000),
}


@dataclass
class Row:
    """Processor seconds by method of one world, and its number of pairs."""

    world: str
    scans: int
    pairs: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


def scipys(strengths: sparse.csr_array) -> int:
    """Number of pairs by the product of blocks of rows with all, as memory for the whole would not do."""
    rows, count = unit_rows(strengths), 0
    columns = rows.T.tocsr()
    for k in range(0, rows.shape[0], 1024):
        products = (rows[k : k + 1024] @ columns).tocoo()
        count += int(np.sum((products.data >= THRESHOLD) & (products.row + k < products.col)))
    return count


def topns(strengths: sparse.csr_array) -> int:
    """Number of pairs by ``sparse_dot_topn``, told how many the fullest row has (it must be told something)."""
    from sparse_dot_topn import sp_matmul_topn

    rows = sparse.csr_matrix(unit_rows(strengths))
    most = topns.most  # type: ignore[attr-defined]
    found = sp_matmul_topn(rows, rows.T.tocsr(), top_n=most, threshold=THRESHOLD - 1e-12, sort=False).tocoo()
    return int(np.sum(found.row < found.col))


def plain(strengths: sparse.csr_array) -> int:
    """Number of pairs by the double loop over dictionaries."""
    csr = sparse.csr_array(strengths)
    ends = itertools.pairwise(csr.indptr.tolist())
    scans = [dict(zip(csr.indices[a:b].tolist(), csr.data[a:b].tolist(), strict=True)) for a, b in ends]
    lengths = [math.sqrt(sum(v * v for v in scan.values())) for scan in scans]
    count = 0
    for i, a in enumerate(scans):
        for j in range(i + 1, len(scans)):
            b = scans[j]
            product = sum(v * b[k] for k, v in a.items() if k in b)
            count += product >= THRESHOLD * lengths[i] * lengths[j]
    return count


def textbook(strengths: sparse.csr_array) -> tuple[int, float] | None:
    """Pairs and processor seconds of the C++ program's double loop; None without a compiler."""
    compiler = shutil.which("g++")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        program, readings = Path(folder) / "textbook", Path(folder) / "readings"
        source = Path(__file__).with_name("textbook_join.cpp")
        subprocess.run([compiler, "-O2", "-std=c++17", "-o", str(program), str(source)], check=True)
        entries = strengths.tocoo()
        with readings.open("w") as file:
            for scan, k, value in zip(entries.row.tolist(), entries.col.tolist(), entries.data.tolist(), strict=True):
                file.write(f"{scan} 02:00:00:{k >> 16:02x}:{k >> 8 & 255:02x}:{k & 255:02x} {value!r}\n")
        told = subprocess.run([program, readings, str(THRESHOLD)], check=True, text=True, stdout=subprocess.PIPE).stdout
    pairs, seconds = told.split()
    return int(pairs), float(seconds)


def timed(work: Callable[[], int], repeats: int) -> tuple[int, float]:
    """What it gives, and the best of some runs in processor seconds."""
    seconds, found = [], 0
    for _ in range(repeats):
        started = time.process_time()
        found = work()
        seconds.append(time.process_time() - started)
    return found, min(seconds)


def measure(world: str) -> Row:
    """All methods that end within a minute or so on one world."""
    make, n = WORLDS[world]
    strengths, row = make(n), Row(world, n)
    repeats = 9 if n <= 3_000 else 3 if n <= 10_000 else 1
    found = similar_pairs(strengths, THRESHOLD)  # warm
    row.pairs, row.seconds["ours"] = timed(lambda: len(similar_pairs(strengths, THRESHOLD)), repeats)
    topns.most = int(np.bincount(np.concatenate([found.i, found.j])).max()) + 1  # type: ignore[attr-defined]
    references: dict[str, Callable[[sparse.csr_array], int]] = {}
    if n <= 100_000 and make is campus_scans:
        references["SciPy"] = scipys
    references["sparse_dot_topn"] = topns
    if n <= 3_000:
        references["plain Python"] = plain
    for name, method in references.items():
        pairs, row.seconds[name] = timed(lambda method=method: method(strengths), 3 if n <= 3_000 else 1)
        _check(world, name, pairs, row.pairs)
    if n <= 3_000 and (told := textbook(strengths)) is not None:
        row.seconds["textbook C++"] = told[1]
        _check(world, "textbook C++", told[0], row.pairs)
    return row


def _check(world: str, name: str, found: int, expected: int) -> None:
    if found != expected:
        raise AssertionError(f"{world}: {name} finds {found} pairs, ours {expected}")


def table(rows: list[Row]) -> str:
    """Processor seconds, and in brackets the ratio to ours, as Markdown."""
    names = ("ours", "textbook C++", "plain Python", "SciPy", "sparse_dot_topn")
    lines = [f"| scans | pairs | {' | '.join(names)} |", f"|{'---|' * (len(names) + 2)}"]
    for row in rows:
        ours = row.seconds["ours"]
        cells = [f"{ours:.3g}"]
        for name in names[1:]:
            seconds = row.seconds.get(name)
            cells.append("–" if seconds is None else f"{seconds:.3g} ({seconds / ours:.3g})")
        lines.append(f"| {row.world} | {row.pairs:,} | {' | '.join(cells)} |")
    return "\n".join(lines)


def growth(scans: list[int], seconds: list[float]) -> float:
    """The power of n that seconds grow with."""
    return float(np.polyfit(np.log(scans), np.log(seconds), 1)[0])


def run() -> list[Row]:
    """Measure, print and return all worlds."""
    if shutil.which("g++") is None:
        print("join: no g++ here, the textbook C++ is left out")
    rows = []
    for world in WORLDS:
        rows.append(measure(world))
        print(table(rows[-1:]).splitlines()[-1], flush=True)
    campus = [row for row in rows if "campus" in row.world]
    for name in ("ours", "textbook C++", "SciPy", "sparse_dot_topn"):
        known = [row for row in campus if name in row.seconds]
        if len(known) > 1:
            power = growth([row.scans for row in known], [row.seconds[name] for row in known])
            print(f"join, campus: {name} grows as scans to the power of {power:.2f}")
    return rows


if __name__ == "__main__":
    run()
