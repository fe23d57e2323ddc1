"""A service in this process, on SQLite and on a real PostgreSQL."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("fastapi", reason="the service needs radioslam[server]")

from radioslam.server.settings import Settings
from tests.server.postgres import Postgres, running_postgres
from tests.server.service import Service


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    """A PostgreSQL that runs; tests are skipped where none can be had."""
    with running_postgres() as cluster:
        if cluster is None:
            pytest.skip("no PostgreSQL here and none could be installed (apt-get install postgresql)")
        yield cluster


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request, tmp_path) -> str:
    """An empty database, once of each kind."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'test.sqlite'}"
    return request.getfixturevalue("postgres").new_database()


@pytest.fixture
def service(database_url, tmp_path) -> Iterator[Service]:
    """A service with keys, without a worker, on either database."""
    with Service(Settings(data=tmp_path / "data", database=database_url, worker=False)) as one:
        yield one
