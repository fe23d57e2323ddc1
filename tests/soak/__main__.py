"""Run the long trials and print what they measured; ``make soak``."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from radioslam.simulator import simulate
from tests.server.postgres import running_postgres
from tests.soak.load import speed

KILLS = int(os.environ.get("RADIOSLAM_KILLS", "100"))
MANGLED_EACH = "100"
"""Per operation, known and unknown names, and message; together more than 10,000 requests."""


def kills() -> None:
    """Random kills on SQLite and on PostgreSQL."""
    simulate("office", seed=1, walks=6)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        [f"sqlite:///{folder / one}" for one in ("killed.sqlite", "calm.sqlite")]
    with running_postgres() as cluster, tempfile.TemporaryDirectory() as name:
        if cluster is None:
            return
        [cluster.new_database(), cluster.new_database()]


def mangled() -> None:
    """The suite's mangled requests, many times over."""
    command = [sys.executable, "-m", "pytest", "-q", "--timeout", "3600", "tests/server/test_mangled.py"]
    subprocess.run(command, check=True, env={**os.environ, "RADIOSLAM_MANGLED": MANGLED_EACH})


def loaded() -> None:
    """300 phones for five minutes."""


def fast() -> None:
    """Requests per second against an endpoint that only parses."""
    rows = np.array(speed())
    for _row in rows:
        pass
    for _what, _ratio in (("rate", rows[:, 0] / rows[:, 1]), ("processor time", rows[:, 2] / rows[:, 3])):
        pass


TRIALS = {"kills": kills, "mangled": mangled, "load": loaded, "speed": fast}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or TRIALS:
        TRIALS[chosen]()
