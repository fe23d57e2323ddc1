"""A tab of the browser on the page, and what tests find in it."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager

from radioslam.server.replay import batches
from radioslam.simulator import simulate

WALKS = simulate("office", seed=1, walks=5)
DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
PATIENCE_MS = 60_000
EVIL = "<img src=x onerror='window.evil=1'>"
TRACES = "document.querySelector('.map')?.data"


def send(server, walk, site="office"):
    place = f"/sites/{site}/walks"
    assert server.ask(place, {"name": walk.name, "device": EVIL})[0] in (200, 201)
    sent = [batch for _, batch in batches(walk, 30.0)]
    for batch in sent:
        assert server.ask(f"{place}/{walk.name}/batches", batch)[0] == 200
    assert server.ask(f"{place}/{walk.name}/finish", {"batches": len(sent)})[0] == 200


@contextmanager
def opened(browser, server, key=None, size=DESKTOP):
    """A tab on the page; whatever its scripts throw fails the test."""
    page = browser.new_page(viewport=size)
    page.set_default_timeout(PATIENCE_MS)
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    if key is not None:
        page.add_init_script(f"sessionStorage.setItem('radioslam-key', {json.dumps(key)})")
    page.goto(server.url)
    try:
        yield page
    finally:
        page.close()
    assert errors == []


@contextmanager
def office(browser, server, key=None, size=DESKTOP):
    """A tab on the site, with its map drawn."""
    with opened(browser, server, key or server.key, size) as page:
        page.get_by_role("link", name="Office").click()
        wait_until(page, f"{TRACES}?.some((trace) => trace.x?.length > 9)")
        yield page


def wait_until(page, expression, argument=None):
    """Playwright's own way to wait for an expression needs eval, which the page's policy forbids."""
    until_s = time.monotonic() + PATIENCE_MS / 1000
    while not page.evaluate(expression, argument):
        assert time.monotonic() < until_s, expression
        page.wait_for_timeout(100)


def unfold(page, title):
    page.locator("details", has_text=title).filter(has=page.locator(f"h2:text-is('{title}')")).locator(
        "summary"
    ).click()
