"""The command ``radioslam reference``: paths from point clouds; registered by ``cli.py``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from radioslam.cli_options import AsJson, ConfigFile, Force, Out, Overrides, Quiet

Clouds = Annotated[
    list[Path], typer.Argument(metavar="CLOUDS...", help="Folders of PLY, PCD or depth images, or walks with clouds/.")
]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(reference)


def reference(
    clouds: Clouds,
    odometry: Annotated[
        Path | None, typer.Option(help="TUM trajectory; default: trajectory.tum or NAME.pose.txt beside the clouds.")
    ] = None,
    out: Out = Path("reference"),
    planar: Annotated[
        bool | None, typer.Option("--planar/--spatial", help="Default: planar where odometry is.", show_default=False)
    ] = None,
    unit: Annotated[float, typer.Option(min=1e-6, help="Metres per unit of the clouds; 0.001 for millimetres.")] = 1.0,
    preset: Annotated[
        str | None, typer.Option(help="default, paper, or lidar for scanners that look all around.", show_default=False)
    ] = None,
    config: ConfigFile = None,
    set_: Overrides = None,
    force: Force = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Reference paths from point clouds: loops by registration, pose graph, trajectories for `evaluate`."""
    from radioslam.config import load_config
    from radioslam.point_cloud import find_recordings, make_reference
    from radioslam.point_cloud.reference_folder import summarize, write_reference
    from radioslam.point_cloud.surface import small_gicp
    from radioslam.progress import progress
    from radioslam.result_folder import check_target

    effective = load_config(preset, config, set_ or [])
    check_target(out, force, clouds)
    small_gicp()  # says what to install before minutes are spent
    with progress(quiet or as_json) as tell:
        tell("finding clouds", None, None)
        result = make_reference(find_recordings(clouds, odometry), effective, planar, unit, tell)
        tell("writing", None, None)
        summary = summarize(result)
        write_reference(result, summary, effective, out, force)
    for warning in summary["warnings"]:
        typer.echo(f"warning: {warning}", err=True)
    if as_json:
        typer.echo(json.dumps(summary, indent=1))
    elif not quiet:
        _print(summary, out)


def _print(summary: dict[str, Any], out: Path) -> None:
    from radioslam.point_cloud.reference_tables import lines, loops_table, walks_table
    from radioslam.progress import show

    show(walks_table(summary))
    show(loops_table(summary))
    for line in lines(summary):
        typer.echo(line)
    typer.echo(f"reference paths in {out}; open {out / 'report.html'}")
