"""The command line. Thin: it reads options, calls the package and prints; heavy imports come late."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from radioslam import cli_cluster, cli_evaluation, cli_growing, cli_positioning, cli_reference, cli_server
from radioslam.cli_cluster import Cluster, Store, engine_at
from radioslam.cli_options import AsJson, ConfigFile, Force, Format, Logs, Out, Overrides, Preset, Quiet
from radioslam.cli_positioning import load_map
from radioslam.errors import LogError, RadioSlamError
from radioslam.progress import Tell, progress, show

if TYPE_CHECKING:
    from radioslam.config import Config
    from radioslam.engine import Engine
    from radioslam.results import SlamResult
    from radioslam.walk import Walk

app = typer.Typer(
    help="Walks recorded by many phones become their true paths and a radio map of the building.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.command("map")
def map_command(
    logs: Logs,
    out: Out = Path("result"),
    starts: Annotated[str | None, typer.Option("--starts", help="common, known, unknown or mixed.")] = None,
    into: Annotated[
        Path | None,
        typer.Option(metavar="MAP", help="A map in which the walks, of unknown start, are found; both become one map."),
    ] = None,
    heading: Annotated[
        str | None, typer.Option("--heading", help="device, or unknown: phones carried at any angle.")
    ] = None,
    preset: Preset = None,
    config: ConfigFile = None,
    set_: Overrides = None,
    format: Format = "auto",
    simulate_odometry: Annotated[
        int | None, typer.Option(metavar="SEED", help="Give walks without motion a simulated tracker's odometry.")
    ] = None,
    keep_going: Annotated[bool, typer.Option("--keep-going", help="Skip bad logs, name them, map the rest.")] = False,
    cluster: Cluster = None,
    store: Store = None,
    force: Force = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Map walks: corrected paths, loops, radio map and report."""
    from radioslam.config import load_config
    from radioslam.errors import ConfigError
    from radioslam.result_folder import check_target

    named = {"merging.starts": starts, "merging.heading": heading}
    overrides = [*(set_ or []), *(f"{key}={value}" for key, value in named.items() if value)]
    effective = load_config(preset, config, overrides)
    if into is not None and (starts not in (None, "unknown") or heading == "unknown"):
        raise ConfigError("expected --starts unknown and headings of the device with --into; the map gives the starts")
    if into is not None and cluster is not None:
        raise ConfigError("expected --into without --cluster; one walk more needs one machine")
    check_target(out, force, [*logs, into] if into else logs)
    skipped: list[LogError] = []
    started = time.perf_counter()
    with progress(quiet or as_json) as tell:
        walks = _read(logs, format, simulate_odometry, skipped if keep_going else None, tell)
        reading_s = time.perf_counter() - started
        tell("mapping", None, None)
        with engine_at(cluster, store) as engine:
            result = _map(walks, effective, into, engine, lambda step: tell(step, None, None))
        summary = _save(result, out, force, reading_s, skipped, tell)
    if as_json:
        typer.echo(json.dumps(summary, indent=1))
    elif not quiet:
        from radioslam import tables

        show(tables.summary_table(summary))
        typer.echo(tables.written(out))


def _read(
    logs: list[Path], format: str, drift_seed: int | None, skipped: list[LogError] | None, tell: Tell
) -> list[Walk]:
    from radioslam.formats import read_walks

    return read_walks(
        logs,
        format=format,
        on_error=None if skipped is None else skipped.append,
        progress=lambda done, total, path: tell(f"reading {path.name}", done, total),
        prepare=None if drift_seed is None else _with_odometry(drift_seed),
    )


def _with_odometry(seed: int) -> Callable[[Walk], Walk]:
    from radioslam.simulator import with_tracker_drift

    return lambda walk: walk if walk.motion is not None else with_tracker_drift(walk, seed)


def _map(
    walks: list[Walk], config: Config, into: Path | None, engine: Engine | None, step: Callable[[str], None]
) -> SlamResult:
    from radioslam.extending import extend_map
    from radioslam.results import SlamResult
    from radioslam.slam import map_walks

    if into is None:
        return map_walks(walks, config, step, engine)
    if not into.is_dir():
        return extend_map(load_map(into), walks, config, progress=step)
    before = SlamResult.load(into)
    known = {name: one for name, one in zip(before.walks, before.references, strict=True) if one is not None}
    return extend_map(before.radio_map, walks, config, known, step)


def _save(
    result: SlamResult, out: Path, force: bool, reading_s: float, skipped: list[LogError], tell: Tell
) -> dict[str, Any]:
    from dataclasses import replace

    result = replace(
        result,
        seconds={"reading": reading_s, **result.seconds},
        skipped=tuple((str(error.path), str(error)) for error in skipped),
    )
    tell("writing", None, None)
    peak_memory_mb = _peak_memory_mb()
    started = time.perf_counter()
    result.save(out, force, peak_memory_mb)
    writing_s = time.perf_counter() - started
    summary = result.summary()
    return {**summary, "seconds": {**summary["seconds"], "writing": writing_s}, "peak_memory_mb": peak_memory_mb}


