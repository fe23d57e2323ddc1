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
PAGE = REPOSITORY / "docs" / "results.md"
BLOCK = re.compile(r"<!-- (radioslam experiment [^\n]*) -->\n.*?<!-- end -->", re.DOTALL)


def table_of(command: str) -> str:
    data = os.environ.get("RADIOSLAM_DATA", str(REPOSITORY.parent / "shared" / "data"))
    words = command.replace("DATA", data).split()
    script = Path(sys.executable).with_name("radioslam")
    return subprocess.run([script, *words[1:]], check=True, text=True, stdout=subprocess.PIPE).stdout


def main(word: str = "") -> None:
    page = PAGE.read_text("utf-8")
    for command in BLOCK.findall(page):
        if word not in command:
            continue
        print(command, flush=True)
        table = table_of(command)
        head = f"<!-- {command} -->\n"
        before, _, rest = page.partition(head)
        page = f"{before}{head}{table.strip()}\n<!-- end -->{rest.partition('<!-- end -->')[2]}"
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
