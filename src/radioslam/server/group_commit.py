"""Many small writes, one commit: what waits is written together and answered once it is on the disk.

A commit costs a wait for the disk of some milliseconds, whatever is in it. One thread takes all writes that have come
in meanwhile into the next transaction, each behind a savepoint of its own, so that one that is refused spoils no other.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from radioslam.errors import RadioSlamError
from radioslam.server.database import Database

Result = TypeVar("Result")
Job = tuple[Callable[[Session], Any], "Future[Any]"]
MOST_AT_ONCE = 200


class GroupCommit:
    """The one who writes, from the first write on until ``close``."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._waiting: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._starting = threading.Lock()

    def submit(self, write: Callable[[Session], Result]) -> Future[Result]:
        """What ``write`` returns, once it is durable; what it raises, once it is undone."""
        answer: Future[Result] = Future()
        self._waiting.put((write, answer))
        with self._starting:
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="group-commit", daemon=True)
                self._thread.start()
        return answer

    def close(self) -> None:
        """Write what waits, then end."""
        with self._starting:
            thread, self._thread = self._thread, None
            if thread is not None:
                self._waiting.put(None)
                thread.join()

    def _run(self) -> None:
        while True:
            first = self._waiting.get()
            if first is None:
                return
            jobs = [first]
            ended = False
            while len(jobs) < MOST_AT_ONCE and not ended:
                try:
                    job = self._waiting.get_nowait()
                except queue.Empty:
                    break
                ended = job is None
                jobs += [] if job is None else [job]
            self._write(jobs)
            if ended:
                return

    def _write(self, jobs: list[Job]) -> None:
        jobs = [job for job in jobs if job[1].set_running_or_notify_cancel()]
        done: list[tuple[Future[Any], Any, BaseException | None]] = []
        try:
            with self._database.write() as session:
                done = [(answer, *_tried(session, write)) for write, answer in jobs]
        except Exception as error:  # nothing of the transaction is there: nobody may believe otherwise
            for _, answer in jobs:
                answer.set_exception(error)
            return
        for answer, result, refusal in done:
            if refusal is None:
                answer.set_result(result)
            else:
                answer.set_exception(refusal)


def _tried(session: Session, write: Callable[[Session], Any]) -> tuple[Any, BaseException | None]:
    try:
        with session.begin_nested():
            return write(session), None
    except RadioSlamError as refusal:
        return None, refusal
