"""A service in this process, and what a client says to it."""

from __future__ import annotations

from typing import Any

from starlette.testclient import TestClient

from radioslam.server.app import create_app
from radioslam.server.context import Context
from radioslam.server.keys import add_key
from radioslam.server.settings import Settings
from radioslam.server.worker import Worker
from radioslam.walk import Walk

ROLES = ("upload", "read", "admin")


class Service:
    """The application with a key for each role; ``post`` and friends speak as an admin unless told otherwise."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.app = create_app(settings)
        self.client = TestClient(self.app, raise_server_exceptions=False)
        self.keys = {role: add_key(self.context.database, role, role) for role in ROLES}

    @property
    def context(self) -> Context:
        return self.app.state.context

    def __enter__(self) -> Service:
        self.client.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.client.__exit__()

    def ask(self, method: str, path: str, role: str = "admin", expect: int | None = None, **options: Any) -> Any:
        headers = {"Authorization": f"Bearer {self.keys[role]}", **options.pop("headers", {})}
        response = self.client.request(method, path, headers=headers, **options)
        if expect is not None:
            assert response.status_code == expect, response.text
        return response

    def get(self, path: str, **options: Any) -> Any:
        return self.ask("GET", path, expect=200, **options).json()

    def post(self, path: str, body: Any = None, expect: int | None = None, **options: Any) -> Any:
        return self.ask("POST", path, json=body, expect=expect, **options)

    def make_site(self, site: str = "office", starts: str = "common", **more: Any) -> None:
        self.post("/sites", {"id": site, "starts": starts, **more}, expect=201)

    def send_walk(self, walk: Walk, site: str = "office", role: str = "upload", **more: Any) -> None:
        """A walk in batches, as a phone sends it."""
        from radioslam.server.replay import batches

        self.post(f"/sites/{site}/walks", {"name": walk.name, **more}, expect=201, role=role)
        sent = [batch for _, batch in batches(walk, 30.0)]
        for batch in sent:
            self.post(f"/sites/{site}/walks/{walk.name}/batches", batch, expect=200, role=role)
        self.post(f"/sites/{site}/walks/{walk.name}/finish", {"batches": len(sent)}, expect=200, role=role)

    def build(self) -> None:
        """Make the maps that are due, in this process."""
        worker = Worker(self.settings)
        worker.run_once()
        worker.database.close()
