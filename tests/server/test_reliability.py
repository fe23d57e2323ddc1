"""Real processes that are killed, disks that are full, databases that go away: nothing acknowledged is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import time

import pytest

from radioslam.server.replay import Replay, batches
from radioslam.simulator import simulate
from tests.server.kills import survives
from tests.server.processes import ServerProcess

WALKS = simulate("office", seed=1, walks=4)
POSE = {"time_s": 1.0, "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
pytestmark = pytest.mark.slow


@pytest.mark.timeout(900)  # servers start again and again, on machines that others load
@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_kill_9_loses_nothing_and_doubles_nothing(kind, tmp_path, request):
    if kind == "sqlite":
        urls = [f"sqlite:///{tmp_path / name}" for name in ("killed.sqlite", "calm.sqlite")]
    else:
        cluster = request.getfixturevalue("postgres")
        urls = [cluster.new_database(), cluster.new_database()]
    survives(urls[0], urls[1], tmp_path, WALKS, kills=4, seed=1, speed=6.0)


def test_database_gone_and_back(postgres, tmp_path):
    with ServerProcess(tmp_path / "data", postgres.new_database(), "--map-every", "1") as server:
        Replay(server.url, "site", "common", 500.0).run(WALKS[:2])
        server.wait_for_map("site")
        scan = {"readings": next(batches(WALKS[0], 10.0))[1]["scans"][0]["readings"]}
        assert server.ask("/sites/site/locate", scan)[0] == 200
        server.ask("/sites/site/walks", {"name": "more"})
        postgres.stop()
        try:
            status, answer = server.ask("/sites/site/walks/more/batches", {"sequence": 0, "poses": [POSE]})
            assert (status, answer["error"]["kind"]) == (503, "service-unavailable")
            status, health = server.ask("/health")
            assert (status, health["database"]) == (503, "unavailable")
        finally:
            postgres.start()
        server.wait_for(lambda: server.ask("/health")[0] == 200, "the database back")
        assert server.ask("/sites/site/walks/more/batches", {"sequence": 0, "poses": [POSE]})[0] == 200
        assert server.ask("/sites/site/locate", scan)[0] == 200
        server.ask("/sites/site/build", {})
        server.wait_for_map("site", 2)


def test_worker_killed_while_it_maps(tmp_path):
    with ServerProcess(tmp_path / "data", None, "--map-every", "1") as server:
        Replay(server.url, "site", "common", 500.0).run(WALKS)
        server.wait_for_map("site")
        before = server.ask("/sites/site")[1]["map_version"]
        server.ask("/sites/site/build", {})
        server.wait_for(lambda: server.ask("/sites/site/build")[1]["state"] == "running", "a build", 30)
        for pid in server.workers():
            os.kill(pid, signal.SIGKILL)
        assert server.ask(f"/sites/site/maps/{before}/paths")[0] == 200
        server.wait_for(lambda: server.ask("/health")[1]["worker_restarts"] >= 1, "another worker")
        server.wait_for_map("site", before + 1)
        build = server.ask("/sites/site/build")[1]
        assert build["state"] == "idle"
        assert server.ask("/health")[1]["status"] == "ok"


def test_worker_ends_with_a_killed_server(tmp_path):
    with ServerProcess(tmp_path / "data") as server:
        server.wait_for(server.workers, "a worker")
        (worker,) = server.workers()
        server.kill()
        until_s = time.monotonic() + 10
        while os.path.exists(f"/proc/{worker}") and time.monotonic() < until_s:  # noqa: PTH110
            time.sleep(0.1)
        assert not os.path.exists(f"/proc/{worker}")  # noqa: PTH110


def test_full_disk(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)], capture_output=True)
    if mounted.returncode:
        pytest.skip("no small disk can be mounted here; needs root")
    try:
        with ServerProcess(disk / "data") as server:
            server.log = tmp_path / "log"
            server.ask("/sites", {"id": "site", "starts": "common"})
            server.ask("/sites/site/walks", {"name": "a"})
            accepted, status, answer = [], 200, None
            for sequence in range(400):
                poses = [{**POSE, "time_s": sequence + k / 997, "x_m": (k * 7919 % 10007) / 3} for k in range(500)]
                status, answer = server.ask("/sites/site/walks/a/batches", {"sequence": sequence, "poses": poses})
                if status != 200:
                    break
                accepted.append(sequence)
            assert accepted
            assert status == 503
            assert "no space left" in answer["error"]["message"]
            assert server.ask("/health")[0] == 200
            assert server.ask("/sites/site")[0] == 200
            subprocess.run(["mount", "-o", "remount,size=30m", str(disk)], check=True)
            assert server.ask("/sites/site/walks/a/batches", {"sequence": len(accepted), "poses": [POSE]})[0] == 200
            assert server.ask("/sites/site/walks/a")[1]["batches"] == len(accepted) + 1
            assert server.ask("/sites/site/walks/a/finish", {"batches": len(accepted) + 1})[0] == 200
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
