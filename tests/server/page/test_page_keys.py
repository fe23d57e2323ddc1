"""Who may see what."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.server.page.tab import opened

pytestmark = pytest.mark.slow


def test_a_key_is_asked_for_and_a_wrong_one_is_refused(browser, server, keys):
    with opened(browser, server) as page:
        expect(page.get_by_role("dialog")).to_be_visible()
        page.locator("#key-input").fill("rs_wrong")
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog").get_by_role("alert")).to_have_text("The service does not know this key.")
        assert page.evaluate("sessionStorage.length") == 0
        page.locator("#key-input").fill(keys["read"])
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="Sites")).to_be_visible()
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(page.locator("#whose")).to_have_text("read (read)")
        assert page.evaluate("[localStorage.length, document.cookie]") == [0, ""]
        expect(page.get_by_text("New site")).to_have_count(0)
        page.get_by_role("button", name="API key").click()
        page.get_by_role("button", name="Forget it").click()
        expect(page.get_by_text("This service needs an API key.")).to_be_visible()


def test_an_uploader_sees_no_map_and_uploads(browser, server, keys):
    with opened(browser, server, keys["upload"]) as page:
        page.get_by_role("link", name="Office").click()
        expect(page.get_by_text("This key may upload walks")).to_be_visible()
        expect(page.locator(".map")).to_have_count(0)
        page.locator("#upload").set_input_files({"name": "x.txt", "mimeType": "text/plain", "buffer": b"hello"})
        expect(page.locator(".uploads .problem")).to_contain_text("x.txt: expected")
