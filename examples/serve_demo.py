"""Start the service and let a simulated crowd walk through it: ``python -m examples.serve_demo FOLDER PORT``."""

from __future__ import annotations

import subprocess
import sys
import time
import urllib.request
from pathlib import Path

SPEED = 5
START_S = 60


def main(folder: Path, port: int) -> None:
    """Until the server ends, or Ctrl-C."""
    url = f"http://127.0.0.1:{port}"
    radioslam = [sys.executable, "-m", "radioslam"]
    options = ["--open", "--data", str(folder / "data"), "--port", str(port), "--map-every", "3"]
    server = subprocess.Popen([*radioslam, "serve", *options])
    try:
        _wait_for(url, server)
        print(f"watch it at {url}  (health: {url}/health, the map: {url}/sites/office/maps/latest)", flush=True)
        walks = [str(folder / "walks"), "--to", url, "--site", "office", "--starts", "common", "--speed", str(SPEED)]
        subprocess.run([*radioslam, "replay", *walks], check=True)
        print(f"the crowd is through; the service goes on at {url}, Ctrl-C ends it", flush=True)
        server.wait()
    except KeyboardInterrupt:
        pass
    finally:
        server.terminate()
        server.wait()


def _wait_for(url: str, server: subprocess.Popen[bytes]) -> None:
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s and server.poll() is None:
        try:
            urllib.request.urlopen(f"{url}/health", timeout=5).close()
            return
        except OSError:
            time.sleep(0.2)
    sys.exit("the service did not start; its message stands above")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
