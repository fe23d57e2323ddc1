"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Logs = Annotated[list[Path], typer.Argument(metavar="LOGS...", help="Logs, or folders of logs.", show_default=False)]
Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to write; made whole or not at all.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the folder if it exists.")]
Preset = Annotated[
    str | None, typer.Option("--preset", help="default, or paper: the values of arXiv:1904.11712.", show_default=False)
]
ConfigFile = Annotated[Path | None, typer.Option("--config", help="TOML file with any of the keys.")]
Overrides = Annotated[list[str] | None, typer.Option("--set", metavar="GROUP.KEY=VALUE", help="One key; repeatable.")]
Format = Annotated[str, typer.Option("--format", help="Log format; auto looks at the content.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")]
