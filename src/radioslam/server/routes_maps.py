"""Maps: versions, builds, and what the page shows of a version."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi import Path as PathParameter
from sqlalchemy import select, update

from radioslam.errors import NotFoundError, ResultError, UnavailableError
from radioslam.server.access import Admin, Reader
from radioslam.server.context import Context, context_of
from radioslam.server.map_files import FLOORS, GROWING, floor_folder
from radioslam.server.messages import Address, BuildInfo, Label, MapInfo
from radioslam.server.routes_sites import SiteId
from radioslam.server.store import find_site
from radioslam.server.tables import Build, StoredMap

if TYPE_CHECKING:
    from radioslam.results import SlamResult

router = APIRouter(prefix="/sites/{site_id}", tags=["maps"])
Version = Annotated[
    Annotated[int, PathParameter(ge=1, le=2**31 - 1)] | Literal["latest"], PathParameter(description="Or latest.")
]
Floor = Annotated[Label | None, Query(description="Name of the floor; default: the first.")]


@router.get("/build")
def get_build(request: Request, site_id: SiteId, _: Reader) -> BuildInfo:
    """How the making of the map stands."""
    with context_of(request).database.read() as session:
        find_site(session, site_id)
        build = session.get_one(Build, site_id)
        told = {key: getattr(build, key) for key in BuildInfo.model_fields if key != "made"}
        newest = select(StoredMap.summary).where(StoredMap.site_id == site_id).order_by(StoredMap.version.desc())
        summary = session.scalar(newest.limit(1))
        return BuildInfo(**told, made=summary and summary.get("made"))


@router.post("/build", status_code=202)
def want_build(request: Request, site_id: SiteId, caller: Admin) -> BuildInfo:
    """Make the map again of all walks, as soon as the worker is free."""
    with context_of(request).database.write() as session:
        find_site(session, site_id)
        session.execute(update(Build).where(Build.site_id == site_id).values(wanted=True))
    return get_build(request, site_id, caller)


@router.get("/maps")
def list_maps(request: Request, site_id: SiteId, _: Reader) -> list[MapInfo]:
    """All versions, the newest first."""
    query = select(StoredMap).where(StoredMap.site_id == site_id).order_by(StoredMap.version.desc())
    with context_of(request).database.read() as session:
        find_site(session, site_id)
        return [_info(one) for one in session.scalars(query)]


@router.get("/maps/{version}")
def get_map(request: Request, site_id: SiteId, version: Version, _: Reader) -> MapInfo:
    """One version."""
    return _info(find_map(context_of(request), site_id, version))


@router.get("/maps/{version}/paths")
def get_paths(request: Request, site_id: SiteId, version: Version, _: Reader, floor: Floor = None) -> Any:
    """Each walk at its scans: rows of x, y before (``odometry``), after (``estimate``) and in truth (``reference``)."""
    return _view("paths", _result(request, site_id, version, floor))


@router.get("/maps/{version}/loops")
def get_loops(request: Request, site_id: SiteId, version: Version, _: Reader, floor: Floor = None) -> Any:
    """Loops that were kept: both ends, similarity, σ and how far apart they ended."""
    return _view("loops", _result(request, site_id, version, floor))


@router.get("/maps/{version}/access-points")
def get_access_points(request: Request, site_id: SiteId, version: Version, _: Reader, floor: Floor = None) -> Any:
    """Each access point: how often and how strongly it was heard, where it stands, its health."""
    from radioslam.access_points import as_rows

    return as_rows(_result(request, site_id, version, floor).radio_map)


@router.get("/maps/{version}/heat")
def get_heat(
    request: Request,
    site_id: SiteId,
    version: Version,
    _: Reader,
    access_point: Annotated[Address, Query()],
    floor: Floor = None,
) -> Any:
    """One access point's field on a grid: rows of x, y, mean dBm, σ dB, probability of being heard."""
    return _view("heat", _result(request, site_id, version, floor), access_point)


@router.get("/maps/{version}/coverage")
def get_coverage(request: Request, site_id: SiteId, version: Version, _: Reader, floor: Floor = None) -> Any:
    """Where to walk next: rows of x, y and the field's σ in dB, the worst first."""
    return _view("walk_here_next", _result(request, site_id, version, floor))


@router.get("/maps/{version}/errors")
def get_errors(request: Request, site_id: SiteId, version: Version, _: Reader, floor: Floor = None) -> Any:
    """Errors against the references that the walks had."""
    return _view("errors", _result(request, site_id, version, floor))


@router.get("/maps/{version}/files", response_class=Response, responses={200: {"content": {"application/zip": {}}}})
def get_files(request: Request, site_id: SiteId, version: Version, _: Reader) -> Response:
    """The result folders of all floors and the joined radio map, as a zip."""
    folder = _folder(context_of(request), site_id, version)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.relative_to(folder).parts[0] != GROWING:
                archive.write(path, path.relative_to(folder).as_posix())
    name = f"{site_id}-{folder.name}.zip"
    return Response(
        packed.getvalue(),
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
        media_type="application/zip",
    )


def find_map(context: Context, site_id: str, version: int | str) -> StoredMap:
    """A version, or NotFoundError."""
    query = select(StoredMap).where(StoredMap.site_id == site_id).order_by(StoredMap.version.desc()).limit(1)
    if version != "latest":
        query = query.where(StoredMap.version == version)
    with context.database.read() as session:
        found = session.scalar(query)
        if found is None:
            find_site(session, site_id)
            raise NotFoundError(f"expected a version of the map of {site_id!r}, found {version}; see its maps")
        return found


def _folder(context: Context, site_id: str, version: int | str) -> Path:
    return context.settings.maps / site_id / str(find_map(context, site_id, version).version)


def _result(request: Request, site_id: str, version: int | str, floor: str | None) -> SlamResult:
    from radioslam.server.map_views import load

    folder = _folder(context_of(request), site_id, version)
    try:
        floors = json.loads((folder / FLOORS).read_text("utf-8"))
        if not floors:
            raise NotFoundError("expected walks that were mapped, found only positions that were known before")
        if floor is not None and floor not in floors:
            raise NotFoundError(f"expected a floor of {', '.join(map(repr, floors))}, found {floor!r}")
        return load(floor_folder(folder, floors.index(floor) if floor is not None else 0))
    except (OSError, ResultError) as error:
        raise UnavailableError("the map went away while it was read; ask for the latest") from error


def _view(name: str, result: SlamResult, *arguments: str) -> Response:
    from radioslam.server import map_views

    content = map_views.plain(getattr(map_views, name)(result, *arguments))
    return Response(json.dumps(content, allow_nan=False), media_type="application/json")


def _info(one: StoredMap) -> MapInfo:
    return MapInfo(version=one.version, made_s=one.made_s, summary=one.summary)
