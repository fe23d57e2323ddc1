"""How much and how fast: bodies by size and time, batches by rate."""

from __future__ import annotations

import asyncio
import time

from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from radioslam.errors import TooFastError, TooLargeError, UnavailableError
from radioslam.server.problems import answer
from radioslam.server.settings import Limits

UPLOADS = "/files"
"""Paths that end so take whole files."""


class BodyLimit:
    """ASGI middleware: a body may have so many bytes and take so long, whatever its header says."""

    def __init__(self, app: ASGIApp, limits: Limits) -> None:
        self.app, self.limits = app, limits

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, counting."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        most = self.limits.upload_bytes if scope["path"].endswith(UPLOADS) else self.limits.body_bytes
        body = _Counted(receive, most, time.monotonic() + self.limits.request_s)

        async def send_unless_refused(message: Message) -> None:
            if body.refusal is None:  # else it tells of a body that could not be read, and not why
                await send(message)

        try:
            declared = Request(scope).headers.get("content-length", "0")
            if declared.isdigit() and int(declared) > most:
                raise TooLargeError(f"expected at most {most} bytes, found {declared}; send smaller batches")
            await self.app(scope, body.receive, send_unless_refused)
        except (TooLargeError, UnavailableError) as error:
            body.refusal = error
        if body.refusal is not None:
            await answer(body.refusal, scope["path"])(scope, receive, send)


class _Counted:
    def __init__(self, receive: Receive, most: int, until_s: float) -> None:
        self._receive, self._most, self._until_s = receive, most, until_s
        self._bytes, self._whole = 0, False
        self.refusal: TooLargeError | UnavailableError | None = None

    async def receive(self) -> Message:
        if self._whole:  # the body is there; what comes now is the end of the connection
            return await self._receive()
        try:
            async with asyncio.timeout(max(self._until_s - time.monotonic(), 0)):
                message = await self._receive()
        except TimeoutError:
            self.refusal = UnavailableError("the body did not arrive in time; send it again, in smaller parts")
            raise self.refusal from None
        self._bytes += len(message.get("body", b""))
        self._whole = message["type"] != "http.request" or not message.get("more_body", False)
        if self._bytes > self._most:
            self.refusal = TooLargeError(f"expected at most {self._most} bytes, found more; send smaller batches")
            raise self.refusal
        return message


class Rates:
    """A token bucket for each API key: ``per_s`` on average, twice that at once."""

    def __init__(self, per_s: float) -> None:
        self.per_s = per_s
        self._buckets: dict[str, tuple[float, float]] = {}

    def take(self, key: str) -> None:
        """Count one request.

        Raises:
            TooFastError: the bucket is empty.
        """
        now_s = time.monotonic()
        tokens, then_s = self._buckets.get(key, (2 * self.per_s, now_s))
        tokens = min(tokens + (now_s - then_s) * self.per_s, 2 * self.per_s)
        if tokens < 1:
            raise TooFastError(f"expected at most {self.per_s:g} batches per second of one key; wait and send again")
        self._buckets[key] = (tokens - 1, now_s)
