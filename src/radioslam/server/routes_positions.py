"""Positions: one scan, and phones that are followed."""

from __future__ import annotations

import time
from typing import Annotated

from fastapi import APIRouter, Request
from fastapi import Path as PathParameter
from pydantic import StringConstraints
from starlette.concurrency import run_in_threadpool

from radioslam.errors import PositioningError
from radioslam.georeference import frame_to_wgs84
from radioslam.privacy import may_be_mapped
from radioslam.server.access import Reader
from radioslam.server.context import Context, context_of
from radioslam.server.messages import LocateRequest, LocationInfo, Reading, TrackRequest
from radioslam.server.positions import Followed, Ready
from radioslam.server.privacy import Hide
from radioslam.server.routes_sites import SiteId
from radioslam.server.store import find_site

router = APIRouter(prefix="/sites/{site_id}", tags=["positions"])
SessionName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,64}$"), PathParameter()]


@router.post("/locate")
async def locate(request: Request, site_id: SiteId, asked: LocateRequest, _: Reader) -> LocationInfo:
    """Where a scan was made: position, standard deviations, 95 % radius, floor; or why it is not here."""
    context = context_of(request)
    answer = await run_in_threadpool(locate_scan, context, site_id, asked.readings)
    _tell(context, site_id, "", answer)
    return answer


@router.post("/sessions", status_code=201)
async def begin_session(request: Request, site_id: SiteId, caller: Reader) -> dict[str, str]:
    """Begin to follow a phone."""
    context = context_of(request)
    await run_in_threadpool(_check_site, context, site_id)
    return {"session": context.sessions.begin(site_id, caller.name)}


@router.post("/sessions/{session}")
async def advance_session(
    request: Request, site_id: SiteId, session: SessionName, sent: TrackRequest, caller: Reader
) -> LocationInfo:
    """Where a followed phone is now, from all that it sent of late."""
    context = context_of(request)
    answer = await run_in_threadpool(_advance, context, site_id, session, sent, caller.name)
    _tell(context, site_id, session, answer)
    return answer


def locate_scan(context: Context, site_id: str, readings: list[Reading]) -> LocationInfo:
    """One scan in the newest map of a site."""
    ready = context.positioners.get(site_id)
    scan = strengths(readings, context.hide)
    if not scan:
        return LocationInfo(here=False, map_version=ready.version, reason="not here: no reading that may be used")
    return with_degrees(context, site_id, located(ready, scan))


def located(ready: Ready, scan: dict[str, float]) -> LocationInfo:
    """The position of strengths by stored address, in metres."""
    location = ready.positioner.locate(scan)
    if location.position_xy is None:
        return LocationInfo(here=False, map_version=ready.version, reason=location.reason)
    return LocationInfo(
        here=True,
        map_version=ready.version,
        x_m=location.position_xy[0],
        y_m=location.position_xy[1],
        sigma_x_m=location.sigma_xy[0],
        sigma_y_m=location.sigma_xy[1],
        radius_m=location.radius_m,
        floor=location.floor,
        floor_probability=location.floor_probability,
    )


def strengths(readings: list[Reading], hide: Hide) -> dict[str, float]:
    """Address as it is stored -> RSS in dBm, the stronger where one stands twice."""
    scan: dict[str, float] = {}
    for reading in readings:
        if may_be_mapped(reading.ssid):
            name = hide(reading.bssid)
            scan[name] = max(reading.rssi_dbm, scan.get(name, reading.rssi_dbm))
    return scan


def with_degrees(context: Context, site_id: str, info: LocationInfo) -> LocationInfo:
    """With latitude and longitude where the site has them."""
    with context.database.read() as session:
        tie = find_site(session, site_id).georeference
    if tie is None or not info.here:
        return info
    import numpy as np

    latitude, longitude = frame_to_wgs84((tie[0], tie[1], tie[2]), np.array([[info.x_m, info.y_m]], float))[0]
    return info.model_copy(update={"latitude_deg": float(latitude), "longitude_deg": float(longitude)})


def _advance(context: Context, site_id: str, name: str, sent: TrackRequest, owner: str) -> LocationInfo:
    session = context.sessions.find(name, site_id, owner)
    ready = context.positioners.get(site_id)
    poses = {p.time_s: (p.x_m, p.y_m, p.heading_rad) for p in sent.poses}
    scans = {s.time_s: strengths(s.readings, context.hide) for s in sent.scans}
    try:
        followed = context.sessions.advance(session, ready.positioner, poses, scans)
    except PositioningError as error:
        return LocationInfo(here=False, map_version=ready.version, reason=str(error))
    return with_degrees(context, site_id, _followed(followed, ready.version))


def _followed(followed: Followed, version: int) -> LocationInfo:
    x, y, heading = (float(value) for value in followed.pose)
    return LocationInfo(
        here=True,
        map_version=version,
        x_m=x,
        y_m=y,
        heading_rad=heading,
        sigma_x_m=followed.sigma_m,
        sigma_y_m=followed.sigma_m,
        radius_m=followed.radius_m,
        floor=followed.floor,
    )


def _check_site(context: Context, site_id: str) -> None:
    with context.database.read() as session:
        find_site(session, site_id)


def _tell(context: Context, site_id: str, session: str, answer: LocationInfo) -> None:
    if answer.here and context.live.watchers:
        told = answer.model_dump(include={"x_m", "y_m", "sigma_x_m", "sigma_y_m", "radius_m", "floor"})
        context.live.publish(site_id, "position", {"session": session[:8], "time_s": time.time(), **told})
