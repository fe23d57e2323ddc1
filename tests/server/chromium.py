"""A real Chromium for tests of the page: Debian's, installed if need be, driven by Playwright."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tests.server.debian import install

if TYPE_CHECKING:
    from playwright.sync_api import Browser

NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = ("--disable-gpu", "--disable-dev-shm-usage")


def find_chromium() -> str | None:
    """Its program; installed from Debian's packages where there is none and we may."""
    for attempt in range(2):
        found = next((path for name in NAMES if (path := shutil.which(name))), None)
        if found is not None:
            return found
        if attempt == 0 and not install("chromium", "fonts-dejavu-core"):
            break
    return None


@contextlib.contextmanager
def running_chromium() -> Iterator[Browser | None]:
    """A browser without a window, or None where there is no Chromium. While it runs, this thread has an event loop."""
    from playwright.sync_api import sync_playwright

    program = find_chromium()
    if program is None:
        yield None
        return
    sandbox = () if os.geteuid() else ("--no-sandbox",)  # Chromium as root has none
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=[*OPTIONS, *sandbox])
        try:
            yield browser
        finally:
            browser.close()