def _peak_memory_mb() -> float | None:
    """Of this process so far; None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024 * 1024 if sys.platform == "darwin" else 1024)


@app.command()
def info(
    logs: Logs,
    format: Format = "auto",
    as_json: AsJson = False,
) -> None:
    """Tell what is in logs: durations, scans, access points, sensors, gaps."""
    from radioslam import tables
    from radioslam.formats import find_logs, read_walk

    facts = [{"path": str(path), **tables.walk_facts(read_walk(path, format))} for path in find_logs(logs)]
    if as_json:
        typer.echo(json.dumps(facts, indent=1))
    else:
        for one in facts:
            show(tables.facts_table(one))


@app.command()
def formats() -> None:
    """List the log formats that can be read."""
    from radioslam import tables
    from radioslam.formats import FORMATS

    show(tables.formats_table([(format.name, format.title) for format in FORMATS]))


@app.command("config")
def config_command(
    preset: Preset = None,
    config: ConfigFile = None,
    set_: Overrides = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write instead of printing.")] = None,
) -> None:
    """Print or write the effective configuration."""
    from radioslam.config import load_config

    text = load_config(preset, config, set_ or []).to_toml()
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, "utf-8")


@app.command()
def simulate(
    building: Annotated[str | None, typer.Argument(help="office, campus or tower.", show_default=False)] = None,
    out: Out = Path("walks"),
    seed: Annotated[int, typer.Option(help="The same seed gives the same bytes.")] = 1,
    walks: Annotated[int | None, typer.Option(help="Number of walks.", min=1)] = None,
    devices: Annotated[int | None, typer.Option(help="Number of phone models.", min=1)] = None,
    floors: Annotated[int | None, typer.Option(help="Number of storeys walked on.", min=1)] = None,
    hours: Annotated[float | None, typer.Option(help="Time over which the walks begin.")] = None,
    inertial: Annotated[bool, typer.Option("--inertial", help="Add raw sensor streams.")] = False,
    drift: Annotated[
        list[Path] | None,
        typer.Option(help="Instead of a building: logs with true positions, given a tracker's drift; repeatable."),
    ] = None,
    clouds: Annotated[
        str | None, typer.Option(metavar="depth|lidar", help="Add point clouds for `radioslam reference`.")
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Simulate walks in a made-up building, or a tracker for walks that have only positions; open format."""
    from radioslam.errors import ConfigError
    from radioslam.formats import read_walks, write_walk
    from radioslam.result_folder import check_target, whole_folder
    from radioslam.simulator import simulate as simulate_walks
    from radioslam.simulator import with_tracker_drift

    check_target(out, force, drift or ())
    if (building is None) == (drift is None):
        raise ConfigError("expected either a building (office, campus or tower) or --drift LOGS")
    if drift is not None:
        made = [with_tracker_drift(walk, seed) for walk in read_walks(drift, check=False)]
    else:
        made = simulate_walks(
            str(building), seed=seed, walks=walks, devices=devices, floors=floors, hours=hours, inertial=inertial
        )
    write_clouds = _cloud_writer(building, made, seed, clouds) if clouds is not None else None
    with whole_folder(out, force, drift or ()) as partial, progress(quiet) as tell:
        (partial / ".radioslam-walks").touch()
        for done, walk in enumerate(made):
            tell(f"writing {walk.name}", done, len(made))
            folder = write_walk(walk, partial)
            if write_clouds is not None:
                write_clouds(walk, folder)
    if not quiet:
        scans = sum(len(walk.wifi) for walk in made)
        typer.echo(f"{len(made)} walks with {scans} scans in {out}")


def _cloud_writer(building: str | None, walks: list[Walk], seed: int, kind: str) -> Callable[[Walk, Path], None]:
    """Writes the clouds of a walk through the building, furnished for these walks."""
    import numpy as np

    from radioslam.errors import ConfigError
    from radioslam.simulator import SCENARIOS
    from radioslam.simulator.cloud_frames import SENSORS, write_clouds
    from radioslam.simulator.furnishing import furnish
    from radioslam.simulator.streams import random_stream

    if building is None:
        raise ConfigError("--clouds: expected a building (office, campus or tower), found walks of --drift")
    if kind not in SENSORS:
        raise ConfigError(f"--clouds: expected {' or '.join(SENSORS)}, found {kind!r}")
    paths_xy = np.concatenate([walk.reference.positions_xy for walk in walks if walk.reference is not None])
    scene = furnish(SCENARIOS[building].make_building(), paths_xy, seed)
    sensor = SENSORS[kind]()
    return lambda walk, folder: write_clouds(walk, scene, folder, random_stream(seed, kind, walk.name), sensor)


for commands in (cli_evaluation, cli_positioning, cli_reference, cli_growing, cli_cluster, cli_server):
    commands.register(app)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.", is_eager=True)] = False,
) -> None:
    if version:
        import importlib.metadata

        typer.echo(importlib.metadata.version("radioslam"))
        raise typer.Exit


def main() -> None:
    """Run the command line; known errors are one line on standard error and exit code 1."""
    try:
        app()
    except RadioSlamError as error:
        sys.exit(f"radioslam: {' '.join(str(error).split())}")
    except BrokenPipeError:
        sys.exit(1)
    except OSError as error:
        sys.exit(f"radioslam: {error.filename or 'output'}: could not be read or written: {error.strerror or error}")
    except KeyboardInterrupt:
        print("radioslam: interrupted; folders are written whole or not at all", file=sys.stderr)
        sys.exit(130)
