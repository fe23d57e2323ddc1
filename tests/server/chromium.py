"""A real Chromium for tests of the page: Debian's, installed if need be, driven by Playwright."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from typing import TYPE_CHECKING

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
        if attempt == 0 and not _install():
            break
    return None


def _install() -> bool:
    if shutil.which("apt-get") is None or os.geteuid() != 0:
        return False
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    install = ["apt-get", "install", "-q", "-y", "--no-install-recommends", "chromium", "fonts-dejavu-core"]
    for command in (["apt-get", "update", "-q"], install):
        if subprocess.run(command, env=environment, capture_output=True, timeout=900, check=False).returncode:
            return False
    return True


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
