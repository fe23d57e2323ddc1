"""Server-sent events over a real socket while phones walk, and the queues behind them."""

from __future__ import annotations

import asyncio
import json
import threading
import urllib.request

from radioslam.server.live import LONGEST_QUEUE, Broadcast
from radioslam.server.replay import Replay
from radioslam.simulator import simulate
from tests.server.processes import ServerProcess

WALKS = simulate("office", seed=1, walks=3)


def listen(url: str, found: list[tuple[str, dict]], enough: threading.Event) -> None:
    with urllib.request.urlopen(url, timeout=60) as stream:
        kind = ""
        for raw in stream:
            line = raw.decode().strip()
            if line.startswith("event:"):
                kind = line[6:].strip()
            elif line.startswith("data:"):
                found.append((kind, json.loads(line[5:])))
                if {"poses", "walk", "map", "loops", "build"} <= {name for name, _ in found}:
                    enough.set()
                    return


def test_poses_loops_and_maps_are_told(tmp_path):
    with ServerProcess(tmp_path / "data", None, "--map-every", "1") as server:
        server.ask("/sites", {"id": "site", "starts": "common"})
        found, enough = [], threading.Event()
        watching = threading.Thread(target=listen, args=(f"{server.url}/sites/site/events", found, enough), daemon=True)
        watching.start()
        Replay(server.url, "site", "common", 30.0).run(WALKS)
        assert enough.wait(60), {name for name, _ in found}
    poses = next(data for name, data in found if name == "poses")
    assert poses["walk"] in {walk.name for walk in WALKS}
    assert len(poses["poses"][0]) == 4
    assert next(data for name, data in found if name == "loops")["candidates"] > 0
    assert next(data for name, data in found if name == "map")["version"] >= 1


def test_slow_watchers_lose_the_oldest_and_others_nothing():
    async def run() -> None:
        live = Broadcast()
        async with live.watch("a") as slow, live.watch("b") as other:
            for k in range(LONGEST_QUEUE + 5):
                live.publish("a", "walk", {"k": k})
            live.publish("b", "walk", {"k": -1})
            assert (await anext(slow)).data == {"k": 5}
            assert (await anext(other)).data == {"k": -1}
        assert live.watchers == 0

    asyncio.run(run())


def test_who_comes_back_goes_on_where_it_was():
    async def run() -> None:
        live = Broadcast()
        for k in range(4):
            live.publish("a", "walk", {"k": k})
        async with live.watch("a", after=2) as events:
            assert [(await anext(events)).number for _ in range(2)] == [3, 4]

    asyncio.run(run())
