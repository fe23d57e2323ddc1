"""What a whole map costs as the crowd grows: processor seconds per stage and peak memory, a process per size.

Walks of 333 scans in a campus that grows with them, 15 walks per building, known starts, preset ``default``.
``python -m benchmarks.growth 300`` measures one size and prints it as JSON.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.worlds import campus_walks
from radioslam.config import load_config
from radioslam.evaluation import evaluate
from radioslam.simulator import simulate
from radioslam.slam import map_walks

SIZES = (15, 60, 300)
WALKS_PER_BUILDING = 15


class ProcessorClock:
    """Processor seconds between the steps that ``map_walks`` tells of."""

    def __init__(self) -> None:
        self.step, self.seconds, self.since = "", dict[str, float](), time.process_time()

    def __call__(self, step: str) -> None:
        now = time.process_time()
        if self.step:
            self.seconds[self.step] = self.seconds.get(self.step, 0.0) + now - self.since
        self.step, self.since = step, now


def measure(walks: int) -> dict[str, Any]:
    """One size, in this process."""
    crowd = list(campus_walks(walks, max(1, walks // WALKS_PER_BUILDING)))
    config, clock = load_config("default", overrides=["merging.starts=known"], environment={}), ProcessorClock()
    result = map_walks(crowd, config, clock)
    clock("")
    errors = evaluate(result).total.errors
    return {
        "walks": walks,
        "scans": len(result.radio_map),
        "seconds": clock.seconds,
        "all_s": sum(clock.seconds.values()),
        "candidates": len(result.loops.pairs),
        "loops": len(result.loops.kept),
        "odometry_m": errors["odometry"].mean,
        "estimate_m": errors["estimate"].mean,
        "converged": result.solver.converged,
        "peak_mb": peak_mb(),
    }


def peak_mb() -> float:
    """Greatest resident memory of this process; what ``getrusage`` says begins with that of the parent."""
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024


def papers_scans() -> dict[str, float]:
    """Warm processor seconds by preset: training, loop closure, screening and optimization of the campus' 748 scans."""
    walks, seconds = simulate("campus", seed=1), {}
    stages = ("uncertainty model", "loop candidates", "screening", "optimization")
    for preset in ("paper", "default"):
        config = load_config(preset, overrides=["optimizer.standard_deviations=false"], environment={})
        runs = []
        for _ in range(5):
            clock = ProcessorClock()
            map_walks(walks, config, clock)
            clock("")
            runs.append(sum(clock.seconds[stage] for stage in stages))
        seconds[preset] = min(runs)
    return seconds


def table(rows: list[dict[str, Any]]) -> str:
    """Processor seconds per stage as Markdown."""
    stages = list(rows[0]["seconds"])
    head = ["walks", "scans", *stages, "all", "candidates", "loops", "odometry m", "estimate m", "peak MB"]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for row in rows:
        cells = [f"{row['walks']}", f"{row['scans']:,}", *(f"{row['seconds'][s]:.2f}" for s in stages)]
        cells += [f"{row['all_s']:.1f}", f"{row['candidates']:,}", f"{row['loops']:,}"]
        cells += [f"{row['odometry_m']:.2f}", f"{row['estimate_m']:.2f}", f"{row['peak_mb']:.0f}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def run(sizes: tuple[int, ...] = SIZES) -> list[dict[str, Any]]:
    """Measure, print and return all sizes."""
    rows = []
    for walks in sizes:
        command = [sys.executable, "-m", "benchmarks.growth", str(walks)]
        rows.append(json.loads(subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE).stdout))
        print(table(rows[-1:]).splitlines()[-1], flush=True)
    return rows


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
