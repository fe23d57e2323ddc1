"""``make bench``: speed as ratios to named references, each measured in the same run."""

import platform

from benchmarks import crowd, point_clouds, positioning, reading, solver

print(f"Python {platform.python_version()} on {platform.machine()}")
for benchmark in (reading, solver, crowd, positioning, point_clouds):
    benchmark.run()
