"""``make experiments``: run every command that docs/results.md names, and put its table below it.

A block begins with ``<!-- radioslam experiment … -->`` and ends with ``<!-- end -->``; DATA stands for the folder of
recordings. ``python -m benchmarks.results crowd`` runs only the commands with that word in them.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
PAGES = [REPOSITORY / "docs" / name for name in ("results.md", "positioning.md")]
BLOCK = re.compile(r"<!-- (radioslam experiment [^\n]*) -->\n.*?<!-- end -->", re.DOTALL)


def table_of(command: str) -> str:
    data = os.environ.get("RADIOSLAM_DATA", str(REPOSITORY.parent / "shared" / "data"))
    words = command.replace("DATA", data).split()
    script = Path(sys.executable).with_name("radioslam")
    return subprocess.run([script, *words[1:]], check=True, text=True, stdout=subprocess.PIPE).stdout


def renew(path: Path, word: str) -> None:
    page = path.read_text("utf-8")
    for command in BLOCK.findall(page):
        if word not in command:
            continue
        print(command, flush=True)
        table = table_of(command)
        head = f"<!-- {command} -->\n"
        before, _, rest = page.partition(head)
        page = f"{before}{head}{table.strip()}\n<!-- end -->{rest.partition('<!-- end -->')[2]}"
        path.write_text(page, "utf-8")


def main(word: str = "") -> None:
    for path in PAGES:
        renew(path, word)


if __name__ == "__main__":
    main(*sys.argv[1:])
