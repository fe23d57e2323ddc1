"""The check of dependencies: what it makes of pip-audit's reports, and that it says so where nobody can be asked."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from subprocess import CompletedProcess
from types import ModuleType

import pytest

PATH = Path(__file__).resolve().parent.parent / ".ci" / "audit.py"
VULNERABLE = {"name": "old", "version": "1.0", "vulns": [{"id": "PYSEC-1", "fix_versions": ["1.1", "2.0"]}]}
SOUND = {"name": "new", "version": "2.0", "vulns": []}
UNKNOWN = {"name": "ours", "skip_reason": "Dependency not found on PyPI"}


@pytest.fixture
def audit() -> ModuleType:
    spec = importlib.util.spec_from_file_location("audit", PATH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def answering(reports):
    """A ``subprocess.run`` whose answer depends on the source that is asked."""

    def run(command, **_):
        source = command[command.index("--vulnerability-service") + 1]
        return CompletedProcess(command, 0, reports.get(source, ""), "a warning\nConnectionError: no route")

    return run


@pytest.mark.parametrize(
    ("reports", "code", "said"),
    [
        ({"pypi": [SOUND, UNKNOWN]}, 0, "audit: 1 packages asked of pypi, 0 vulnerable"),
        ({"pypi": [SOUND, VULNERABLE]}, 1, "old 1.0: PYSEC-1, mended in 1.1, 2.0"),
        ({"pypi": [UNKNOWN], "osv": [VULNERABLE]}, 1, "1 packages asked of osv, 1 vulnerable"),
        ({"pypi": [UNKNOWN]}, 0, "(pypi: knows none of the packages; osv: ConnectionError: no route)"),
        ({}, 0, "audit: skipped, nobody could be asked (pypi: ConnectionError"),
    ],
)
def test_the_first_source_that_knows_the_packages_decides(audit, monkeypatch, capsys, reports, code, said):
    told = {source: json.dumps({"dependencies": packages}) for source, packages in reports.items()}
    monkeypatch.setattr(audit.subprocess, "run", answering(told))
    assert audit.main() == code
    assert said in capsys.readouterr().out


def test_without_pip_audit_the_check_fails(audit, monkeypatch, capsys):
    monkeypatch.setattr(audit.importlib.util, "find_spec", lambda name: None)
    assert audit.main() == 1
    assert "expected pip-audit, found none" in capsys.readouterr().out
