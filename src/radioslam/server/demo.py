"""A service with a simulated crowd walking through it."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import httpx2

from radioslam.errors import UnavailableError
from radioslam.server.replay import Replay
from radioslam.simulator import simulate

BUILDING, SITE = "office", "office"
START_S = 60.0
MAP_EVERY_S = 3.0


def run_demo(data: Path, port: int, walks: int, speed: float, stay: bool, tell: Callable[[str], None]) -> None:
    """Serve, open on loopback, and replay; then ``stay`` until the service ends, or end it.

    Raises:
        UnavailableError: the service does not start.
    """
    url = f"http://127.0.0.1:{port}"
    command = [sys.executable, "-m", "radioslam", "serve", "--open", "--data", str(data), "--port", str(port)]
    server = subprocess.Popen([*command, "--map-every", str(MAP_EVERY_S)])
    try:
        _wait_for(url, server)
        tell(f"watch it at {url}; health: {url}/health; the map: {url}/sites/{SITE}/maps/latest")
        Replay(url, SITE, "common", speed).run(simulate(BUILDING, seed=1, walks=walks))
        tell("the crowd is through" + ("; the service goes on until Ctrl-C" if stay else ""))
        if stay:
            server.wait()
    finally:
        server.terminate()
        server.wait()


def _wait_for(url: str, server: subprocess.Popen[bytes]) -> None:
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s and server.poll() is None:
        try:
            httpx2.get(f"{url}/health", timeout=5)
            return
        except httpx2.TransportError:
            time.sleep(0.2)
    raise UnavailableError(f"expected the service to start at {url}, found it does not; is the port free?")
