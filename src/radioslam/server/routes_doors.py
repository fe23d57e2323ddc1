"""Doors for apps that exist: the location APIs of Google and Mozilla, and Sensor Logger's push by HTTP.

The location APIs name no site: a scan is answered by the georeferenced site that knows most of its access points, and
reports go to the one that lies around them.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import re
import time
from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import BaseModel, ConfigDict, Field, StringConstraints
from sqlalchemy import select
from starlette.concurrency import run_in_threadpool

from radioslam.errors import ConflictError, DoorError
from radioslam.server.access import Caller, Reader, Uploader
from radioslam.server.context import Context, context_of
from radioslam.server.journal import Incoming
from radioslam.server.messages import Accepted, Count, Label, NewWalk
from radioslam.server.privacy import Hide
from radioslam.server.recordings import Body, body_of, sealed
from radioslam.server.routes_positions import located, with_degrees
from radioslam.server.routes_sites import SiteId
from radioslam.server.store import add_walk
from radioslam.server.tables import Site

router = APIRouter(tags=["doors"])
SITE_REACH_M = 1000.0
MOST_SEQUENCE = 2**30
_JSON_BODY = {"requestBody": {"required": True, "content": {"application/json": {"schema": {"type": "object"}}}}}


class SensorLoggerMessage(BaseModel):
    """What the app pushes every so often; messages may come in any order."""

    model_config = ConfigDict(extra="ignore")

    messageId: Count  # noqa: N815
    sessionId: Annotated[str, StringConstraints(pattern=r"^[!-~]{1,100}$")]  # noqa: N815
    deviceId: Label = ""  # noqa: N815
    payload: Annotated[list[dict[str, Any]], Field(max_length=100_000)]


@router.post("/v1/geolocate", openapi_extra=_JSON_BODY)
async def geolocate(request: Request, _: Reader) -> dict[str, Any]:
    """Google's and Mozilla's question where a phone is, by the scans alone."""
    from radioslam.doors import scan_of_geolocate

    context = context_of(request)
    scan = scan_of_geolocate(await _json(request))
    return await run_in_threadpool(
        _geolocate, context, {_hidden(name, context.hide): dbm for name, dbm in scan.items()}
    )


def _hidden(name: str, hide: Hide) -> str:
    return hide(name.removeprefix("ble:"))


async def _json(request: Request) -> Any:
    try:
        return json.loads(await request.body() or b"{}")
    except (ValueError, RecursionError):
        raise DoorError("parseError", "expected JSON, found something else") from None


def _geolocate(context: Context, scan: dict[str, float]) -> dict[str, Any]:
    best: tuple[int, str] | None = None
    for site_id, _ in _georeferenced(context):
        try:
            known = len(scan.keys() & set(context.positioners.get(site_id).positioner.transmitters))
        except ConflictError:
            continue
        if known and (best is None or known > best[0]):
            best = (known, site_id)
    if best is None:
        raise DoorError("notFound", "expected access points of a georeferenced site, found none")
    answer = with_degrees(context, best[1], located(context.positioners.get(best[1]), scan))
    if not answer.here:
        raise DoorError("notFound", answer.reason)
    place = {"lat": answer.latitude_deg, "lng": answer.longitude_deg}
    return {"location": place, "accuracy": answer.radius_m}


@router.post("/v2/geosubmit", openapi_extra=_JSON_BODY)
async def geosubmit(request: Request, caller: Uploader) -> dict[str, Any]:
    """Mozilla's reports of scans at known positions; they become a survey of the site around them."""
    from radioslam.doors import reports_of_geosubmit

    context = context_of(request)
    context.rates.take(caller.name)
    reports = reports_of_geosubmit(await _json(request), time.time())
    await run_in_threadpool(_add_reports, context, [one for one in reports if one.position], caller)
    return {}


def _add_reports(context: Context, reports: list[Any], caller: Caller) -> None:
    from radioslam.doors import walk_of_reports

    by_site: dict[str, list[Any]] = {}
    sites = _georeferenced(context)
    for report in reports:
        site_id = _site_around(sites, report.position)
        if site_id is not None:
            by_site.setdefault(site_id, []).append(report)
    for site_id, here in by_site.items():
        body = body_of(walk_of_reports(here, "reports"), context.hide)
        day = time.strftime("%Y%m%d", time.gmtime(min(report.time_s for report in here)))
        name = f"geosubmit-{hashlib.sha256(caller.name.encode()).hexdigest()[:8]}-{day}"
        add_walk(context.database, site_id, NewWalk(name=name), caller)
        _append(context, site_id, name, _in_site_frame(body, dict(sites)[site_id]), caller)


