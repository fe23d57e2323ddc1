"""Safe, reachable by keyboard, fit for a phone, and patient."""

from __future__ import annotations

import shutil
import subprocess

import pytest
from playwright.sync_api import expect

from radioslam.server.page_files import FOLDER
from tests.server.page.tab import DESKTOP, EVIL, PHONE, TRACES, WALKS, office, opened, send, unfold, wait_until
from tests.server.processes import ServerProcess

UNNAMED = """[...document.querySelectorAll("button, input, select, textarea, a")]
    .filter((one) => !(one.labels?.length || one.getAttribute("aria-label") || one.textContent.trim()))
    .map((one) => one.outerHTML)"""
FOLDED = ("Upload walks", "Floor image", "Find a position", "Walks")
SCRIPTS = sorted(FOLDER.glob("*.js"))
pytestmark = pytest.mark.slow


def test_names_stay_text_and_nothing_comes_from_elsewhere(browser, server):
    with opened(browser, server, server.key) as page:
        asked, violations = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.expose_function("tell", lambda told: violations.append(told))
        listen = (
            "document.addEventListener('securitypolicyviolation', (e) => tell([e.effectiveDirective, e.sourceFile]))"
        )
        page.add_init_script(listen)
        page.reload()
        page.get_by_role("link", name="Office").click()
        wait_until(page, f"{TRACES}?.length > 0")
        page.locator("[data-layer=heat]").check()
        unfold(page, "Walks")
        expect(page.locator("#walks td", has_text="onerror").first).to_have_text(EVIL)
        expect(page.get_by_role("heading", level=1)).to_contain_text(EVIL)
        assert page.evaluate("window.evil") is None
        assert asked
        assert all(url.startswith((server.url, "data:", "blob:")) for url in asked)
        assert not [one for one in violations if not (one[0].startswith("style") and one[1].endswith("plotly.min.js"))]


def test_the_keyboard_reaches_all(browser, server):
    with office(browser, server) as page:
        page.locator(".map").focus()
        width = "(([low, high]) => high - low)(document.querySelector('.map').layout.xaxis.range)"
        before = page.evaluate(width)
        page.keyboard.press("+")
        wait_until(page, f"{width} < 0.8 * {before}")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("0")
        wait_until(page, f"Math.abs({width} - {before}) < 0.2 * {before}")
        assert page.evaluate(UNNAMED) == []
        page.locator("#key-button").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_be_hidden()


def test_all_of_it_fits_a_desktop(browser, server):
    with office(browser, server, size=DESKTOP) as page:
        for title in FOLDED:
            unfold(page, title)
        assert page.evaluate("document.documentElement.scrollWidth") == DESKTOP["width"]


def test_it_fits_a_phone(browser, server):
    with office(browser, server, size=PHONE) as page:
        for title in ("Layers", *FOLDED):
            unfold(page, title)
        assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        box = page.locator(".map").bounding_box()
        assert box["y"] < 150
        assert box["width"] > 300
        small = (
            "[...document.querySelectorAll('button')].filter((one) => one.offsetParent && one.offsetHeight < 32).length"
        )
        assert page.evaluate(small) == 0


def test_the_page_goes_on_when_the_service_comes_back(browser, tmp_path):
    with ServerProcess(tmp_path / "data", None, "--map-every", "1") as other:
        assert other.ask("/sites", {"id": "a", "starts": "common"})[0] == 201
        with opened(browser, other) as page:
            page.get_by_role("link", name="a", exact=True).click()
            expect(page.locator("#stream")).to_contain_text("Live")
            other.kill()
            expect(page.locator("#stream")).to_contain_text("does not answer")
            other.start()
            for walk in WALKS[:3]:
                send(other, walk, "a")
            expect(page.locator("#stream")).to_contain_text("Live")
            expect(page.locator(".versions output")).to_contain_text("(newest)")


def test_scripts_parse_as_modules():
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node here to check the syntax of the scripts; the browser ran those that it loaded")
    for path in SCRIPTS:
        check = [node, "--input-type=module", "--check"]
        checked = subprocess.run(check, input=path.read_text("utf-8"), capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stderr


def test_scripts_write_no_markup():
    assert len(SCRIPTS) > 20
    for path in SCRIPTS:
        text = path.read_text("utf-8")
        assert not [word for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "eval(") if word in text], path
