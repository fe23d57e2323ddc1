"""Programs of Debian's packages that tests need, installed where there are none and we may."""

from __future__ import annotations

import os
import shutil
import subprocess


def install(*packages: str) -> bool:
    """Whether apt could install them; it needs root and a mirror that answers."""
    if shutil.which("apt-get") is None or os.geteuid() != 0:
        return False
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    steps = (["update"], ["install", "-y", "--no-install-recommends", *packages])
    commands = (["apt-get", "-q", *step] for step in steps)
    run = (subprocess.run(c, env=environment, capture_output=True, timeout=900, check=False) for c in commands)
    return all(done.returncode == 0 for done in run)
