"""Sites, walks and batches in the database."""

from __future__ import annotations

import time
from collections.abc import Sequence

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from radioslam.errors import ConflictError, ForbiddenError, NotFoundError
from radioslam.server.access import Caller
from radioslam.server.database import Database
from radioslam.server.messages import NewSite, NewWalk
from radioslam.server.recordings import Body, assembled, unpacked
from radioslam.server.tables import Build, Site, StoredBatch, StoredWalk
from radioslam.walk import Walk

SHOWN_SEQUENCES = 20


def find_site(session: Session, site_id: str) -> Site:
    """The site of this name, or NotFoundError."""
    site = session.get(Site, site_id)
    if site is None:
        raise NotFoundError(f"expected the name of a site, found {site_id!r}; see /sites")
    return site


def find_walk(session: Session, site_id: str, name: str) -> StoredWalk:
    """The walk of this name, or NotFoundError."""
    walk = session.scalar(select(StoredWalk).where(StoredWalk.site_id == site_id, StoredWalk.name == name))
    if walk is None:
        find_site(session, site_id)
        raise NotFoundError(f"expected the name of a walk of {site_id}, found {name!r}")
    return walk


def add_site(database: Database, new: NewSite) -> bool:
    """Make a site, or find it made just so; whether it is new.

    Raises:
        ConflictError: a site of this name is otherwise.
    """
    wanted = new.model_dump()
    with database.write() as session:
        now_s = time.time()
        made = database.insert_once(
            session, Site, **wanted, georeference=None, revision=0, erased_revision=0, created_s=now_s
        )
        if made:
            session.add(Build(site_id=new.id))
            return True
        site = find_site(session, new.id)
        if any(getattr(site, key) != value for key, value in wanted.items()):
            raise ConflictError(f"a site {new.id!r} with other settings exists; choose another id")
        return False


def add_walk(database: Database, site_id: str, new: NewWalk, caller: Caller) -> bool:
    """Begin a walk, or find it begun by the same key just so; whether it is new.

    Raises:
        NotFoundError: no such site.
        ConflictError: a walk of this name is otherwise, or of another key.
    """
    about = {"contributor": new.contributor or caller.name, "device": new.device, "floor": new.floor}
    with database.write() as session:
        find_site(session, site_id)
        made = database.insert_once(
            session,
            StoredWalk,
            site_id=site_id,
            name=new.name,
            key_name=caller.name,
            **about,
            state="open",
            size_bytes=0,
            batches=0,
            created_s=time.time(),
        )
        if not made:
            walk = find_walk(session, site_id, new.name)
            if walk.key_name != caller.name or any(getattr(walk, key) != value for key, value in about.items()):
                raise ConflictError(f"a walk {new.name!r} that is not the same exists; choose another name")
        return made


def _own(walk: StoredWalk, caller: Caller) -> StoredWalk:
    if walk.key_name != caller.name and not caller.may("admin"):
        raise ForbiddenError(f"walk {walk.name!r} was begun with another key")
    return walk


def finish(database: Database, site_id: str, name: str, batches: int | None, caller: Caller) -> StoredWalk:
    """Close a walk, once batches 0 … ``batches`` - 1 are there; a second time changes nothing.

    Raises:
        NotFoundError: no such walk.  ForbiddenError: it is another key's.
        ConflictError: batches are missing, or it was withdrawn.
    """
    with database.write() as session:
        walk = _own(find_walk(session, site_id, name), caller)
        if walk.state == "withdrawn":
            raise ConflictError(f"walk {name!r} was withdrawn")
        missing = _missing(session, walk, batches or 0)
        if missing:
            raise ConflictError(f"walk {name!r} lacks batches {missing}; send them and finish again")
        if walk.state == "open":
            walk.state = "finished"
            _changed(session, site_id)
        return walk


def _missing(session: Session, walk: StoredWalk, batches: int) -> str:
    if batches <= walk.batches and not batches:
        return ""
    query = select(StoredBatch.sequence).where(StoredBatch.walk_number == walk.number, StoredBatch.sequence < batches)
    there = set(session.scalars(query))
    gap = [str(k) for k in range(min(batches, len(there) + SHOWN_SEQUENCES)) if k not in there]
    return ", ".join(gap[:SHOWN_SEQUENCES]) + (", …" if batches - len(there) > SHOWN_SEQUENCES else "")


def withdraw(database: Database, site_id: str, name: str, withdrawn: bool) -> StoredWalk:
    """Leave a walk out of the map, or take it back in."""
    with database.write() as session:
        walk = find_walk(session, site_id, name)
        if (walk.state == "withdrawn") != withdrawn:
            walk.state = "withdrawn" if withdrawn else "finished"
            _changed(session, site_id)
        return walk


def erase_walks(database: Database, walks: Sequence[StoredWalk]) -> None:
    """Delete walks with all their batches; maps that hold them go with the next build."""
    with database.write() as session:
        for walk in walks:
            session.execute(delete(StoredWalk).where(StoredWalk.number == walk.number))
        for site_id in {walk.site_id for walk in walks}:
            site = _changed(session, site_id)
            site.erased_revision = site.revision
            session.execute(update(Build).where(Build.site_id == site_id).values(wanted=True))


def walks_of(database: Database, contributor: str) -> list[StoredWalk]:
    """All walks of a contributor, at all sites."""
    query = select(StoredWalk).where(StoredWalk.contributor == contributor)
    with database.read() as session:
        return list(session.scalars(query.order_by(StoredWalk.site_id, StoredWalk.name)))


def load_walk(session: Session, walk: StoredWalk) -> Walk:
    """A walk put together from its batches."""
    query = select(StoredBatch.body).where(StoredBatch.walk_number == walk.number).order_by(StoredBatch.sequence)
    bodies: list[Body] = [unpacked(body) for body in session.scalars(query)]
    return assembled(walk.name, bodies, walk.device, walk.floor)


def stamp(session: Session, site: Site) -> str:
    """What tells two states of a site's walks apart."""
    query = select(func.count(), func.coalesce(func.sum(StoredWalk.batches), 0)).where(
        StoredWalk.site_id == site.id, StoredWalk.state != "withdrawn"
    )
    walks, batches = session.execute(query).one()
    return f"{site.revision}:{walks}:{batches}"


def _changed(session: Session, site_id: str) -> Site:
    site = find_site(session, site_id)
    session.execute(update(Site).where(Site.id == site_id).values(revision=Site.revision + 1))
    session.refresh(site)
    return site
