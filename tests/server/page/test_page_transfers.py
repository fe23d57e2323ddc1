"""Files in and out: walks, a floor image, results."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib

import pytest
from playwright.sync_api import expect

from radioslam.formats import write_walk
from tests.server.page.tab import WALKS, office, unfold, wait_until

pytestmark = pytest.mark.slow


def png(width, height):
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    rows = zlib.compress(b"".join(b"\0" + b"\xa0\xc0\xe0" * width for _ in range(height)))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def zipped(walk, folder):
    target = write_walk(walk, folder)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for path in sorted(target.iterdir()):
            archive.write(path, f"{walk.name}/{path.name}")
    return {"name": f"{walk.name}.zip", "mimeType": "application/zip", "buffer": packed.getvalue()}


def test_files_are_uploaded_and_bad_ones_say_why(browser, server, tmp_path):
    with office(browser, server) as page:
        unfold(page, "Upload walks")
        log = zipped(WALKS[4], tmp_path)
        page.locator("#upload").set_input_files(log)
        told = page.locator(".uploads li")
        expect(told.first).to_contain_text(f"1 walk taken in: {WALKS[4].name}")
        page.locator("#upload").set_input_files(log)
        expect(told.first).to_contain_text("1 walk there before")
        broken = {**log, "name": "broken.zip", "buffer": log["buffer"][:2000]}
        page.locator("#upload").set_input_files(broken)
        expect(told.first.locator(".problem")).to_contain_text("broken.zip: expected")
        unfold(page, "Walks")
        expect(page.locator("#walks th", has_text=WALKS[4].name)).to_be_visible()


def test_files_can_be_dropped(browser, server):
    with office(browser, server) as page:
        unfold(page, "Upload walks")
        drop = """(zone) => {
            const dropped = new DataTransfer();
            dropped.items.add(new File(["no log"], "dropped.csv"));
            zone.dispatchEvent(new DragEvent("drop", { dataTransfer: dropped, bubbles: true, cancelable: true }));
        }"""
        page.locator(".drop").evaluate(drop)
        expect(page.locator(".uploads li").first).to_contain_text("dropped.csv")
        expect(page.locator(".uploads .problem")).to_contain_text("expected")


def test_a_floor_image_lies_under_the_map_in_its_size(browser, server):
    with office(browser, server) as page:
        unfold(page, "Floor image")
        image = {"name": "plan.png", "mimeType": "image/png", "buffer": b"no image"}
        page.locator("#plan-file").set_input_files(image)
        page.get_by_role("button", name="Lay it under the map").click()
        expect(page.get_by_text("found something that is none")).to_be_visible()
        page.locator("#plan-file").set_input_files({**image, "buffer": png(200, 100)})
        page.get_by_label("Width of the image in metres").fill("40")
        page.get_by_label("y in metres").fill("-12")
        page.get_by_role("button", name="Lay it under the map").click()
        place = "document.querySelector('.map').layout.images[0]"
        wait_until(page, f"{place}?.sizex === 40")
        assert page.evaluate(f"[{place}.x, {place}.y, {place}.sizey]") == [0, 8, 20]
        expect(page.locator(".imagelayer image")).to_have_count(1)


def test_results_are_downloaded(browser, server, keys, tmp_path):
    with office(browser, server, keys["read"]) as page:
        with page.expect_download() as coming:
            page.locator("#download").click()
        coming.value.save_as(tmp_path / coming.value.suggested_filename)
    (path,) = tmp_path.iterdir()
    assert path.name.startswith("office-")
    assert "floor-0/trajectories.csv" in zipfile.ZipFile(path).namelist()


def test_a_walk_is_left_out_and_taken_back(browser, server):
    with office(browser, server) as page:
        unfold(page, "Walks")
        name = WALKS[1].name
        page.get_by_role("button", name=f"leave out: {name}").click()
        again = page.get_by_role("button", name=f"take back: {name}")
        expect(again).to_be_visible()
        assert server.ask(f"/sites/office/walks/{name}")[1]["state"] == "withdrawn"
        again.click()
        expect(page.get_by_role("button", name=f"leave out: {name}")).to_be_visible()
