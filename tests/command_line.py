"""The command line in this process, as the script calls it."""

from __future__ import annotations

import sys

import pytest

from radioslam import cli


def run(capsys, *arguments: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of one call."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["radioslam", *map(str, arguments)])
        try:
            cli.main()
            code: object = 0
        except SystemExit as stop:
            code = stop.code
    output = capsys.readouterr()
    if isinstance(code, str):  # sys.exit(message): the interpreter prints it and exits with 1
        return 1, output.out, code
    return int(str(code or 0)), output.out, output.err
