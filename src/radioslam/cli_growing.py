"""Commands that grow a result folder: walks come in and leave, one at a time."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from radioslam.incremental import AddedWalk, GrowingMap

GROWING = "growing"
"""Folder within a result folder that holds what the map needs to grow."""

Result = Annotated[Path, typer.Argument(metavar="RESULT", help="A result folder; it is replaced.", show_default=False)]
Rebuild = Annotated[
    str, typer.Option("--rebuild", help="Full optimization afterwards: auto, where it pays; always; or never.")
]


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command()(add)
    app.command()(remove)


def add(
    result: Result,
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, or folders of logs.")],
    format: Annotated[str, typer.Option("--format", help="Log format; auto looks at the content.")] = "auto",
    rebuild: Rebuild = "auto",
) -> None:
    """Lay new walks into a map, one JSON line each: how well it is known where they were, or why it is not."""
    from radioslam.formats import read_walks

    walks = read_walks(logs, format=format)
    _grow(result, rebuild, lambda grown: [_line(grown.add(walk)) for walk in walks])


def remove(
    result: Result,
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="Names of walks in the map.")],
    rebuild: Rebuild = "auto",
) -> None:
    """Take walks out of a map, which is then what it would have been without them."""

    def work(grown: GrowingMap) -> list[dict[str, Any]]:
        for name in names:
            grown.remove(name)
        return [{"removed": name} for name in names]

    _grow(result, rebuild, work)


def _grow(folder: Path, rebuild: str, work: Callable[[GrowingMap], list[dict[str, Any]]]) -> None:
    """Change the map of a result folder and put the new folder in its place."""
    from radioslam.errors import ConfigError
    from radioslam.growing_folder import write_growing_parts
    from radioslam.result_folder import whole_folder, write_parts

    if rebuild not in ("auto", "always", "never"):
        raise ConfigError(f"expected --rebuild auto, always or never, found {rebuild!r}")
    grown = _load(folder)
    lines = work(grown)
    rebuilt = rebuild == "always" or (rebuild == "auto" and grown.worth_rebuilding)
    if rebuilt:
        grown.rebuild()
    with whole_folder(folder, force=True) as partial:
        write_parts(grown.result(), partial, None)
        (partial / GROWING).mkdir()
        write_growing_parts(grown, partial / GROWING)
    for line in lines:
        typer.echo(json.dumps(line))
    typer.echo(json.dumps({"walks": len(grown.walks), "rebuilt": rebuilt}))


def _load(folder: Path) -> GrowingMap:
    """The map of a result folder; where it never grew, its optimized paths stand for its walks' odometry."""
    from dataclasses import replace

    from radioslam.extending import walks_of
    from radioslam.incremental import GrowingMap
    from radioslam.results import SlamResult

    if (folder / GROWING).is_dir():
        return GrowingMap.load(folder / GROWING)
    result = SlamResult.load(folder)
    told = zip(walks_of(result.radio_map), result.devices, strict=True)
    grown = GrowingMap.of(result, [replace(walk, device=device) for walk, device in told])
    grown.judge_by(dict(zip(result.walks, result.references, strict=True)))
    return grown


def _line(added: AddedWalk) -> dict[str, Any]:
    sigma_m = float(added.sigma_m.mean()) if added.tied else None
    return {
        "walk": added.name,
        "tied": added.tied,
        "reason": added.reason or None,
        "scans": len(added.poses),
        "loops": added.loops,
        "sigma_m": sigma_m,
    }
