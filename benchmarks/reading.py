"""How fast logs are read, in MB of uncompressed text per second on one core, beside a plain Python line loop."""

from __future__ import annotations

import gzip
import os
import time
from pathlib import Path

from radioslam.formats import find_logs, read_walk

REPOSITORY = Path(__file__).resolve().parent.parent
GOAL_MB_PER_S = 40.0
_VECTORS = ("TYPE_ACCELEROMETER", "TYPE_GYROSCOPE", "TYPE_MAGNETIC_FIELD", "TYPE_ROTATION_VECTOR")


def plain_loop(path: Path) -> int:
    """The reference: every line split, the numbers of the same records made floats, and kept in lists."""
    motion, scans = [], []
    with gzip.open(path, "rt", encoding="utf-8") as stream:
        for line in stream:
            fields = line.split("\t")
            if len(fields) < 2:
                continue
            if fields[1] in _VECTORS:
                motion.append((int(fields[0]) / 1e3, *(float(field) for field in fields[2:5])))
            elif fields[1] == "TYPE_WIFI":
                scans.append((int(fields[0]) / 1e3, fields[3], int(fields[4]), int(fields[6]) / 1e3))
    return len(motion) + len(scans)


def run() -> None:
    """Print MB/s for a floor of Indoor Location traces."""
    data = Path(os.environ.get("RADIOSLAM_DATA", REPOSITORY.parent / "shared" / "data"))
    folder = data / "indoor-location-20" / "site1" / "F1"
    if not folder.is_dir():
        print(f"reading: no recordings in {folder}; set RADIOSLAM_DATA to the folder of recordings")
        return
    logs = find_logs([folder])
    megabytes = sum(len(gzip.decompress(log.read_bytes())) for log in logs) / 1e6
    ours, plain = _rate(read_walk, logs, megabytes), _rate(plain_loop, logs, megabytes)
    print(f"reading {len(logs)} gzip traces, {megabytes:.0f} MB of text, one core")
    print(f"  read_walk          {ours:6.1f} MB/s   (goal {GOAL_MB_PER_S:g})")
    print(f"  plain Python loop  {plain:6.1f} MB/s   (no arrays, no checks)")
    print(f"  ratio              {ours / plain:6.1f}")


def _rate(read: object, logs: list[Path], megabytes: float, repeats: int = 3) -> float:
    """The best of a few runs, in MB/s of processor time, which other work on the machine hardly sways."""
    assert callable(read)
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        for log in logs:
            read(log)
        seconds.append(time.process_time() - start)
    return megabytes / min(seconds)


if __name__ == "__main__":
    run()
