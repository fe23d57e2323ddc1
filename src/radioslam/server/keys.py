"""API keys: made here, shown once, stored as hashes.

A secret has 256 random bits, so that one round of SHA-256 hides it; slow hashes are for what people choose.
"""

from __future__ import annotations

import hashlib
import secrets
import time

from sqlalchemy import delete, select

from radioslam.errors import ConfigError
from radioslam.server.database import Database
from radioslam.server.messages import Role
from radioslam.server.tables import Key

PREFIX = "rs_"
ROLES: tuple[Role, ...] = ("upload", "read", "admin")


def secret_hash(secret: str) -> str:
    """What is stored of a key."""
    return hashlib.sha256(secret.encode("utf-8", "replace")).hexdigest()


def add_key(database: Database, name: str, role: str) -> str:
    """Make a key; its secret is known only now.

    Raises:
        ConfigError: no such role, a name that cannot be one, or one that is taken.
    """
    if role not in ROLES:
        raise ConfigError(f"expected a role of {', '.join(ROLES)}, found {role!r}")
    if not 0 < len(name) <= 100 or not name.isprintable():
        raise ConfigError(f"expected a name of 1 to 100 printable characters, found {name!r}")
    secret = PREFIX + secrets.token_urlsafe(32)
    with database.write() as session:
        made = database.insert_once(
            session, Key, name=name, role=role, secret_sha256=secret_hash(secret), created_s=time.time()
        )
    if not made:
        raise ConfigError(f"expected a new name, found a key called {name!r}; remove it first")
    return secret


def list_keys(database: Database) -> list[Key]:
    """All keys by name."""
    with database.read() as session:
        return list(session.scalars(select(Key).order_by(Key.name)))


def remove_key(database: Database, name: str) -> None:
    """Forget a key; servers that run follow within seconds.

    Raises:
        ConfigError: there is none of this name.
    """
    with database.write() as session:
        found = session.execute(delete(Key).where(Key.name == name).returning(Key.name)).all()
    if not found:
        raise ConfigError(f"expected the name of a key, found {name!r}; see `radioslam keys list`")


def find_key(database: Database, secret: str) -> tuple[str, str] | None:
    """Name and role of the key with this secret."""
    with database.read() as session:
        row = session.execute(select(Key.name, Key.role).where(Key.secret_sha256 == secret_hash(secret))).first()
    return (row[0], row[1]) if row else None
