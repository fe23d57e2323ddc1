"""Positioners of the newest maps, kept ready, and the sessions of phones that are followed."""

from __future__ import annotations

import secrets
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select

from radioslam import planar
from radioslam.config import load_config
from radioslam.errors import ConflictError, NotFoundError, PositioningError
from radioslam.server.database import Database
from radioslam.server.map_files import RADIO_MAP
from radioslam.server.store import find_site
from radioslam.server.tables import StoredMap
from radioslam.walk import RadioScans, Signal, Walk

if TYPE_CHECKING:
    from radioslam.positioning import Positioner

Array = NDArray[np.float64]

KEPT_SITES = 16
WINDOW_SCANS = 40
"""A session looks back so far."""
SESSION_S = 3600.0
SEED = 1
RADIUS_PER_SIGMA = float(np.sqrt(-2 * np.log(0.05)))
"""95 % of a round Gaussian lie within so many standard deviations per axis (Rayleigh)."""


@dataclass(frozen=True)
class Ready:
    """A version of a map made ready."""

    version: int
    positioner: Positioner


class Positioners:
    """The newest map of each site; while a newer one is made ready, the old one answers."""

    def __init__(self, database: Database, maps: Path) -> None:
        self._database, self._maps = database, maps
        self._ready: OrderedDict[str, Ready] = OrderedDict()
        self._making: dict[str, threading.Lock] = {}

    def get(self, site_id: str) -> Ready:
        """The site's positioner.

        Raises:
            NotFoundError: no such site.  ConflictError: it has no map yet.
        """
        newest = self._newest(site_id)
        ready = self._ready.get(site_id)
        if ready is not None and ready.version == newest:
            return ready
        lock = self._making.setdefault(site_id, threading.Lock())
        if ready is not None and ready.version < newest:
            if not lock.locked():
                threading.Thread(target=self._make, args=(site_id, newest, lock), daemon=True).start()
            return ready
        return self._make(site_id, newest, lock)

    def forget(self, site_id: str) -> None:
        """Drop what is kept of a site that was deleted."""
        self._ready.pop(site_id, None)

    def _newest(self, site_id: str) -> int:
        query = select(StoredMap.version).where(StoredMap.site_id == site_id).order_by(StoredMap.version.desc())
        with self._database.read() as session:
            version = session.scalar(query.limit(1))
            if version is None:
                find_site(session, site_id)
                raise ConflictError(f"site {site_id!r} has no map yet; send walks and wait for one")
        return version

    def _make(self, site_id: str, version: int, lock: threading.Lock) -> Ready:
        with lock:
            ready = self._ready.get(site_id)
            if ready is None or ready.version != version:
                from radioslam.positioning import Positioner
                from radioslam.radio_map import RadioMap

                path = self._maps / site_id / str(version) / RADIO_MAP
                ready = Ready(version, Positioner.of(RadioMap.load(path)))
                self._ready[site_id] = ready
                while len(self._ready) > KEPT_SITES:
                    self._ready.popitem(last=False)
        return ready


@dataclass
class _Session:
    site_id: str
    owner: str
    used_s: float
    poses: dict[float, tuple[float, float, float]] = field(default_factory=dict)
    scans: dict[float, dict[str, float]] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)


@dataclass(frozen=True)
class Followed:
    """Where a followed phone is: ``pose`` (3,) in the map's frame, ``sigma_m`` per axis."""

    pose: Array
    sigma_m: float
    floor: str

    @property
    def radius_m(self) -> float:
        """Within it lies the truth with 95 %."""
        return self.sigma_m * RADIUS_PER_SIGMA


class Sessions:
    """Phones that are followed; in memory only, a phone begins anew when it is told that its session is unknown."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._sessions: OrderedDict[str, _Session] = OrderedDict()
        self._lock = threading.Lock()

    def begin(self, site_id: str, owner: str) -> str:
        """A new session's name."""
        name = secrets.token_urlsafe(16)
        with self._lock:
            self._sessions[name] = _Session(site_id, owner, time.monotonic())
            while len(self._sessions) > self._most:
                self._sessions.popitem(last=False)
        return name

    def find(self, name: str, site_id: str, owner: str) -> _Session:
        """A session, or NotFoundError."""
        with self._lock:
            session = self._sessions.get(name)
            old = session is not None and time.monotonic() - session.used_s > SESSION_S
            if session is None or old or (session.site_id, session.owner) != (site_id, owner):
                raise NotFoundError("expected a session that is followed; begin a new one")
            session.used_s = time.monotonic()
            self._sessions.move_to_end(name)
        return session

    @staticmethod
    def advance(
        session: _Session,
        positioner: Positioner,
        poses: dict[float, tuple[float, float, float]],
        scans: dict[float, dict[str, float]],
    ) -> Followed:
        """Take in what the phone sent and tell where it is at its newest pose.

        Raises:
            PositioningError: no scan yet belongs to the map, or none came with motion around it.
        """
        with session.lock:
            session.poses |= poses
            session.scans |= {time_s: scan for time_s, scan in scans.items() if scan}
            _forget(session)
            return _follow(session, positioner)


def _forget(session: _Session) -> None:
    for time_s in sorted(session.scans)[:-WINDOW_SCANS]:
        del session.scans[time_s]
    first_s = min(session.scans, default=-np.inf)
    before = sorted(time_s for time_s in session.poses if time_s < first_s)
    for time_s in before[:-2]:
        del session.poses[time_s]


def _follow(session: _Session, positioner: Positioner) -> Followed:
    from radioslam.following import follow_live

    pose_s = np.array(sorted(session.poses))
    scans = {t: s for t, s in session.scans.items() if len(pose_s) and pose_s[0] <= t <= pose_s[-1]}
    if len(pose_s) < 2 or not scans:
        raise PositioningError("expected two poses and a scan between them; send more")
    odometry = np.array([session.poses[time_s] for time_s in pose_s])
    readings = [(time_s, name, rss) for time_s, scan in scans.items() for name, rss in scan.items()]
    wifi = RadioScans.from_readings(*zip(*readings, strict=True))
    walk = Walk("session", wifi, odometry=Signal(pose_s, odometry))
    walked = follow_live(positioner, walk, load_config(environment={}), SEED)
    since = planar.between(planar.interpolate(pose_s, odometry, walked.time_s[-1:])[0], odometry[-1])
    return Followed(planar.compose(walked.poses[-1], since), float(walked.sigma_m[-1]), walked.floor)