def _append(context: Context, site_id: str, name: str, body: Body, caller: Caller) -> None:
    """Store under a number that the content gives, so that a repeated report counts once."""
    packed, digest = sealed(body)
    number = int(digest[:7], 16)
    while True:
        try:
            context.journal.submit(Incoming(site_id, name, number, packed, digest, caller)).result()
            return
        except ConflictError:
            number += 1
            if number > MOST_SEQUENCE:
                raise


def _georeferenced(context: Context) -> list[tuple[str, tuple[float, float, float]]]:
    with context.database.read() as session:
        rows = session.execute(select(Site.id, Site.georeference).order_by(Site.id)).all()
    return [(site_id, (tie[0], tie[1], tie[2])) for site_id, tie in rows if tie]


def _site_around(
    sites: list[tuple[str, tuple[float, float, float]]], position: tuple[float, float, float]
) -> str | None:
    import numpy as np

    from radioslam.georeference import from_wgs84

    at = np.array([position[:2]])
    away = [(float(np.hypot(*from_wgs84(tie, at)[0])), site_id) for site_id, tie in sites]
    nearest = min(away, default=(np.inf, ""))
    return nearest[1] if nearest[0] <= SITE_REACH_M else None


def _in_site_frame(body: Body, tie: tuple[float, float, float]) -> Body:
    """The fixes of a body in the site's own frame."""
    if not body.get("fixes"):
        return body
    import numpy as np

    from radioslam.georeference import frame_to_wgs84, from_wgs84

    rows = np.array(body["fixes"], dtype=float)
    origin = (*body["origin"], 0.0)
    moved = from_wgs84(tie, frame_to_wgs84(origin, rows[:, 1:]))
    fixes = np.column_stack([rows[:, 0], moved]).tolist()
    return {**{key: value for key, value in body.items() if key != "origin"}, "fixes": fixes}


@router.post("/sites/{site_id}/sensor-logger")
async def sensor_logger(request: Request, site_id: SiteId, message: SensorLoggerMessage, caller: Uploader) -> Accepted:
    """A message of the app Sensor Logger; each session becomes a walk."""
    from radioslam.formats.sensor_logger import walk_of_messages

    context = context_of(request)
    context.rates.take(caller.name)
    kept, dropped = scrubbed(message, context.hide)
    if kept["payload"]:
        await run_in_threadpool(walk_of_messages, [kept], "message")  # refuse now what could not be read later
    name = "sensor-logger-" + re.sub(r"[^A-Za-z0-9._-]", "-", message.sessionId)[:80]
    await run_in_threadpool(add_walk, context.database, site_id, NewWalk(name=name, device=message.deviceId), caller)
    incoming = Incoming(site_id, name, message.messageId, *sealed({"message": kept}), caller)
    duplicate = await asyncio.wrap_future(context.journal.submit(incoming))
    return Accepted(sequence=message.messageId, duplicate=duplicate, dropped_readings=dropped)


def scrubbed(message: SensorLoggerMessage, hide: Hide) -> tuple[Body, int]:
    """The message without names of networks and without networks that opted out; and how many those were."""
    from radioslam.formats.readings import mac_address
    from radioslam.formats.sensor_streams import stream_name
    from radioslam.privacy import may_be_mapped

    payload = []
    for record in message.payload:
        if stream_name(str(record.get("name", ""))) != "wifi":
            payload.append(record)
            continue
        inner = record.get("values")
        fields = {**record, **inner} if isinstance(inner, dict) else dict(record)
        ssid = fields.pop("ssid", None)
        if not may_be_mapped(None if ssid is None else str(ssid)):
            continue
        address = mac_address(str(fields.get("bssid", "")))
        fields["bssid"] = hide(address) if address else str(fields.get("bssid", ""))
        payload.append({key: value for key, value in fields.items() if key != "values"})
    body = {"messageId": message.messageId, "sessionId": message.sessionId, "payload": payload}
    return body, len(message.payload) - len(payload)
