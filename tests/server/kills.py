"""``kill -9`` at random moments of a replay; what was acknowledged must be there, once, and the map the same."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from radioslam.server.replay import Replay
from radioslam.server.tables import StoredBatch, StoredWalk
from radioslam.walk import Walk
from tests.server.processes import ServerProcess


def final_map(server: ServerProcess, site: str) -> tuple[list[str], np.ndarray]:
    """Walks and poses of a map made now, of all that is stored."""
    before = server.ask(f"/sites/{site}")[1]["map_version"] or 0
    server.ask(f"/sites/{site}/build", {})
    server.wait_for_map(site, before + 1)
    server.wait_for(lambda: _is_done(server.ask(f"/sites/{site}/build")[1]), "an idle worker")
    version = server.ask(f"/sites/{site}")[1]["map_version"]
    paths = server.ask(f"/sites/{site}/maps/{version}/paths")[1]
    return [one["walk"] for one in paths], np.concatenate([np.array(one["estimate"]) for one in paths])


def _is_done(build: dict[str, object]) -> bool:
    """Whether no map is being made nor wanted: one that was under way when it was wanted holds fewer walks."""
    return build["state"] == "idle" and not build["wanted"]


def replay_with_kills(
    server: ServerProcess, walks: Sequence[Walk], kills: int, seed: int, speed: float, site: str = "site"
) -> set[tuple[str, int]]:
    """Replay while the server is killed again and again; the batches that were acknowledged."""
    rng = random.Random(seed)
    acknowledged: set[tuple[str, int]] = set()
    replay = Replay(server.url, site, "common", speed, on_acknowledged=lambda *batch: acknowledged.add(batch))
    failures: list[BaseException] = []

    def play() -> None:
        try:
            replay.run(walks)
        except BaseException as error:
            failures.append(error)

    playing = threading.Thread(target=play)
    playing.start()
    killed = 0
    while killed < kills and playing.is_alive():
        time.sleep(rng.uniform(0.05, 1.0))
        server.kill()
        killed += 1
        server.start()
    playing.join()
    assert not failures, failures
    assert killed == kills, f"the replay ended after {killed} kills; play it slower"
    return acknowledged


def stored_batches(database_url: str, site: str = "site") -> list[tuple[str, int]]:
    """What the database holds, by walk and sequence number."""
    from sqlalchemy import select

    from radioslam.server.database import Database
    from radioslam.server.settings import Settings

    database = Database(Settings(database=database_url).database_url)
    query = select(StoredWalk.name, StoredBatch.sequence).join(
        StoredBatch, StoredBatch.walk_number == StoredWalk.number
    )
    with database.read() as session:
        rows = [(name, sequence) for name, sequence in session.execute(query.where(StoredWalk.site_id == site))]
    database.close()
    return rows


def survives(
    database_url: str, undisturbed_url: str, folder: Path, walks: Sequence[Walk], kills: int, seed: int, speed: float
) -> str:
    """Replay with and without kills and compare; a line that says what was found."""
    started_s = time.perf_counter()
    with ServerProcess(folder / "killed", database_url, "--map-every", "1") as server:
        acknowledged = replay_with_kills(server, walks, kills, seed, speed)
        disturbed = final_map(server, "site")
    stored = stored_batches(database_url)
    assert len(stored) == len(set(stored)), "a batch is doubled"
    assert acknowledged <= set(stored), f"lost: {sorted(acknowledged - set(stored))[:5]}"
    with ServerProcess(folder / "calm", undisturbed_url, "--map-every", "1") as server:
        Replay(server.url, "site", "common", 200.0).run(walks)
        calm = final_map(server, "site")
    assert set(stored) == set(stored_batches(undisturbed_url))
    assert disturbed[0] == calm[0]
    np.testing.assert_array_equal(disturbed[1], calm[1])
    seconds = time.perf_counter() - started_s
    return f"{kills} kills, {len(acknowledged)} batches acknowledged, 0 lost, 0 doubled, maps equal ({seconds:.0f} s)"
