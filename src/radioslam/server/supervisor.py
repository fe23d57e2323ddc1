"""Starts the worker, starts it again when it dies, and tells watchers what it did."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import subprocess
import sys
import time
from typing import Any

from sqlalchemy import func, select
from starlette.concurrency import run_in_threadpool

from radioslam.errors import UnavailableError
from radioslam.server.database import Database
from radioslam.server.live import Broadcast
from radioslam.server.settings import Settings
from radioslam.server.tables import Build, StoredMap

LOOK_EVERY_S = 0.5
LONGEST_PAUSE_S = 10.0
HEALTHY_S = 30.0
"""A worker that lived so long is started again at once when it dies."""
_log = logging.getLogger("radioslam.server")


class Supervisor:
    """Watches over the worker process and over what it writes."""

    def __init__(self, settings: Settings, database: Database, live: Broadcast) -> None:
        self.settings, self.database, self.live = settings, database, live
        self.process: subprocess.Popen[bytes] | None = None
        self.restarts = 0
        self._started_s = 0.0
        self._pause_s = 0.0
        self._seen: dict[str, tuple[Any, ...]] = {}

    @property
    def alive(self) -> bool:
        """Whether the worker runs."""
        return self.process is not None and self.process.poll() is None

    async def watch(self, stopping: asyncio.Event) -> None:
        """Until it is told to stop; never cancelled, so that no look at the database is cut short."""
        try:
            while not stopping.is_set():
                if self.settings.worker:
                    self._keep_alive()
                with contextlib.suppress(UnavailableError):
                    await self._publish(await run_in_threadpool(self._look))
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stopping.wait(), LOOK_EVERY_S)
        finally:
            self.stop()

    def stop(self) -> None:
        """End the worker."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            if self.process.stdin:
                self.process.stdin.close()
            self.process = None

    def _keep_alive(self) -> None:
        if self.alive or time.monotonic() < self._started_s + self._pause_s:
            return
        if self.process is not None:
            _log.warning("the worker died with %s and is started again", self.process.returncode)
            lived_s = time.monotonic() - self._started_s
            self._pause_s = 0.0 if lived_s > HEALTHY_S else min(2 * self._pause_s + 0.5, LONGEST_PAUSE_S)
            self.restarts += 1
            self.stop()
        self._start()

    def _start(self) -> None:
        environment = {**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")}
        command = [sys.executable, "-m", "radioslam.server.worker"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, env=environment)
        self._started_s = time.monotonic()
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(self.settings.model_dump_json().encode() + b"\n")
            self.process.stdin.flush()

    def _look(self) -> list[tuple[str, int | None, str, bool, str, str]]:
        newest = (
            select(StoredMap.site_id, func.max(StoredMap.version).label("version"))
            .group_by(StoredMap.site_id)
            .subquery()
        )
        query = select(Build.site_id, newest.c.version, Build.state, Build.wanted, Build.step, Build.message)
        with self.database.read() as session:
            rows = session.execute(query.join(newest, newest.c.site_id == Build.site_id, isouter=True))
            return [tuple(row) for row in rows]

    async def _publish(self, rows: list[tuple[str, int | None, str, bool, str, str]]) -> None:
        for site_id, version, *build in rows:
            before = self._seen.get(site_id)
            self._seen[site_id] = (version, *build)
            if before is None or before == self._seen[site_id]:
                continue
            if version is not None and version != before[0]:
                self.live.publish(site_id, "map", {"version": version})
                self.live.publish(site_id, "loops", await run_in_threadpool(self._loops, site_id, version))
            if tuple(build) != before[1:]:
                told = dict(zip(("state", "wanted", "step", "message"), build, strict=True))
                self.live.publish(site_id, "build", told)

    def _loops(self, site_id: str, version: int) -> dict[str, Any]:
        """How many loops a version kept, over all floors."""
        with self.database.read() as session:
            made = session.get(StoredMap, (site_id, version))
        floors = made.summary["floors"] if made else []
        return {
            "version": version,
            "kept": sum(floor["loops"]["kept"] for floor in floors),
            "candidates": sum(floor["loops"]["candidates"] for floor in floors),
        }
