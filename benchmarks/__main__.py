"""``make bench``: speed as ratios to named references, each measured in the same run."""

import platform

from benchmarks import crowd, performance, point_clouds, positioning, reading

print(f"Python {platform.python_version()} on {platform.machine()}")
for benchmark in (reading, performance, crowd, positioning, point_clouds):
    benchmark.run()
