"""Known vulnerabilities in requirements.lock, by pip-audit, where a source of advisories can be reached.

Ends with 1 where there are any, with 0 and one line where there are none or where nobody could be asked.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

LOCK = Path(__file__).resolve().parent.parent / "requirements.lock"
SOURCES = ("pypi", "osv")
PATIENCE_S = 12.0


class AuditError(Exception):
    """A source of advisories that could not be asked."""


def ask(source: str) -> list[dict[str, Any]]:
    """Every package of the lock file that this source knows, with its vulnerabilities.

    Raises:
        AuditError: the source knows none, or did not answer; with what pip-audit said last.
    """
    options = ["--require-hashes", "--disable-pip", "--progress-spinner", "off", "--format", "json", "--timeout", "5"]
    command = [sys.executable, "-m", "pip_audit", *options, "--vulnerability-service", source, "-r", str(LOCK)]
    try:
        told = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
        packages = known(json.loads(told.stdout))
    except subprocess.TimeoutExpired:
        raise AuditError(f"{source}: no answer in {PATIENCE_S:g} s") from None
    except ValueError:
        raise AuditError(f"{source}: {(told.stderr.strip() or 'no report').splitlines()[-1][:200]}") from None
    if not packages:
        raise AuditError(f"{source}: knows none of the packages")
    return packages


def known(report: dict[str, Any]) -> list[dict[str, Any]]:
    """The packages of a report that were looked up; those that a source does not know have a reason instead."""
    return [package for package in report["dependencies"] if "skip_reason" not in package]


def findings(packages: list[dict[str, Any]]) -> list[str]:
    """A line per vulnerability."""
    return [
        f"{one['name']} {one['version']}: {found['id']}, mended in {', '.join(found['fix_versions']) or 'no version'}"
        for one in packages
        for found in one["vulns"]
    ]


def main() -> int:
    """Ask the sources in turn until one answers."""
    if importlib.util.find_spec("pip_audit") is None:
        print("audit: expected pip-audit, found none; renew .venv")
        return 1
    reasons = []
    for source in SOURCES:
        try:
            packages = ask(source)
        except AuditError as error:
            reasons.append(str(error))
            continue
        lines = findings(packages)
        print("\n".join([f"audit: {len(packages)} packages asked of {source}, {len(lines)} vulnerable", *lines]))
        return int(bool(lines))
    print(f"audit: skipped, nobody could be asked ({'; '.join(reasons)})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
