"""The database's tables. Times are Unix seconds; bodies of batches are deflated JSON (see ``recordings``)."""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

NAMING = {
    "ix": "ix_%(column_0_label)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s",
    "pk": "pk_%(table_name)s",
}


class Table(DeclarativeBase):
    """Base of all tables."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map = {str: String(200), int: BigInteger, float: Float(53), bytes: LargeBinary}  # noqa: RUF012


class Key(Table):
    """An API key; only the hash of its secret is kept."""

    __tablename__ = "keys"
    name: Mapped[str] = mapped_column(primary_key=True)
    role: Mapped[str]
    secret_sha256: Mapped[str] = mapped_column(unique=True)
    created_s: Mapped[float]


class Fact(Table):
    """What was decided once for the whole database."""

    __tablename__ = "facts"
    name: Mapped[str] = mapped_column(primary_key=True)
    value: Mapped[str]


class Site(Table):
    """A building or a floor. ``revision`` grows whenever walks are finished, withdrawn or erased.

    Maps older than ``erased_revision`` hold walks that were erased; they are removed with the next build.
    """

    __tablename__ = "sites"
    id: Mapped[str] = mapped_column(primary_key=True)
    title: Mapped[str]
    starts: Mapped[str]
    heading: Mapped[str]
    overrides: Mapped[list[str]] = mapped_column(JSON)
    georeference: Mapped[list[float] | None] = mapped_column(JSON)
    revision: Mapped[int] = mapped_column(default=0)
    erased_revision: Mapped[int] = mapped_column(default=0)
    created_s: Mapped[float]


class Plan(Table):
    """A site's floor image; ``corner`` is its upper left corner in the map's frame."""

    __tablename__ = "plans"
    site_id: Mapped[str] = mapped_column(ForeignKey("sites.id", ondelete="CASCADE"), primary_key=True)
    media_type: Mapped[str]
    image: Mapped[bytes]
    pixel_m: Mapped[float]
    corner_x_m: Mapped[float]
    corner_y_m: Mapped[float]


class StoredWalk(Table):
    """A walk; ``state`` is open, finished or withdrawn."""

    __tablename__ = "walks"
    __table_args__ = (UniqueConstraint("site_id", "name"), Index("ix_walks_contributor", "contributor"))
    number: Mapped[int] = mapped_column(
        BigInteger().with_variant(Integer, "sqlite"), primary_key=True, autoincrement=True
    )
    site_id: Mapped[str] = mapped_column(ForeignKey("sites.id", ondelete="CASCADE"))
    name: Mapped[str]
    contributor: Mapped[str]
    key_name: Mapped[str]
    device: Mapped[str]
    floor: Mapped[str]
    state: Mapped[str] = mapped_column(default="open")
    size_bytes: Mapped[int] = mapped_column(default=0)
    batches: Mapped[int] = mapped_column(default=0)
    created_s: Mapped[float]


class StoredBatch(Table):
    """A batch, once for each sequence number that a client gave."""

    __tablename__ = "batches"
    walk_number: Mapped[int] = mapped_column(ForeignKey("walks.number", ondelete="CASCADE"), primary_key=True)
    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    digest: Mapped[str]
    body: Mapped[bytes]
    received_s: Mapped[float]


class StoredMap(Table):
    """A version of a site's map; its result is the folder ``<site>/<version>`` below the maps."""

    __tablename__ = "maps"
    site_id: Mapped[str] = mapped_column(ForeignKey("sites.id", ondelete="CASCADE"), primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    revision: Mapped[int]
    made_s: Mapped[float]
    summary: Mapped[dict[str, Any]] = mapped_column(JSON)


class Build(Table):
    """How the making of a site's map stands; ``state`` is idle, running or failed.

    ``built`` is the stamp of the walks that the last attempt was made of, ``attempts`` counts those at the same;
    ``version`` is the last number given to a map, which is never given again.
    """

    __tablename__ = "builds"
    site_id: Mapped[str] = mapped_column(ForeignKey("sites.id", ondelete="CASCADE"), primary_key=True)
    state: Mapped[str] = mapped_column(default="idle")
    wanted: Mapped[bool] = mapped_column(default=False)
    step: Mapped[str] = mapped_column(default="")
    built: Mapped[str] = mapped_column(default="")
    attempts: Mapped[int] = mapped_column(default=0)
    version: Mapped[int] = mapped_column(default=0)
    message: Mapped[str] = mapped_column(String(1000), default="")
    changed_s: Mapped[float] = mapped_column(default=0.0)
