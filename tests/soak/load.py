"""300 phones at real rates beside the map worker; and how fast the service is against an endpoint that only parses."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from radioslam.server.replay import Replay, batches
from tests.server.processes import ServerProcess
from tests.soak.crowd import heavy_walks

CLIENTS = 64
BARE = """
import sys, uvicorn
from fastapi import FastAPI
from radioslam.server.messages import Batch
app = FastAPI()

@app.post("/sites/{site_id}/walks/{name}/batches")
async def parse(site_id: str, name: str, batch: Batch) -> dict[str, int]:
    return {"sequence": batch.sequence}

uvicorn.run(app, port=int(sys.argv[1]), access_log=False, log_level="error")
"""


def load(phones: int = 300, seconds: float = 300.0, database: str | None = None) -> dict[str, object]:
    """Replay the phones; delays, memory over time and what the worker did meanwhile."""
    walks = heavy_walks(phones, seconds, seed=1)
    memory: list[float] = []
    options = ("--map-every", "60", "--batches-per-s", "1000")
    with (
        tempfile.TemporaryDirectory() as folder,
        ServerProcess(Path(folder) / "data", database, *options) as server,
    ):
        done = threading.Event()

        def watch() -> None:
            while not done.wait(5.0):
                memory.append(server.memory_mb())

        watching = threading.Thread(target=watch)
        watching.start()
        spent_s = time.process_time()
        tally = Replay(server.url, "hall", "common", 1.0, phones=phones, duration_s=seconds).run(walks)
        done.set()
        watching.join()
        processor_s = {
            "server": round(_processor_s(server.process.pid), 1) if server.process else None,
            "worker": round(sum(map(_processor_s, server.workers())), 1),
            "phones": round(time.process_time() - spent_s, 1),
        }
        site, build = server.ask("/sites/hall")[1], server.ask("/sites/hall/build")[1]
    quarter = max(len(memory) // 4, 1)
    return {
        **tally,
        "processor_s": processor_s,
        "load_average": os.getloadavg()[0],
        "memory_mb_first_quarter": round(max(memory[:quarter])),
        "memory_mb_last_quarter": round(max(memory[-quarter:])),
        "map_versions_meanwhile": site["map_version"],
        "build": build["state"],
    }


async def _client(port: int, bodies: list[bytes], until_s: float, numbers: list[int]) -> int:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    done = 0
    while time.perf_counter() < until_s:
        numbers[0] += 1
        body = b'{"sequence": %d, ' % numbers[0] + bodies[numbers[0] % len(bodies)]
        head = b"POST /sites/hall/walks/w/batches HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
        writer.write(head + b"Content-Length: %d\r\n\r\n" % len(body) + body)
        answer = await reader.readuntil(b"\r\n\r\n")
        length = next(int(line[15:]) for line in answer.split(b"\r\n") if line.lower().startswith(b"content-length"))
        await reader.readexactly(length)
        assert answer.startswith(b"HTTP/1.1 200"), answer
        done += 1
    writer.close()
    return done


def _rate(port: int, bodies: list[bytes], seconds: float, numbers: list[int]) -> float:
    async def run() -> int:
        until_s = time.perf_counter() + seconds
        return sum(await asyncio.gather(*(_client(port, bodies, until_s, numbers) for _ in range(CLIENTS))))

    return asyncio.run(run()) / seconds


def speed(rounds: int = 5, seconds: float = 4.0) -> list[tuple[float, float, float, float]]:
    """Requests per second, and processor milliseconds per request, of the service and of the bare endpoint.

    Turn by turn, with the same bodies.
    """
    sent = [batch for _, batch in batches(heavy_walks(1, 100.0, seed=2)[0], 5.0)]
    parts = [{key: value for key, value in batch.items() if key != "sequence"} for batch in sent]
    bodies = [json.dumps(part).encode()[1:] for part in parts]
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    bare = subprocess.Popen([sys.executable, "-c", BARE, str(port)], env={**os.environ, "OMP_NUM_THREADS": "1"})
    rows = []
    options = ("--batches-per-s", "1000000", "--map-every", "100000")
    try:
        with tempfile.TemporaryDirectory() as folder, ServerProcess(Path(folder) / "data", None, *options) as server:
            server.ask("/sites", {"id": "hall"})
            server.ask("/sites/hall/walks", {"name": "w"})
            server.wait_for(lambda: _listens(port), "the bare endpoint")
            assert server.process is not None
            numbers = [0]
            for turn in range(rounds + 1):
                ours = _measured(server.process.pid, server.port, bodies, seconds, numbers)
                theirs = _measured(bare.pid, port, bodies, seconds, numbers)
                if turn:  # the first warms up
                    rows.append((ours[0], theirs[0], ours[1], theirs[1]))
    finally:
        bare.kill()
        bare.wait()
    return rows


def _measured(pid: int, port: int, bodies: list[bytes], seconds: float, numbers: list[int]) -> tuple[float, float]:
    """Requests per second and processor milliseconds per request."""
    before, spent_s = numbers[0], _processor_s(pid)
    rate = _rate(port, bodies, seconds, numbers)
    return rate, 1000 * (_processor_s(pid) - spent_s) / (numbers[0] - before)


def _processor_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
