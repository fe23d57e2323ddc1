"""Many small writes, one commit: what waits is written together and answered once it is on the disk.

A commit costs a wait for the disk of some milliseconds, whatever is in it. One thread takes all that has come in
meanwhile into the next transaction; it tells of each item whether it was taken, and one that is refused spoils no
other.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Generic, TypeVar

from sqlalchemy.orm import Session

from radioslam.errors import RadioSlamError
from radioslam.server.database import Database

Item = TypeVar("Item")
Answer = TypeVar("Answer")
MOST_AT_ONCE = 200


class GroupCommit(Generic[Item, Answer]):
    """The one who writes, from the first item on until ``close``.

    ``write`` puts items into a transaction; for each it returns an answer, or the error that it is refused with.
    """

    def __init__(
        self, database: Database, write: Callable[[Session, Sequence[Item]], Sequence[Answer | RadioSlamError]]
    ) -> None:
        self._database, self._write = database, write
        self._waiting: queue.SimpleQueue[tuple[Item, Future[Answer]] | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._starting = threading.Lock()

    def submit(self, item: Item) -> Future[Answer]:
        """The answer to an item, once it is durable; its refusal, or why nothing could be written."""
        future: Future[Answer] = Future()
        self._waiting.put((item, future))
        with self._starting:
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="group-commit", daemon=True)
                self._thread.start()
        return future

    def close(self) -> None:
        """Write what waits, then end."""
        with self._starting:
            thread, self._thread = self._thread, None
            if thread is not None:
                self._waiting.put(None)
                thread.join()

    def _run(self) -> None:
        ended = False
        while not ended:
            group = [self._waiting.get()]
            while len(group) < MOST_AT_ONCE and group[-1] is not None and not self._waiting.empty():
                group.append(self._waiting.get())
            ended = group[-1] is None
            self._commit([one for one in group if one is not None and one[1].set_running_or_notify_cancel()])

    def _commit(self, group: list[tuple[Item, Future[Answer]]]) -> None:
        if not group:
            return
        try:
            with self._database.write() as session:
                answers = self._write(session, [item for item, _ in group])
        except Exception as error:  # nothing of the transaction is there: nobody may believe otherwise
            for _, future in group:
                future.set_exception(error)
            return
        for (_, future), answer in zip(group, answers, strict=True):
            if isinstance(answer, RadioSlamError):
                future.set_exception(answer)
            else:
                future.set_result(answer)
