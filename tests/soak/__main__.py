"""Run the long trials and print what they measured; ``make soak``."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from radioslam.simulator import simulate
from tests.server.kills import survives
from tests.server.postgres import running_postgres
from tests.soak.growing import grow, table
from tests.soak.load import load, speed

KILLS = int(os.environ.get("RADIOSLAM_KILLS", "100"))
SPEED = 110 / (8 * KILLS)
"""Walks of 110 s last longer than the kills, at eight seconds from one to the next."""
MANGLED_EACH = "100"
"""Per operation, known and unknown names, and message; together more than 10,000 requests."""


def kills() -> None:
    """Random kills on SQLite and on PostgreSQL."""
    walks = simulate("office", seed=1, walks=6)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        urls = [f"sqlite:///{folder / one}" for one in ("killed.sqlite", "calm.sqlite")]
        print("SQLite:", survives(urls[0], urls[1], folder, walks, KILLS, seed=1, speed=SPEED), flush=True)
    with running_postgres() as cluster, tempfile.TemporaryDirectory() as name:
        if cluster is None:
            print("PostgreSQL: none here and none could be installed, skipped")
            return
        urls = [cluster.new_database(), cluster.new_database()]
        print("PostgreSQL:", survives(urls[0], urls[1], Path(name), walks, KILLS, seed=2, speed=SPEED), flush=True)


def mangled() -> None:
    """The suite's mangled requests, many times over."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "--tb=short",
        "--show-capture=no",
        "--timeout",
        "3600",
        "tests/server/test_mangled.py",
    ]
    subprocess.run(command, check=True, env={**os.environ, "RADIOSLAM_MANGLED": MANGLED_EACH})


def loaded() -> None:
    """300 phones for five minutes."""
    print(json.dumps(load(), indent=1), flush=True)


def fast() -> None:
    """Requests per second against an endpoint that only parses."""
    rows = np.array(speed())
    print("requests/s: service, bare; processor ms per request: service, bare")
    for row in rows:
        print(f"{row[0]:7.0f} {row[1]:7.0f} {row[2]:7.2f} {row[3]:7.2f}")
    for what, ratio in (("rate", rows[:, 0] / rows[:, 1]), ("processor time", rows[:, 2] / rows[:, 3])):
        print(f"ratio of {what}, service to bare: {ratio.mean():.2f} ± {ratio.std(ddof=1):.2f}", flush=True)


def growing() -> None:
    """Forty walks of an office that come one by one, a version after each."""
    for starts in ("common", "known", "unknown"):
        print(f"starts {starts}")
        print(table(grow(starts=starts)), flush=True)


TRIALS = {"kills": kills, "mangled": mangled, "load": loaded, "speed": fast, "growing": growing}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or TRIALS:
        print(f"== {chosen}", flush=True)
        TRIALS[chosen]()
