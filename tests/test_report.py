"""The page stands alone, escapes what users typed, and has all its parts."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from radioslam import report
from radioslam.config import load_config
from radioslam.plots import paths_figure
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.slam import map_walks

EVIL = "</script><script>alert(1)</script>\"'&"


class Page(HTMLParser):
    """Elements with their attributes, and the texts of each kind of element."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.feed(path.read_text("utf-8"))
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in {"meta", "link"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((self.open[-1] if self.open else "", data))

    def text(self, *tags: str) -> str:
        return " ".join(text for tag, text in self.texts if not tags or tag in tags)

    def figures(self) -> list[dict[str, Any]]:
        return [json.loads(text) for tag, text in self.texts if tag == "script" and text.startswith('{"data"')]


@pytest.fixture(scope="module")
def result() -> SlamResult:
    return map_walks(simulate("office", seed=1), load_config("default", environment={}))


@pytest.fixture(scope="module")
def page(result: SlamResult, tmp_path_factory: pytest.TempPathFactory) -> Page:
    path = tmp_path_factory.mktemp("report") / "report.html"
    report.write_report(result, path, {**result.summary(), "peak_memory_mb": 321.4})
    return Page(path)


def test_needs_no_network(page: Page) -> None:
    for tag, attributes in page.elements:
        for name in ("src", "href", "data", "srcset", "action"):
            assert not re.match(r"\s*(https?:)?//", attributes.get(name) or ""), (tag, attributes)
    assert not any(tag in {"iframe", "object", "embed", "base"} for tag, _ in page.elements)
    style = page.text("style")
    assert "@import" not in style
    assert "url(" not in style
    assert sum("plotly.js v" in text for tag, text in page.texts if tag == "script") == 1


def test_has_every_section(page: Page) -> None:
    assert page.open == []
    sections = [attributes["id"] for tag, attributes in page.elements if tag == "section"]
    expected = ["paths", "uncertainty", "coverage", "heat-maps", "access-points", "walks", "run", "configuration"]
    assert sections == expected
    assert len(page.figures()) == 4
    assert "peak memory 321 MB" in page.text("p")


def test_figures_are_those_of_the_result(page: Page, result: SlamResult) -> None:
    drawn = page.figures()[0]
    expected = json.loads(paths_figure(result).to_json())
    assert drawn["data"] == expected["data"]
    assert drawn["layout"]["height"] == expected["layout"]["height"]


def test_tells_the_numbers_with_units(page: Page, result: SlamResult) -> None:
    total = result.summary()["total"]
    text = page.text("p")
    assert f"{len(result.walks)} walks with {len(result.radio_map):,} radio scans" in text
    assert f"errs {total['error']['estimate']['mean']:.1f} m on average" in text
    assert f"odometry alone errs {total['error']['odometry']['mean']:.1f} m" in text
    cells = page.text("td")
    assert all(name in page.text("span") for name in result.walks)
    assert f"{total['error']['estimate']['p95']:.1f} m" in cells
    assert "representation = &quot;" not in page.text("code")
    assert 'representation = "exponential"' in page.text("code")


def test_names_cannot_break_out(result: SlamResult, tmp_path: Path) -> None:
    samples = result.radio_map
    evil = replace(samples, walks=(EVIL, *samples.walks[1:]), transmitters=(EVIL,) * len(samples.transmitters))
    bad = replace(result, radio_map=evil, skipped=((EVIL, EVIL),))
    summary = bad.summary()
    summary["untied"], summary["loops"]["rejected"], summary["seconds"] = [EVIL], {EVIL: 1}, {EVIL: 1.0}
    report.write_report(bad, tmp_path / "report.html", summary)
    page = Page(tmp_path / "report.html")
    assert page.open == []
    scripts = [text for tag, text in page.texts if tag == "script"]
    assert not any(text.startswith("alert") for text in scripts)
    assert sum(tag == "script" for tag, _ in page.elements) == 6
    assert EVIL in page.text("span")  # shown as it was typed
    assert EVIL in page.text("p")
    assert len(page.figures()) == 4


def test_says_what_went_wrong(result: SlamResult, tmp_path: Path) -> None:
    summary = result.summary()
    summary["solver"]["converged"] = False
    summary |= {"untied": ["walk x"], "maps": [{}, {}], "skipped": [{"path": "a.txt", "reason": "no scans"}]}
    report.write_report(result, tmp_path / "report.html", summary)
    text = Page(tmp_path / "report.html").text("p")
    assert "did not converge" in text
    assert "a frame of its own: walk x" in text
    assert "Skipped: a.txt: no scans" in text
    assert "fell into 2 maps" in text


def test_tolerates_a_bare_summary(result: SlamResult, tmp_path: Path) -> None:
    bare = replace(result, references=(None,) * len(result.walks))
    report.write_report(bare, tmp_path / "report.html", {})
    page = Page(tmp_path / "report.html")
    assert page.open == []
    assert "no true positions" in page.text("p")
    assert "reference" not in [trace.get("name") for trace in page.figures()[0]["data"]]
    assert "nan" not in page.text("td", "dd", "p").lower().split()


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (report.length(999.4), "999 m"),
        (report.length(1234.0), "1.23 km"),
        (report.metres(None), "–"),
        (report.metres(float("nan")), "–"),
        (report.duration(119.7), "2:00 min"),
        (report.number(1234567), "1,234,567"),
        (report.count(1, "walk"), "1 walk"),
        (report.count(0, "walk"), "0 walks"),
    ],
)
def test_forms_of_numbers(shown: str, expected: str) -> None:
    assert shown == expected


def test_imports_no_drawing_library_early() -> None:
    code = "import sys, radioslam.report, radioslam.plots; print({'plotly', 'matplotlib'} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "set()"
