"""Batches into the database, many in one transaction with a handful of statements."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import bindparam, insert, select, update
from sqlalchemy.orm import Session

from radioslam.errors import ConflictError, ForbiddenError, NotFoundError, RadioSlamError, TooLargeError
from radioslam.server.access import Caller
from radioslam.server.tables import StoredBatch, StoredWalk

_GROW = (
    update(StoredWalk.__table__)  # type: ignore[arg-type]
    .where(StoredWalk.number == bindparam("walk"))
    .values(
        size_bytes=StoredWalk.size_bytes + bindparam("more_bytes"),
        batches=StoredWalk.batches + bindparam("more_batches"),
    )
)
_ADD = insert(StoredBatch.__table__)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Incoming:
    """A batch at the door: for which walk, under which number, and what ``recordings`` made of it."""

    site_id: str
    walk: str
    sequence: int
    body: bytes
    digest: str
    caller: Caller


@dataclass
class _Target:
    """A walk as it stands within the transaction."""

    number: int
    key_name: str
    state: str
    size_bytes: int
    more_bytes: int = 0
    more_batches: int = 0


def write_batches(session: Session, incoming: Sequence[Incoming], most_bytes: int) -> list[bool | RadioSlamError]:
    """For each batch True where it had been accepted before, False where it is now, or the error that refuses it:

    NotFoundError: no such walk.  ForbiddenError: it is another key's.
    ConflictError: the sequence number was accepted with other content, or the walk is closed.
    TooLargeError: the walk would become longer than ``most_bytes``.
    """
    targets = _targets(session, incoming)
    known = _digests(session, [t.number for t in targets.values()], [one.sequence for one in incoming])
    rows: list[dict[str, object]] = []
    answers: list[bool | RadioSlamError] = []
    for one in incoming:
        target = targets.get((one.site_id, one.walk))
        refusal = _refusal(one, target, known, most_bytes)
        if refusal is not None or target is None:
            answers.append(
                refusal or NotFoundError(f"expected the name of a walk of {one.site_id}, found {one.walk!r}")
            )
            continue
        key = (target.number, one.sequence)
        answers.append(key in known)
        if key not in known:
            known[key] = one.digest
            target.more_bytes += len(one.body)
            target.more_batches += 1
            rows.append(_row(one, target.number))
    if rows:
        session.execute(_ADD, rows)
        grown = [target for target in targets.values() if target.more_batches]
        session.execute(
            _GROW, [{"walk": t.number, "more_bytes": t.more_bytes, "more_batches": t.more_batches} for t in grown]
        )
    return answers


def _targets(session: Session, incoming: Sequence[Incoming]) -> dict[tuple[str, str], _Target]:
    """The walks by site and name; locked, so that none is closed or erased meanwhile."""
    columns = (StoredWalk.number, StoredWalk.key_name, StoredWalk.state, StoredWalk.size_bytes)
    query = select(StoredWalk.site_id, StoredWalk.name, *columns).where(
        StoredWalk.site_id.in_({one.site_id for one in incoming}), StoredWalk.name.in_({one.walk for one in incoming})
    )
    rows = session.execute(query.order_by(StoredWalk.number).with_for_update())
    return {(row.site_id, row.name): _Target(row.number, row.key_name, row.state, row.size_bytes) for row in rows}


def _digests(session: Session, walks: Sequence[int], sequences: Sequence[int]) -> dict[tuple[int, int], str]:
    """Digests of what is there already under such numbers."""
    query = select(StoredBatch.walk_number, StoredBatch.sequence, StoredBatch.digest).where(
        StoredBatch.walk_number.in_(walks), StoredBatch.sequence.in_(set(sequences))
    )
    return {(walk, sequence): digest for walk, sequence, digest in session.execute(query)}


def _refusal(
    one: Incoming, target: _Target | None, known: dict[tuple[int, int], str], most_bytes: int
) -> RadioSlamError | None:
    if target is None:
        return None
    if target.key_name != one.caller.name and not one.caller.may("admin"):
        return ForbiddenError(f"walk {one.walk!r} was begun with another key")
    before = known.get((target.number, one.sequence))
    if before is not None:
        told = f"batch {one.sequence} of {one.walk!r} was accepted with other content; use the next number"
        return None if before == one.digest else ConflictError(told)
    if target.state != "open":
        return ConflictError(f"walk {one.walk!r} is {target.state}; begin another")
    if target.size_bytes + target.more_bytes + len(one.body) > most_bytes:
        return TooLargeError(f"expected a walk of at most {most_bytes} bytes; finish {one.walk!r} and begin another")
    return None


def _row(one: Incoming, walk_number: int) -> dict[str, object]:
    return {
        "walk_number": walk_number,
        "sequence": one.sequence,
        "digest": one.digest,
        "body": one.body,
        "received_s": time.time(),
    }
