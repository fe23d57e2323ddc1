"""docs/performance.md and its figure: the join, the graph and the whole map, measured here and now.

``python -m benchmarks.performance``; part of ``make bench``.
"""

from __future__ import annotations

import contextlib
import io
import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks import growth, join, solver

REPOSITORY = Path(__file__).resolve().parent.parent
PAGE = REPOSITORY / "docs" / "performance.md"
FIGURE = REPOSITORY / "docs" / "images" / "cost-over-scans.png"
BEGIN, END = "<!-- measured: make bench -->", "<!-- end -->"


def machine() -> str:
    """Processor, load, versions."""
    names = ("numpy", "scipy", "qdldl", "sparse-dot-topn", "gtsam")
    found = [f"{name} {_version(name)}" for name in names]
    compiler = shutil.which("g++")
    if compiler:
        told = subprocess.run([compiler, "--version"], check=True, text=True, stdout=subprocess.PIPE).stdout
        found.append(told.splitlines()[0])
    threads = os.environ.get("OMP_NUM_THREADS", "as many as there are")
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    return (
        f"{_processor()}, {os.cpu_count()} cores, BLAS threads: {threads}; load when it began {load}; "
        f"Python {platform.python_version()}, {', '.join(found)}."
    )


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def powers(rows: list[join.Row]) -> str:
    """How each method's seconds grow on the campus."""
    campus = [row for row in rows if "campus" in row.world]
    parts = []
    for name in ("ours", "textbook C++", "SciPy", "sparse_dot_topn"):
        known = [row for row in campus if name in row.seconds]
        if len(known) > 1:
            power = join.growth([row.scans for row in known], [row.seconds[name] for row in known])
            parts.append(f"{name} n^{power:.2f}")
    return ", ".join(parts)


def save_figure(rows: list[join.Row], maps: list[dict[str, Any]]) -> None:
    """Seconds over scans, both on logarithmic axes: joins to the left, whole maps by stage to the right."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), sharey=True, layout="constrained")
    campus = [row for row in rows if "campus" in row.world]
    for name in ("ours", "textbook C++", "plain Python", "SciPy", "sparse_dot_topn"):
        known = [row for row in campus if name in row.seconds]
        style = {"linewidth": 2.5, "color": "black"} if name == "ours" else {}
        left.plot([r.scans for r in known], [r.seconds[name] for r in known], marker="o", label=name, **style)
    left.set(title="similarity join, campus", ylabel="processor seconds")
    for stage in maps[0]["seconds"]:
        right.plot([r["scans"] for r in maps], [r["seconds"][stage] + 1e-3 for r in maps], marker="o", label=stage)
    right.plot([r["scans"] for r in maps], [r["all_s"] for r in maps], "k-o", linewidth=2.5, label="whole map")
    right.set(title="whole map, 15 walks per building")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel="scans")
        axes.grid(alpha=0.3)
    left.legend(fontsize=8, loc="lower right")
    right.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(FIGURE, dpi=110)
    plt.close(figure)


def graphs() -> str:
    """What the solver's benchmark prints."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        solver.run()
    return told.getvalue().rstrip()


def run() -> None:
    """Measure everything and renew the page between its marks."""
    where = machine()
    rows, graph, warm, maps = join.run(), graphs(), growth.papers_scans(), growth.run()
    print(graph)
    measured = f"""{where}

### Join
Processor seconds, in brackets the ratio to ours; threshold {join.THRESHOLD}, 40 access points per scan.

{join.table(rows)}

Growth on the campus: {powers(rows)}.

### Graph
```
{graph}
```

### Whole map
{growth.table(maps)}

Training, loop closure, screening and optimization of the simulated campus' 748 scans, warm, without standard
deviations: {warm["paper"]:.3f} s with `paper`, {warm["default"]:.3f} s with `default`.
The goal is 0.1 s; the paper took 11.2 s."""
    before, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{measured}\n{END}{rest.partition(END)[2]}", "utf-8")
    save_figure(rows, maps)


if __name__ == "__main__":
    sys.exit(run())
