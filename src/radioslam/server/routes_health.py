"""Health, without a key; whose key it is; and the description of the API."""

from __future__ import annotations

import importlib.metadata
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from radioslam.server.access import AnyRole, Caller
from radioslam.server.context import context_of

router = APIRouter(tags=["service"])


@router.get("/health")
async def health(request: Request, response: Response) -> dict[str, Any]:
    """Whether the service, its database and its worker are well; status 503 where the database is not."""
    context = context_of(request)
    database = await run_in_threadpool(context.database.check)
    worker = context.supervisor.alive or not context.settings.worker
    response.status_code = 200 if database else 503
    return {
        "status": "ok" if database and worker else "degraded",
        "version": importlib.metadata.version("radioslam"),
        "database": "ok" if database else "unavailable",
        "worker": "ok" if worker else "starting again",
        "worker_restarts": context.supervisor.restarts,
    }


@router.get("/key")
async def whose_key(caller: AnyRole) -> Caller:
    """Name and role of the key that asks, so that a client offers only what it may."""
    return caller


@router.get("/openapi.json", include_in_schema=False)
async def openapi(request: Request, _: AnyRole) -> dict[str, Any]:
    """The API's description."""
    described: dict[str, Any] = request.app.openapi()
    return described
