"""What the map shows is what the service says."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from playwright.sync_api import expect

from radioslam.formats import write_walk
from tests.server.page.tab import TRACES, WALKS, office, opened, unfold, wait_until

pytestmark = pytest.mark.slow


def test_a_replay_arrives_and_the_map_grows(browser, server, tmp_path):
    for walk in WALKS[:3]:
        write_walk(walk, tmp_path / "logs")
    with opened(browser, server, server.key) as page:
        expect(page.get_by_role("heading", name="Sites")).to_be_visible()
        page.locator("summary", has_text="New site").click()
        page.get_by_label("Short name").fill("live")
        page.get_by_label("Where walks begin").select_option("common")
        page.get_by_role("button", name="Make the site").click()
        expect(page.locator("#stream")).to_contain_text("Live")
        expect(page.locator(".versions output")).to_contain_text("no map yet")
        options = ["--to", server.url, "--site", "live", "--starts", "common", "--speed", "8", "--key", server.key]
        replay = subprocess.Popen(
            [sys.executable, "-m", "radioslam", "replay", str(tmp_path / "logs"), *options], stdout=subprocess.DEVNULL
        )
        try:
            expect(page.locator("#arriving li").first).to_contain_text("scan")
            coming = f"{TRACES}?.some((trace) => trace.text?.some((text) => text.endsWith('coming in')))"
            wait_until(page, coming)
            wait_until(page, "document.querySelector('#version').max >= 1")
            assert replay.wait(120) == 0
        finally:
            replay.kill()
            replay.wait()
        expect(page.locator("#arriving li")).to_have_count(0)
        newest = f"{TRACES}.flatMap((trace) => trace.text ?? []).join()"
        for walk in WALKS[:3]:
            wait_until(page, f"{newest}.includes('{walk.name}')")


def test_the_slider_goes_back_in_time_and_follows_again(browser, server):
    with office(browser, server) as page:
        told = page.locator(".versions output")
        expect(told).to_contain_text("(newest)")
        page.locator("#version").focus()
        page.keyboard.press("Home")
        expect(told).to_contain_text("1, ")
        first = server.ask("/sites/office/maps/1/errors")[1]["total"]["scans"]
        expect(page.locator("#errors tbody tr").first.locator("td").first).to_have_text(str(first))
        page.keyboard.press("End")
        expect(told).to_contain_text("(newest)")


def test_layers_show_what_the_service_says(browser, server, keys):
    with office(browser, server, keys["read"]) as page:
        version = server.ask("/sites/office/maps/latest")[1]["version"]
        paths = server.ask(f"/sites/office/maps/{version}/paths")[1]
        gaps = server.ask(f"/sites/office/maps/{version}/coverage")[1]
        loops = server.ask(f"/sites/office/maps/{version}/loops")[1]
        for layer in ("odometry", "truth", "sigma", "loops", "gaps", "access-points"):
            page.locator(f"[data-layer={layer}]").check()
        has_x = f"(x) => {TRACES}.some((trace) => trace.x.includes(x))"
        for x in (paths[0]["estimate"][5][0], paths[0]["odometry"][5][0], paths[0]["reference"][5][0], gaps[0][0]):
            wait_until(page, has_x, x)
        middles = f"{TRACES}.find((trace) => trace.marker?.symbol === 'diamond').marker.color.length"
        assert page.evaluate(middles) == len(loops["rows"])
        expect(page.locator(".legend").first).to_contain_text("similarity")
        page.get_by_label("Coloured by").select_option("residual")
        expect(page.locator(".legend").first).to_contain_text("residual")
        row = page.locator("#errors tbody tr").first
        errors = server.ask(f"/sites/office/maps/{version}/errors")[1]["total"]["errors"]
        expect(row.locator("td").nth(2)).to_have_text(f"{errors['estimate']['mean']:.1f} m")


def test_the_access_point_is_switched(browser, server, keys):
    with office(browser, server, keys["read"]) as page:
        expect(page.locator("#access-point option")).not_to_have_count(0)
        heat = f"{TRACES}.find((trace) => trace.type === 'heatmap')"  # none while it is loading
        strongest = f"Math.max(...({heat}?.z.flat().filter(Boolean) ?? []))"
        for number in (3, 0):
            page.locator("#access-point").select_option(index=number)
            name = page.locator("#access-point").input_value()
            rows = server.ask(f"/sites/office/maps/latest/heat?access_point={name}")[1]["rows"]
            expected = max(row[2] for row in rows if row[4] >= 0.5)
            wait_until(page, f"Math.abs({strongest} - {expected}) < 1e-9")


def test_a_position_is_read_and_shown(browser, server, keys):
    scan = WALKS[0].wifi.as_dicts()[4]
    truth = server.ask("/sites/office/maps/latest/paths")[1][0]["estimate"][4]
    with office(browser, server, keys["read"]) as page:
        unfold(page, "Find a position")
        page.locator("#scan").fill("not JSON")
        page.get_by_role("button", name="Where is this?").click()
        expect(page.get_by_text("expected JSON of access point and strength")).to_be_visible()
        page.locator("#scan").fill(json.dumps(scan))
        page.get_by_role("button", name="Where is this?").click()
        expect(page.locator("#position")).to_contain_text("with 95 %")
        star = f"{TRACES}.find((trace) => trace.marker?.symbol === 'star')"
        wait_until(page, f"{star}.x.length > 0")
        x, y = page.evaluate(f"[{star}.x[0], {star}.y[0]]")
        assert abs(x - truth[0]) < 15
        assert abs(y - truth[1]) < 15
        expect(page.locator("#position")).to_contain_text(f"x {x:.1f} m, y {y:.1f} m")
