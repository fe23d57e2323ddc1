"""Who asks, and what they may: API keys as FastAPI dependencies.

A key comes as ``Authorization: Bearer KEY``, as ``X-API-Key``, or as ``?key=`` where a client can set no header (the
browser's event streams, and the geolocation API that phones know).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request
from fastapi.security import APIKeyHeader, APIKeyQuery, HTTPBearer
from fastapi.security.http import HTTPAuthorizationCredentials
from starlette.concurrency import run_in_threadpool

from radioslam.errors import ForbiddenError, UnauthorizedError
from radioslam.server.context import Context, context_of
from radioslam.server.keys import find_key, secret_hash

REMEMBERED_S = 5.0
"""A key that was removed is refused at the latest after so long."""
LARGEST_MEMORY = 10_000
_bearer = HTTPBearer(auto_error=False)
_header = APIKeyHeader(name="X-API-Key", auto_error=False)
_query = APIKeyQuery(name="key", auto_error=False)


@dataclass(frozen=True)
class Caller:
    """Who asks: the key's name and role."""

    name: str
    role: str

    def may(self, role: str) -> bool:
        """Whether the role is theirs; an admin may everything."""
        return self.role in ("admin", role)


ANYBODY = Caller("anybody", "admin")


class KeyMemory:
    """Callers by the hash of their secrets for some seconds, so that not each request asks the database."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[float, Caller | None]] = {}

    async def find(self, context: Context, secret: str) -> Caller | None:
        """The caller with this secret."""
        digest = secret_hash(secret)
        until_s, caller = self._known.get(digest, (0.0, None))
        if time.monotonic() < until_s:
            return caller
        found = await run_in_threadpool(find_key, context.database, secret)
        caller = Caller(*found) if found else None
        if len(self._known) >= LARGEST_MEMORY:
            self._known.clear()
        self._known[digest] = (time.monotonic() + REMEMBERED_S, caller)
        return caller


async def find_caller(
    request: Request,
    bearer: Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)],
    header: Annotated[str | None, Depends(_header)],
    query: Annotated[str | None, Depends(_query)],
) -> Caller:
    """Who asks.

    Raises:
        UnauthorizedError: no key, or one that is not known.
    """
    context = context_of(request)
    if context.settings.open:
        return ANYBODY
    secret = bearer.credentials if bearer else header or query
    caller = await context.keys.find(context, secret) if secret else None
    if caller is None:
        raise UnauthorizedError("expected an API key as Authorization: Bearer KEY; `radioslam keys add` makes one")
    return caller


def _needs(*roles: str) -> Callable[..., Coroutine[Any, Any, Caller]]:
    async def check(caller: Annotated[Caller, Depends(find_caller)]) -> Caller:
        if not any(caller.may(role) for role in roles):
            raise ForbiddenError(f"expected a key with the role {' or '.join(roles)}, found {caller.role}")
        return caller

    return check


AnyRole = Annotated[Caller, Depends(find_caller)]
Uploader = Annotated[Caller, Depends(_needs("upload"))]
Reader = Annotated[Caller, Depends(_needs("read"))]
Admin = Annotated[Caller, Depends(_needs("admin"))]
