"""The tables that migrations make are those of the code; bad URLs are told; what cannot be reached is unavailable."""

from __future__ import annotations

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import inspect

from radioslam.errors import ConfigError, UnavailableError
from radioslam.server.database import Database
from radioslam.server.group_commit import GroupCommit
from radioslam.server.settings import Settings
from radioslam.server.tables import Fact, Table


@pytest.fixture
def database(database_url):
    one = Database(Settings(database=database_url).database_url)
    one.migrate()
    yield one
    one.close()


def test_migrations_lead_to_the_tables(database):
    database.migrate()  # a second time changes nothing
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Table.metadata) == []
        assert set(inspect(connection).get_table_names()) == {*Table.metadata.tables, "alembic_version"}


def test_what_raises_is_undone(database):
    def write_and_fail():
        with database.write() as session:
            session.add(Fact(name="a", value="1"))
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_and_fail()
    with database.read() as session:
        assert session.get(Fact, "a") is None


def test_insert_once(database):
    for expected in (True, False):
        with database.write() as session:
            assert database.insert_once(session, Fact, name="a", value="1") is expected


def test_refused_items_spoil_no_other_and_failures_reach_everybody(database):
    def write(session, items):
        if "bug" in items:
            raise RuntimeError("bug")
        for item in items:
            if item != "refused":
                session.add(Fact(name=item, value=""))
        return [ConfigError("refused") if item == "refused" else item for item in items]

    group = GroupCommit(database, write)
    futures = {name: group.submit(name) for name in ("a", "refused", "b")}
    assert (futures["a"].result(10), futures["b"].result(10)) == ("a", "b")
    with pytest.raises(ConfigError):
        futures["refused"].result(10)
    with pytest.raises(RuntimeError):
        group.submit("bug").result(10)
    assert group.submit("after").result(10) == "after"
    group.close()
    with database.read() as session:
        assert {fact.name for fact in session.query(Fact)} == {"a", "b", "after"}


@pytest.mark.parametrize("url", ["", "nonsense", "mysql://a/b", "sqlite:/x:y", "postgresql://u@h:port/x"])
def test_urls_that_cannot_be(url):
    with pytest.raises(ConfigError, match="expected a database URL"):
        Database(url)


def test_a_database_that_is_not_there():
    database = Database(Settings(database="postgresql://nobody@127.0.0.1:1/none").database_url)
    with pytest.raises(UnavailableError, match="does not answer"):
        database.migrate()
    assert not database.check()
    database.close()
