"""Walks: begin, stream batches, finish, upload whole files, withdraw, erase; and a contributor's own."""

from __future__ import annotations

import asyncio
import io
import re
import tempfile
import zipfile
from functools import partial
from pathlib import Path
from typing import IO, Annotated

import anyio
from fastapi import APIRouter, Query, Request, Response
from fastapi import Path as PathParameter
from sqlalchemy import select
from starlette.concurrency import run_in_threadpool

from radioslam.server.access import Admin, Caller, Reader, Uploader
from radioslam.server.context import Context, context_of
from radioslam.server.journal import Incoming
from radioslam.server.messages import Accepted, Batch, Finish, Label, Name, NewWalk, Uploaded, WalkInfo
from radioslam.server.recordings import body_of, packed, sealed
from radioslam.server.routes_sites import SiteId
from radioslam.server.store import (
    add_walk,
    erase_walks,
    find_site,
    find_walk,
    finish,
    load_walk,
    walks_of,
    withdraw,
)
from radioslam.server.tables import StoredWalk
from radioslam.walk import Walk

router = APIRouter(tags=["walks"])
WalkName = Annotated[Name, PathParameter(description="Name of the walk.")]
Contributor = Annotated[Label, PathParameter(description="Pseudonym of the contributor.")]
IN_MEMORY_BYTES = 1024 * 1024
READING = anyio.CapacityLimiter(1)
"""Whole files are read one by one, so that phones keep their turn."""


@router.post(
    "/sites/{site_id}/walks", status_code=201, responses={200: {"description": "It was begun before, just so."}}
)
async def begin_walk(request: Request, response: Response, site_id: SiteId, new: NewWalk, caller: Uploader) -> WalkInfo:
    """Begin a walk; the same again is no error."""
    context = context_of(request)
    context.rates.take(caller.name)
    if not await run_in_threadpool(add_walk, context.database, site_id, new, caller):
        response.status_code = 200
    context.live.publish(site_id, "walk", {"walk": new.name, "state": "open"})
    return await run_in_threadpool(_info, context, site_id, new.name)


@router.post("/sites/{site_id}/walks/{name}/batches")
async def send_batch(request: Request, site_id: SiteId, name: WalkName, batch: Batch, caller: Uploader) -> Accepted:
    """Add a batch; once answered, it is on the disk. Repeat it as often as it takes."""
    context = context_of(request)
    context.rates.take(caller.name)
    body, digest, dropped = packed(batch, context.hide)
    incoming = Incoming(site_id, name, batch.sequence, body, digest, caller)
    duplicate = await asyncio.wrap_future(context.journal.submit(incoming))
    if batch.poses and not duplicate and context.live.watchers:
        poses = [(p.time_s, p.x_m, p.y_m, p.heading_rad) for p in batch.poses]
        context.live.publish(site_id, "poses", {"walk": name, "scans": len(batch.scans), "poses": poses})
    return Accepted(sequence=batch.sequence, duplicate=duplicate, dropped_readings=dropped)


@router.post("/sites/{site_id}/walks/{name}/finish")
async def finish_walk(request: Request, site_id: SiteId, name: WalkName, end: Finish, caller: Uploader) -> WalkInfo:
    """Close a walk; with ``batches`` only once they are all there."""
    context = context_of(request)
    walk = await run_in_threadpool(finish, context.database, site_id, name, end.batches, caller)
    context.live.publish(site_id, "walk", {"walk": name, "state": walk.state})
    return walk_info(walk)


@router.post(
    "/sites/{site_id}/files",
    status_code=201,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def upload_file(
    request: Request,
    site_id: SiteId,
    caller: Uploader,
    name: Annotated[Label, Query(description="The file's name; walks are called by it.")],
    contributor: Annotated[Label | None, Query()] = None,
) -> Uploaded:
    """Add the walks of a whole log, or of a zip of logs; formats as `radioslam map` reads them."""
    context = context_of(request)
    context.rates.take(caller.name)
    with tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES) as file:
        async for chunk in request.stream():
            file.write(chunk)
        file.seek(0)
        add = partial(_add_file, context, site_id, name, file, contributor, caller)
        uploaded = await anyio.to_thread.run_sync(add, limiter=READING)
    for walk in uploaded.walks:
        context.live.publish(site_id, "walk", {"walk": walk, "state": "finished"})
    return uploaded


def _add_file(
    context: Context, site_id: str, name: str, file: IO[bytes], contributor: str | None, caller: Caller
) -> Uploaded:
    from radioslam.server.uploads import read_upload

    with context.database.read() as session:
        find_site(session, site_id)
    walks, dropped = read_upload(name, file, context.settings.limits)
    new: list[str] = []
    duplicates: list[str] = []
    for walk in walks:
        called = _fitting_name(walk.name)
        (duplicates if _add_whole(context, site_id, called, walk, contributor, caller) else new).append(called)
    return Uploaded(walks=new, duplicates=duplicates, dropped_readings=dropped)


def _add_whole(context: Context, site_id: str, name: str, walk: Walk, contributor: str | None, caller: Caller) -> bool:
    about = {"device": _label(walk.device), "floor": _label(walk.floor)}
    add_walk(context.database, site_id, NewWalk(name=name, contributor=contributor, **about), caller)
    body, digest = sealed(body_of(walk, context.hide))
    duplicate = context.journal.submit(Incoming(site_id, name, 0, body, digest, caller)).result()
    finish(context.database, site_id, name, 1, caller)
    return duplicate


def _fitting_name(name: str) -> str:
    return re.sub(r"^[^A-Za-z0-9]+", "", re.sub(r"[^A-Za-z0-9._-]+", "-", name))[:100] or "walk"


def _label(text: str) -> str:
    return "".join(c for c in text if c.isprintable())[:100]


@router.get("/sites/{site_id}/walks")
def list_walks(request: Request, site_id: SiteId, _: Reader) -> list[WalkInfo]:
    """All walks of a site."""
    query = select(StoredWalk).where(StoredWalk.site_id == site_id).order_by(StoredWalk.name)
    with context_of(request).database.read() as session:
        find_site(session, site_id)
        return [walk_info(walk) for walk in session.scalars(query)]


@router.get("/sites/{site_id}/walks/{name}")
def get_walk(request: Request, site_id: SiteId, name: WalkName, _: Reader) -> WalkInfo:
    """One walk."""
    return _info(context_of(request), site_id, name)


@router.post("/sites/{site_id}/walks/{name}/withdraw")
def withdraw_walk(request: Request, site_id: SiteId, name: WalkName, _: Admin, restore: bool = False) -> WalkInfo:
    """Leave a bad walk out of the next map; ``restore`` takes it back in."""
    return walk_info(withdraw(context_of(request).database, site_id, name, not restore))


@router.delete("/sites/{site_id}/walks/{name}", status_code=204)
def erase_walk(request: Request, site_id: SiteId, name: WalkName, _: Admin) -> None:
    """Erase a walk; maps that hold it go as soon as the site is mapped again."""
    context = context_of(request)
    with context.database.read() as session:
        walk = find_walk(session, site_id, name)
    erase_walks(context.database, [walk])


@router.get(
    "/contributors/{contributor}/export", response_class=Response, responses={200: {"content": {"application/zip": {}}}}
)
def export_contributor(request: Request, contributor: Contributor, _: Admin) -> Response:
    """All walks of a contributor as a zip of RadioSLAM's own format."""
    from radioslam.formats import write_walk

    context = context_of(request)
    packed_walks = io.BytesIO()
    with zipfile.ZipFile(packed_walks, "w", zipfile.ZIP_DEFLATED) as archive, tempfile.TemporaryDirectory() as folder:
        for stored in walks_of(context.database, contributor):
            with context.database.read() as session:
                target = write_walk(load_walk(session, stored), Path(folder) / stored.site_id)
            for path in sorted(target.iterdir()):
                archive.write(path, f"{stored.site_id}/{stored.name}/{path.name}")
    return Response(packed_walks.getvalue(), media_type="application/zip")


@router.delete("/contributors/{contributor}")
def erase_contributor(request: Request, contributor: Contributor, _: Admin) -> dict[str, int]:
    """Erase all walks of a contributor; the maps are made again without them."""
    context = context_of(request)
    walks = walks_of(context.database, contributor)
    erase_walks(context.database, walks)
    return {"erased": len(walks)}


def _info(context: Context, site_id: str, name: str) -> WalkInfo:
    with context.database.read() as session:
        return walk_info(find_walk(session, site_id, name))


def walk_info(walk: StoredWalk) -> WalkInfo:
    """A walk as clients see it."""
    return WalkInfo.model_validate({key: getattr(walk, key) for key in WalkInfo.model_fields})
