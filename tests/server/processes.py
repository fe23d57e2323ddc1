"""A real server process on a real socket, that can be killed and started again on the same port."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0


class ServerProcess:
    """``radioslam serve`` in a process of its own; open to everybody on loopback, or asked with a new admin's key."""

    def __init__(self, data: Path, database: str | None = None, *options: str, keyed: bool = False) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.data = data
        self.key = self.new_key("admin") if keyed else None
        self.options = [*(("--database", database) if database else ()), *options]
        self.process: subprocess.Popen[bytes] | None = None
        self.log = data.parent / f"{data.name}.log"

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def __enter__(self) -> ServerProcess:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def new_key(self, role: str) -> str:
        command = [sys.executable, "-m", "radioslam", "keys", "add", role, "--role", role, "--data", str(self.data)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def start(self) -> None:
        access = () if self.key else ("--open",)
        command = [sys.executable, "-m", "radioslam", "serve", *access, "--data", str(self.data)]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                [*command, "--port", str(self.port), *self.options], stdout=log, stderr=log, env=environment
            )
        self.wait_for(lambda: self.ask("/health")[0] in (200, 503), "an answer")

    def stop(self) -> None:
        if self.process is not None:
            self.process.terminate()
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.kill()

    def kill(self) -> None:
        """As ``kill -9`` does."""
        assert self.process is not None
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def ask(self, path: str, body: Any = None, method: str | None = None, timeout_s: float = 30.0) -> tuple[int, Any]:
        """Status and JSON; status 0 where nobody answers."""
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json", **({"X-API-Key": self.key} if self.key else {})}
        request = urllib.request.Request(self.url + path, data, headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=timeout_s) as response:
                return response.status, json.loads(response.read() or b"null")
        except urllib.error.HTTPError as error:
            with error:
                return error.code, json.loads(error.read() or b"null")
        except (urllib.error.URLError, OSError):
            return 0, None

    def wait_for(self, true: Any, what: str, patience_s: float = PATIENCE_S) -> None:
        until_s = time.monotonic() + patience_s
        while not true():
            if time.monotonic() > until_s:
                raise AssertionError(f"expected {what} within {patience_s} s; log: {self.log.read_text()[-2000:]}")
            time.sleep(0.1)

    def wait_for_map(self, site: str, version: int = 1) -> None:
        """Until the site has this version of its map."""
        self.wait_for(lambda: (self.ask(f"/sites/{site}")[1]["map_version"] or 0) >= version, f"map {version}")

    def workers(self) -> list[int]:
        """Processes that the server started."""
        assert self.process is not None
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        found = [int(pid) for pid in children]
        return [pid for pid in found if b"radioslam.server.worker" in Path(f"/proc/{pid}/cmdline").read_bytes()]

    def memory_mb(self) -> float:
        """Resident memory of the server without its worker."""
        assert self.process is not None
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1]) / 1024
