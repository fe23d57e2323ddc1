"""The walks of a site as the worker takes them from the database, and what tells their states apart."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import Select, select

from radioslam.errors import LogError
from radioslam.server.database import Database
from radioslam.server.store import load_walk
from radioslam.server.tables import StoredWalk
from radioslam.walk import Walk


@dataclass(frozen=True)
class Recorded:
    """A walk as stored: ``stamp`` tells its states apart; ``walk`` is None where it cannot be read, for ``reason``."""

    name: str
    stamp: str
    walk: Walk | None
    reason: str = ""


@dataclass(frozen=True)
class SiteWalks:
    """All walks of a site but those withdrawn."""

    database: Database
    site_id: str

    def stamps(self) -> dict[str, str]:
        """What tells the states of each walk apart, by name."""
        with self.database.read() as session:
            return {one.name: stamp_of(one) for one in session.scalars(self._query())}

    def load(self, names: Collection[str]) -> list[Recorded]:
        """Those of these names that are still there, as they are now."""
        recorded = []
        with self.database.read() as session:
            for one in session.scalars(self._query()).all():
                if one.name not in names:
                    continue
                try:
                    recorded.append(Recorded(one.name, stamp_of(one), load_walk(session, one)))
                except LogError as error:
                    recorded.append(Recorded(one.name, stamp_of(one), None, str(error)))
        return recorded

    def _query(self) -> Select[StoredWalk]:
        walks = select(StoredWalk).where(StoredWalk.site_id == self.site_id, StoredWalk.state != "withdrawn")
        return walks.order_by(StoredWalk.name)


def stamp_of(walk: StoredWalk) -> str:
    """Batches are only ever added, each once; one that was erased and begun again was made at another time."""
    return f"{walk.created_s!r}:{walk.batches}:{walk.size_bytes}"
