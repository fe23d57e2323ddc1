"""The application, made by a factory."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
from collections.abc import AsyncIterator
from functools import partial

from fastapi import FastAPI

from radioslam.errors import ConfigError
from radioslam.server import (
    problems,
    routes_doors,
    routes_health,
    routes_maps,
    routes_positions,
    routes_sites,
    routes_walks,
)
from radioslam.server.access import KeyMemory
from radioslam.server.context import Context
from radioslam.server.database import Database
from radioslam.server.group_commit import GroupCommit
from radioslam.server.journal import write_batches
from radioslam.server.limits import BodyLimit, Rates
from radioslam.server.live import Broadcast
from radioslam.server.messages import ProblemResponse
from radioslam.server.page_files import mount_page
from radioslam.server.positions import Positioners, Sessions
from radioslam.server.privacy import hider
from radioslam.server.settings import Settings
from radioslam.server.supervisor import Supervisor
from radioslam.server.tables import Fact

ROUTES = (routes_health, routes_sites, routes_walks, routes_maps, routes_positions, routes_doors)
ERRORS = (401, 403, 404, 409, 413, 422, 429, 503)


def create_app(settings: Settings) -> FastAPI:
    """The service on a database that is brought to this version's shape.

    Raises:
        ConfigError: a database URL that cannot be, or addresses stored otherwise than ``hash_bssids`` says.
        UnavailableError: the database does not answer.
    """
    context = _context(settings)
    app = FastAPI(
        title="RadioSLAM",
        version=importlib.metadata.version("radioslam"),
        description="Walks of many phones become a radio map; scans become positions.",
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        lifespan=_lifespan,
        responses={status: {"model": ProblemResponse} for status in ERRORS},
    )
    app.state.context = context
    app.add_middleware(BodyLimit, limits=settings.limits)
    problems.install(app)
    for routes in ROUTES:
        app.include_router(routes.router)
    mount_page(app)
    return app


def _context(settings: Settings) -> Context:
    settings.maps.mkdir(parents=True, exist_ok=True)
    database = Database(settings.database_url)
    try:
        database.migrate()
        _check_hashing(database, settings.hash_bssids)
    except BaseException:
        database.close()
        raise
    live = Broadcast()
    return Context(
        settings=settings,
        database=database,
        journal=GroupCommit(database, partial(write_batches, most_bytes=settings.limits.walk_bytes)),
        hide=hider(settings.data, settings.hash_bssids),
        keys=KeyMemory(),
        rates=Rates(settings.limits.batches_per_s),
        live=live,
        positioners=Positioners(database, settings.maps),
        sessions=Sessions(settings.limits.sessions),
        supervisor=Supervisor(settings, database, live),
    )


def _check_hashing(database: Database, hash_bssids: bool) -> None:
    """Addresses are stored one way from the first start on; both in one map would never meet."""
    wanted = "hashed" if hash_bssids else "plain"
    with database.write() as session:
        database.insert_once(session, Fact, name="addresses", value=wanted)
        stored = session.get_one(Fact, "addresses").value
    if stored != wanted:
        option = "with" if stored == "hashed" else "without"
        raise ConfigError(f"expected a start {option} --hash-bssids: this database has {stored} addresses")


@contextlib.asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    context: Context = app.state.context
    stopping = asyncio.Event()
    watching = asyncio.create_task(context.supervisor.watch(stopping))
    yield
    stopping.set()
    await watching
    context.journal.close()
    context.database.close()
