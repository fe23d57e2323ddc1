"""Commands of the service: serve it, its API keys, and phones replayed against it."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from radioslam.errors import ConfigError

if TYPE_CHECKING:
    from radioslam.server.database import Database

DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        "--database",
        envvar="RADIOSLAM_DATABASE",
        help="postgresql://USER@HOST/NAME or sqlite:///FILE; default: SQLite in --data.",
    ),
]
Data = Annotated[Path, typer.Option("--data", help="Folder of maps and the embedded database.")]
DEFAULT_DATA = Path("radioslam-data")
KEY_VARIABLE = "RADIOSLAM_KEY"
EXTRA = ("alembic", "fastapi", "httpx2", "psycopg", "sqlalchemy", "uvicorn")

keys = typer.Typer(help="API keys of the service.", no_args_is_help=True, add_completion=False, rich_markup_mode=None)


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command()(serve)
    app.command()(replay)
    app.command("serve-demo")(serve_demo)
    app.add_typer(keys, name="keys")


def serve(
    database: DatabaseUrl = None,
    data: Data = DEFAULT_DATA,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any that is free.")] = 8000,
    open_: Annotated[bool, typer.Option("--open", help="No keys are needed; on loopback only.")] = False,
    hash_bssids: Annotated[bool, typer.Option("--hash-bssids", help="Store keyed hashes of addresses.")] = False,
    map_every: Annotated[float, typer.Option(min=0.1, help="Seconds between two maps of a site.")] = 60.0,
    batches_per_s: Annotated[float, typer.Option(min=0.1, help="Of one key, on average.")] = 200.0,
) -> None:
    """Serve: phones upload walks, the map grows, everybody is positioned."""
    _need_extra()
    from radioslam.server.serving import serve as run
    from radioslam.server.settings import Limits, Settings

    settings = Settings(
        data=data,
        database=database,
        open=open_,
        hash_bssids=hash_bssids,
        map_every_s=map_every,
        limits=Limits(batches_per_s=batches_per_s),
    )
    run(settings, host, port, lambda address: typer.echo(f"radioslam serves at {address}"))


def replay(
    logs: Annotated[list[Path], typer.Argument(metavar="LOGS...", help="Logs, or folders of logs.")],
    to: Annotated[str, typer.Option("--to", metavar="URL", help="Address of the service.")],
    site: Annotated[str, typer.Option(help="Name of the site; made if there is none and the key may.")] = "replay",
    starts: Annotated[str, typer.Option(help="common, known, unknown or mixed; of a site that is made.")] = "unknown",
    speed: Annotated[float, typer.Option(min=0.01, help="Times as fast as it was walked.")] = 1.0,
    phones: Annotated[int | None, typer.Option(min=1, help="Phones at a time; default: one per walk.")] = None,
    duration: Annotated[
        float | None, typer.Option(min=1, help="Seconds to go on, walks again and again; default: each once.")
    ] = None,
    batch_s: Annotated[float, typer.Option("--batch", min=0.1, help="Seconds of a walk in a batch.")] = 5.0,
    inertial: Annotated[bool, typer.Option("--inertial", help="Send raw sensors, not poses.")] = False,
    key: Annotated[str | None, typer.Option(envvar=KEY_VARIABLE, help="API key.")] = None,
) -> None:
    """Play recorded or simulated walks against a service as phones would; prints rates and delays as JSON."""
    _need_extra()
    from radioslam.formats import read_walks
    from radioslam.server.replay import Replay

    played = Replay(to, site, starts, speed, phones, duration, batch_s, inertial, key)
    typer.echo(json.dumps(played.run(read_walks(logs)), indent=1))


def serve_demo(
    data: Data = Path("demo-service"),
    port: Annotated[int, typer.Option(min=1, max=65535)] = 8000,
    walks: Annotated[int, typer.Option(min=1, help="Simulated walkers.")] = 12,
    speed: Annotated[float, typer.Option(min=0.01, help="Times as fast as people walk.")] = 5.0,
    stay: Annotated[bool, typer.Option(help="Go on serving when the crowd is through.")] = True,
) -> None:
    """Serve, let a simulated crowd walk through an office, and print where to watch it."""
    _need_extra()
    from radioslam.server.demo import run_demo

    run_demo(data, port, walks, speed, stay, typer.echo)


@keys.command("add")
def add(
    name: Annotated[str, typer.Argument(help="Whose key it is.")],
    role: Annotated[str, typer.Option(help="upload, read or admin.")] = "upload",
    database: DatabaseUrl = None,
    data: Data = DEFAULT_DATA,
) -> None:
    """Make a key and print it; it is shown only now."""
    from radioslam.server.keys import add_key

    with _database(database, data) as opened:
        typer.echo(add_key(opened, name, role))


@keys.command("list")
def list_(database: DatabaseUrl = None, data: Data = DEFAULT_DATA) -> None:
    """List names and roles."""
    from radioslam.server.keys import list_keys

    with _database(database, data) as opened:
        for key in list_keys(opened):
            typer.echo(f"{key.name}\t{key.role}")


@keys.command("remove")
def remove(
    name: Annotated[str, typer.Argument(help="Whose key it is.")],
    database: DatabaseUrl = None,
    data: Data = DEFAULT_DATA,
) -> None:
    """Forget a key; servers that run follow within seconds."""
    from radioslam.server.keys import remove_key

    with _database(database, data) as opened:
        remove_key(opened, name)


@contextmanager
def _database(url: str | None, data: Path) -> Iterator[Database]:
    _need_extra()
    from radioslam.server.database import Database
    from radioslam.server.settings import Settings

    settings = Settings(data=data, database=url)
    settings.data.mkdir(parents=True, exist_ok=True)
    database = Database(settings.database_url)
    try:
        database.migrate()
        yield database
    finally:
        database.close()


def _need_extra() -> None:
    missing = [name for name in EXTRA if importlib.util.find_spec(name) is None]
    if missing:
        raise ConfigError(f"expected the package {missing[0]}; install it with: pip install 'radioslam[server]'")
