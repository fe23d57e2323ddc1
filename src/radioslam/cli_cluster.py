"""Commands and options that take many machines."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from radioslam.cli_options import ConfigFile, Overrides, Preset

if TYPE_CHECKING:
    from radioslam.engine import Engine

Cluster = Annotated[
    str | None,
    typer.Option("--cluster", metavar="ADDRESS", help="A Dask scheduler, tcp://host:port, or local: processes here."),
]
Store = Annotated[
    str | None,
    typer.Option("--store", metavar="URL", help="Folder that all workers reach, such as s3://bucket/folder."),
]


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command("map-sites")(map_sites)


def map_sites(
    sites: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", help="Each folder in these is a site of its own.")
    ],
    cluster: Annotated[str, typer.Option("--cluster", metavar="ADDRESS", help="tcp://host:port, or local.")] = "local",
    out: Annotated[str, typer.Option("--out", "-o", help="Folder or URL; a result folder for each site.")] = "results",
    starts: Annotated[str | None, typer.Option("--starts", help="common, known, unknown or mixed.")] = None,
    preset: Preset = None,
    config: ConfigFile = None,
    set_: Overrides = None,
) -> None:
    """Map many sites in parallel, one JSON line each."""
    from radioslam.cluster import connect
    from radioslam.cluster import map_sites as map_all
    from radioslam.config import load_config
    from radioslam.object_store import ObjectStore

    overrides = [*(set_ or []), *([f"merging.starts={starts}"] if starts else [])]
    effective = load_config(preset, config, overrides)
    folders = sorted(path.absolute() for folder in sites for path in folder.iterdir() if path.is_dir())
    with connect(cluster) as client:
        totals = map_all(client, {path.name: [path] for path in folders}, effective, ObjectStore(out))
    for name, total in totals.items():
        typer.echo(json.dumps({"site": name, **total}))


@contextmanager
def engine_at(address: str | None, store: str | None) -> Iterator[Engine | None]:
    """The engine of a cluster, with a store of its own where none is given; None without an address."""
    if address is None:
        yield None
        return
    from radioslam.cluster import ClusterEngine, connect
    from radioslam.object_store import ObjectStore

    with tempfile.TemporaryDirectory(prefix="radioslam-") as folder, connect(address) as client:
        yield ClusterEngine(client, ObjectStore(store or folder))
