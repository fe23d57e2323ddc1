"""``radioslam add`` and ``remove`` as people type them."""

from __future__ import annotations

import json

import pytest

from radioslam.formats import write_walk
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from tests.command_line import run


@pytest.fixture
def survey(tmp_path, capsys):
    """A result of six walks, and the logs of two more."""
    for name, walks in (("logs", slice(0, 6)), ("new", slice(6, 8))):
        (tmp_path / name).mkdir()
        for walk in simulate("office", seed=1, walks=8)[walks]:
            write_walk(walk, tmp_path / name)
    code, _, error = run(capsys, "map", tmp_path / "logs", "--starts", "known", "--out", tmp_path / "result", "-q")
    assert (code, error) == (0, "")
    return tmp_path


def test_walks_are_added_and_removed(survey, capsys):
    result = survey / "result"
    code, output, _ = run(capsys, "add", result, survey / "new", "--rebuild", "never")
    first, second, last = (json.loads(line) for line in output.splitlines())
    assert code == 0
    assert first["tied"]
    assert second["tied"]
    assert last == {"walks": 8, "rebuilt": False}
    grown = SlamResult.load(result)
    assert {first["walk"], second["walk"]} <= set(grown.walks)
    assert grown.summary()["total"]["error"]["estimate"]["mean"] < 4.0
    code, output, _ = run(capsys, "remove", result, first["walk"])
    assert code == 0
    assert json.loads(output.splitlines()[-1])["walks"] == 7
    assert first["walk"] not in SlamResult.load(result).walks


def test_a_full_optimization_follows_where_it_pays(survey, capsys):
    code, output, _ = run(capsys, "add", survey / "result", survey / "new")
    assert code == 0
    assert json.loads(output.splitlines()[-1]) == {"walks": 8, "rebuilt": True}


def test_a_wrong_name_changes_nothing(survey, capsys):
    before = {path: path.read_bytes() for path in (survey / "result").rglob("*") if path.is_file()}
    code, _, error = run(capsys, "remove", survey / "result", "nobody")
    assert code == 1
    assert "expected a walk of the map, found 'nobody'" in error
    code, _, error = run(capsys, "add", survey / "result", survey / "new", "--rebuild", "perhaps")
    assert code == 1
    assert "auto, always or never" in error
    assert before == {path: path.read_bytes() for path in (survey / "result").rglob("*") if path.is_file()}
