"""What happens at a site, told to whoever watches it: server-sent events.

Each watcher has a queue of its own; one that reads too slowly loses the oldest events. Events are numbered, and the
last ones are kept, so that a browser that reconnects goes on where it was.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

LONGEST_QUEUE = 1000
REMEMBERED = 1000


@dataclass(frozen=True)
class Event:
    """``kind``: poses, walk, build, loops, map or position."""

    number: int
    site_id: str
    kind: str
    data: dict[str, Any]


class Broadcast:
    """Hands events from the event loop to its watchers."""

    def __init__(self) -> None:
        self._past: deque[Event] = deque(maxlen=REMEMBERED)
        self._queues: dict[asyncio.Queue[Event], str] = {}
        self._number = 0

    @property
    def watchers(self) -> int:
        """How many watch."""
        return len(self._queues)

    def publish(self, site_id: str, kind: str, data: dict[str, Any]) -> None:
        """Tell an event; from the event loop only."""
        self._number += 1
        event = Event(self._number, site_id, kind, data)
        self._past.append(event)
        for queue, watched in self._queues.items():
            if watched == site_id:
                if queue.full():
                    queue.get_nowait()
                queue.put_nowait(event)

    @asynccontextmanager
    async def watch(self, site_id: str, after: int | None = None) -> AsyncIterator[AsyncIterator[Event]]:
        """The site's events from now on, or those after a number as far as they are remembered."""
        queue: asyncio.Queue[Event] = asyncio.Queue(LONGEST_QUEUE)
        for event in self._past if after is not None else ():
            if event.site_id == site_id and event.number > (after or 0):
                queue.put_nowait(event)
        self._queues[queue] = site_id
        try:
            yield self._events(queue)
        finally:
            del self._queues[queue]

    @staticmethod
    async def _events(queue: asyncio.Queue[Event]) -> AsyncIterator[Event]:
        while True:
            yield await queue.get()
