"""The database: SQLite by default, PostgreSQL by URL. The one file that knows their differences."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.orm import Session

from radioslam.errors import ConfigError, UnavailableError
from radioslam.server.tables import Table

WAIT_S = 5
"""For a lock or a connection; then the client is told that the database is not there."""
MIGRATIONS = Path(__file__).parent / "migrations"


class Database:
    """Connections to one database."""

    def __init__(self, url: str) -> None:
        self.engine = _engine(url)
        self.embedded = self.engine.dialect.name == "sqlite"
        # SQLite has one writer: waiting in line here is fairer than its busy loop.
        self._turn = threading.Lock() if self.embedded else nullcontext()
        self._writing = self.engine.execution_options(writes=True)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session to read with."""
        with told_simply(), Session(self.engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A transaction: durable when the block ends, undone when it raises."""
        with told_simply(), self._turn, Session(self._writing, expire_on_commit=False) as session, session.begin():
            yield session

    def insert_once(self, session: Session, table: type[Table], **values: Any) -> bool:
        """Insert a row unless its key is there already; whether it was inserted."""
        dialect: Any = sqlite if self.embedded else postgresql
        once = dialect.insert(table).values(**values).on_conflict_do_nothing()
        return session.execute(once.returning(*table.__table__.primary_key)).first() is not None

    def migrate(self) -> None:
        """Bring the tables to this version's shape."""
        from alembic import command
        from alembic.config import Config as AlembicConfig

        config = AlembicConfig()
        config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
        with told_simply(), self._writing.begin() as connection:
            config.attributes["connection"] = connection
            command.upgrade(config, "head")

    def check(self) -> bool:
        """Whether the database answers."""
        try:
            with self.read() as session:
                session.execute(text("SELECT 1"))
        except UnavailableError:
            return False
        return True

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


@contextmanager
def told_simply() -> Iterator[None]:
    """The database's many complaints of not being there as one ``UnavailableError``; the rest are bugs of ours."""
    try:
        yield
    except DBAPIError as error:
        full = "full" in str(error.orig).lower() or "no space" in str(error.orig).lower()
        if full:
            raise UnavailableError(
                "no space left on the service's disk; nothing was stored, try again later"
            ) from error
        if error.connection_invalidated or _passes(error.orig):
            raise UnavailableError("the database does not answer; nothing was stored, try again") from error
        raise


def _passes(error: BaseException | None) -> bool:
    import psycopg

    return isinstance(error, sqlite3.OperationalError | psycopg.OperationalError | psycopg.InterfaceError)


def _engine(url: str) -> Engine:
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() == "sqlite":
            return _sqlite(url)
        if parsed.get_backend_name() == "postgresql":
            wait = {"connect_timeout": WAIT_S, "options": f"-c statement_timeout={WAIT_S}s -c lock_timeout={WAIT_S}s"}
            return create_engine(url, pool_pre_ping=True, pool_size=20, pool_timeout=WAIT_S, connect_args=wait)
    except (ArgumentError, NoSuchModuleError, ValueError):
        pass
    raise ConfigError("expected a database URL sqlite:///FILE or postgresql://USER@HOST/NAME; check --database")


def _sqlite(url: str) -> Engine:
    wait = {"timeout": WAIT_S, "isolation_level": None}  # BEGIN is ours: savepoints and early locks need it
    engine = create_engine(url, pool_size=20, pool_timeout=WAIT_S, connect_args=wait)

    @event.listens_for(engine, "connect")
    def _prepare(connection: sqlite3.Connection, _: object) -> None:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")  # acknowledged is on the disk, even if the power fails
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # what was erased is gone from the file, too

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine
