"""A browser and a service that has a map, for all tests of the page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("fastapi", reason="the service needs radioslam[server]")
pytest.importorskip("playwright", reason="tests of the page need the package playwright")

from playwright.sync_api import Browser, expect

from tests.server.chromium import running_chromium
from tests.server.page.tab import EVIL, PATIENCE_MS, WALKS, send
from tests.server.processes import ServerProcess


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Ends with this package: while it runs there is an event loop, which other tests could not bear."""
    with running_chromium() as one:
        if one is None:
            pytest.skip("no Chromium here and none could be installed (apt-get install chromium)")
        expect.set_options(timeout=PATIENCE_MS)
        yield one


@pytest.fixture(scope="package")
def server(tmp_path_factory) -> Iterator[ServerProcess]:
    """A service with keys and a site ``office`` that has two versions of its map."""
    folder = tmp_path_factory.mktemp("page")
    with ServerProcess(folder / "data", None, "--map-every", "1", keyed=True) as one:
        assert one.ask("/sites", {"id": "office", "title": f"Office {EVIL}", "starts": "common"})[0] == 201
        for walk in WALKS[:3]:
            send(one, walk)
        one.wait_for_map("office")
        send(one, WALKS[3])
        version = len(one.ask("/sites/office/maps")[1])
        one.ask("/sites/office/build", {})
        one.wait_for_map("office", version + 1)
        yield one


@pytest.fixture(scope="package")
def keys(server) -> dict[str, str]:
    """Keys that may less than the admin's."""
    return {role: server.new_key(role) for role in ("read", "upload")}
