"""Sites: make, list, georeference, floor image, live events."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Body, Header, Path, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from radioslam.errors import NotFoundError, ServiceError
from radioslam.georeference import fit_georeference
from radioslam.server.access import Admin, AnyRole, Reader
from radioslam.server.context import context_of
from radioslam.server.messages import Georeference, NewSite, SiteInfo, Slug
from radioslam.server.site_config import check_site
from radioslam.server.store import add_site, find_site
from radioslam.server.tables import Plan, Site, StoredMap, StoredWalk

router = APIRouter(prefix="/sites", tags=["sites"])
SiteId = Annotated[Slug, Path(description="Name of the site.")]
IMAGES = {"image/png": b"\x89PNG\r\n\x1a\n", "image/jpeg": b"\xff\xd8\xff"}


@router.post("", status_code=201, responses={200: {"description": "It was there just so."}})
def make_site(request: Request, response: Response, new: NewSite, _: Admin) -> SiteInfo:
    """Make a site; the same again is no error."""
    context = context_of(request)
    check_site(new)
    if not add_site(context.database, new):
        response.status_code = 200
    with context.database.read() as session:
        return site_info(session, find_site(session, new.id))


@router.get("")
def list_sites(request: Request, _: AnyRole) -> list[SiteInfo]:
    """All sites."""
    with context_of(request).database.read() as session:
        return [site_info(session, site) for site in session.scalars(select(Site).order_by(Site.id))]


@router.get("/{site_id}")
def get_site(request: Request, site_id: SiteId, _: AnyRole) -> SiteInfo:
    """One site."""
    with context_of(request).database.read() as session:
        return site_info(session, find_site(session, site_id))


@router.delete("/{site_id}", status_code=204)
def delete_site(request: Request, site_id: SiteId, _: Admin) -> None:
    """Delete a site with its walks and maps."""
    import shutil

    from radioslam.server.map_views import load

    context = context_of(request)
    with context.database.write() as session:
        find_site(session, site_id)
        session.execute(delete(Site).where(Site.id == site_id))
    shutil.rmtree(context.settings.maps / site_id, ignore_errors=True)
    context.positioners.forget(site_id)
    load.cache_clear()


@router.put("/{site_id}/georeference")
def georeference(request: Request, site_id: SiteId, points: Georeference, _: Admin) -> SiteInfo:
    """Tie the site's frame to latitude and longitude by known points."""
    tie = fit_georeference([(p.x_m, p.y_m, p.latitude_deg, p.longitude_deg) for p in points.points])
    with context_of(request).database.write() as session:
        site = find_site(session, site_id)
        site.georeference = list(tie)
        session.flush()
        return site_info(session, site)


@router.put("/{site_id}/plan", status_code=204)
def put_plan(
    request: Request,
    site_id: SiteId,
    pixel_m: Annotated[float, Query(gt=0, le=1000, description="Metres per pixel.")],
    corner_x_m: Annotated[float, Query(ge=-1e6, le=1e6, description="Of the upper left corner.")],
    corner_y_m: Annotated[float, Query(ge=-1e6, le=1e6)],
    image: Annotated[bytes, Body(media_type="image/png", description="PNG or JPEG.")],
    _: Admin,
) -> None:
    """Lay a floor image under the map."""
    kinds = [kind for kind, magic in IMAGES.items() if image.startswith(magic)]
    if not kinds:
        raise ServiceError("expected a PNG or JPEG image, found something else")
    with context_of(request).database.write() as session:
        find_site(session, site_id)
        place = {"pixel_m": pixel_m, "corner_x_m": corner_x_m, "corner_y_m": corner_y_m}
        session.merge(Plan(site_id=site_id, media_type=kinds[0], image=image, **place))


@router.get("/{site_id}/plan", response_class=Response, responses={200: {"content": {kind: {} for kind in IMAGES}}})
def get_plan(request: Request, site_id: SiteId, _: Reader) -> Response:
    """The floor image; its scale and place stand in headers ``X-Pixel-M``, ``X-Corner-X-M`` and ``X-Corner-Y-M``."""
    with context_of(request).database.read() as session:
        find_site(session, site_id)
        plan = session.get(Plan, site_id)
    if plan is None:
        raise NotFoundError(f"site {site_id!r} has no floor image")
    place = {"X-Pixel-M": plan.pixel_m, "X-Corner-X-M": plan.corner_x_m, "X-Corner-Y-M": plan.corner_y_m}
    return Response(plan.image, media_type=plan.media_type, headers={key: f"{value:g}" for key, value in place.items()})


@router.get("/{site_id}/events", response_class=EventSourceResponse)
async def events(
    request: Request,
    site_id: SiteId,
    _: Reader,
    last_event_id: Annotated[int | None, Header(ge=0, le=2**53)] = None,
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events: ``poses``, ``walk``, ``build``, ``loops``, ``map``, ``position``."""
    live = context_of(request).live
    async with live.watch(site_id, last_event_id) as coming:
        yield ServerSentEvent(comment="watching")
        async for event in coming:
            yield ServerSentEvent(event=event.kind, data=event.data, id=str(event.number))


def site_info(session: Session, site: Site) -> SiteInfo:
    """A site as clients see it."""
    walks = select(func.count()).select_from(StoredWalk).where(StoredWalk.site_id == site.id)
    version = select(func.max(StoredMap.version)).where(StoredMap.site_id == site.id)
    return SiteInfo(
        **{key: getattr(site, key) for key in ("id", "title", "starts", "heading", "overrides", "georeference")},
        walks=session.scalar(walks) or 0,
        map_version=session.scalar(version),
        has_plan=session.scalar(select(Plan.site_id).where(Plan.site_id == site.id)) is not None,
    )
