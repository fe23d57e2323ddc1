"""The process that makes maps: ``python -m radioslam.server.worker``, started and watched by the server.

It looks for sites whose walks changed, makes a map of each in a new folder, and only then enters the version in the
database: whoever reads finds the old map or the new one, whole. It ends when its standard input does, that is with the
server, however that ended.
"""

from __future__ import annotations

import logging
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from radioslam.errors import RadioSlamError, UnavailableError
from radioslam.result_folder import whole_folder
from radioslam.server.database import Database
from radioslam.server.map_files import GROWING
from radioslam.server.mapping import make_map
from radioslam.server.settings import Settings
from radioslam.server.site_config import site_config
from radioslam.server.site_walks import SiteWalks
from radioslam.server.store import stamp
from radioslam.server.tables import Build, Site, StoredMap

LOOK_EVERY_S = 0.5
MOST_ATTEMPTS = 3
"""A map whose making killed the worker so often is given up until its walks change."""
NICENESS = 10
_log = logging.getLogger("radioslam.server.worker")


class Worker:
    """Makes the maps of one database into one folder."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.database = settings, Database(settings.database_url)

    def recover(self) -> None:
        """What was running when the last worker died is to be made again, or given up after some attempts."""
        with self.database.write() as session:
            for build in session.scalars(select(Build).where(Build.state == "running")):
                died = f"the worker died {build.attempts} times at {build.step or 'its begin'}"
                build.state = "failed" if build.attempts >= MOST_ATTEMPTS else "idle"
                build.message, build.wanted = died, build.state == "idle"
        for partial in self.settings.maps.glob("*/.*"):
            shutil.rmtree(partial, ignore_errors=True)

    def run_once(self) -> int:
        """Make the maps that are due; how many were tried."""
        with self.database.read() as session:
            sites = list(session.scalars(select(Site).order_by(Site.id)))
            due = [(site, stamp(session, site)) for site in sites]
            due = [(site, now) for site, now in due if self._is_due(session.get(Build, site.id), now)]
        for site, now in due:
            self._build(site, now)
        return len(due)

    def _is_due(self, build: Build | None, now: str) -> bool:
        if build is None or build.state == "running":
            return False
        waited = time.time() - build.changed_s >= self.settings.map_every_s
        return build.wanted or (build.built != now and waited and not now.endswith(":0"))

    def _build(self, site: Site, now: str) -> None:
        ordered = self._begin(site.id, now)
        try:
            self._make(site, ordered)
        except UnavailableError:
            raise
        except RadioSlamError as error:
            _log.warning("site %s: %s", site.id, error)
            self._tell(site.id, state="failed", message=str(error)[:1000])
        except Exception as error:  # a bug must not stop the maps of other sites
            _log.exception("site %s", site.id)
            self._tell(site.id, state="failed", message=f"the mapping failed ({type(error).__name__}); see the log")
        self._forget_old(site.id)

    def _begin(self, site_id: str, now: str) -> bool:
        """Enter that a map is being made; whether somebody ordered it."""
        with self.database.write() as session:
            build = session.get_one(Build, site_id)
            ordered = build.wanted
            build.attempts = build.attempts + 1 if build.built == now else 1
            build.state, build.wanted, build.built, build.step = "running", False, now, "reading walks"
            build.message, build.changed_s = "", time.time()
        return ordered

    def _make(self, site: Site, ordered: bool) -> None:
        with self.database.read() as session:
            before = self._before(session, site)
            version = session.get_one(Build, site.id).version + 1
        target = self.settings.maps / site.id / str(version)
        shutil.rmtree(target, ignore_errors=True)  # of an attempt that was not entered
        config = site_config(site.starts, site.heading, site.overrides)
        tell: Callable[[str], None] = lambda step: self._tell(site.id, step=step)  # noqa: E731
        with whole_folder(target, force=False) as folder:
            walks = SiteWalks(self.database, site.id)
            made = make_map(walks, config, folder, tell, "it was ordered" if ordered else before)
        with self.database.write() as session:
            session.add(
                StoredMap(
                    site_id=site.id,
                    version=version,
                    revision=site.revision,
                    made_s=time.time(),
                    summary=made.summary(),
                )
            )
            build = session.get_one(Build, site.id)
            build.state, build.step, build.attempts, build.changed_s = "idle", "", 0, time.time()
            build.version = version

    def _before(self, session: Session, site: Site) -> Path | str:
        """The version to grow from, or why none is."""
        query = select(StoredMap.version, StoredMap.revision).where(StoredMap.site_id == site.id)
        newest = session.execute(query.order_by(StoredMap.version.desc()).limit(1)).first()
        if newest is None:
            return "it is the first"
        if newest.revision < site.erased_revision:
            return "walks were erased"
        return self.settings.maps / site.id / str(newest.version)

    def _tell(self, site_id: str, **values: object) -> None:
        with self.database.write() as session:
            session.execute(update(Build).where(Build.site_id == site_id).values(**values, changed_s=time.time()))

    def _forget_old(self, site_id: str) -> None:
        """Remove versions beyond the number kept, those that hold erased walks, and what older ones would grow from."""
        with self.database.write() as session:
            site = session.get(Site, site_id)
            versions = select(StoredMap.version, StoredMap.revision).where(StoredMap.site_id == site_id)
            rows = session.execute(versions.order_by(StoredMap.version.desc())).all()
            erased = site.erased_revision if site else 0
            gone = [v for k, (v, revision) in enumerate(rows) if k >= self.settings.keep_maps or revision < erased]
            session.execute(delete(StoredMap).where(StoredMap.site_id == site_id, StoredMap.version.in_(gone)))
        kept = [str(version) for version, _ in rows if version not in gone]
        for folder in (self.settings.maps / site_id).glob("*"):
            if folder.name not in kept:
                shutil.rmtree(folder, ignore_errors=True)
            elif folder.name != kept[0]:
                shutil.rmtree(folder / GROWING, ignore_errors=True)


def _end_with_server() -> None:
    """Standard input is a pipe that the server holds; it closes when the server is gone, even by ``kill -9``."""
    sys.stdin.buffer.read()
    os._exit(0)


def main() -> None:
    """Work until the server ends; a database that is away is waited for."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s: %(message)s")
    settings = Settings.model_validate_json(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_server, daemon=True).start()
    os.nice(NICENESS)
    worker = Worker(settings)
    recovered = False
    while True:
        try:
            if not recovered:
                worker.recover()
                recovered = True
            worker.run_once()
        except UnavailableError as error:
            _log.warning("%s", error)
            recovered = False
        time.sleep(LOOK_EVERY_S)


if __name__ == "__main__":
    main()
