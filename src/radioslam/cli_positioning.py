"""Commands that use a map: where scans and walks are, what is in it, and in which forms it leaves."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from radioslam.progress import show

if TYPE_CHECKING:
    from radioslam.radio_map import RadioMap

Map = Annotated[Path, typer.Argument(metavar="MAP", help="A result folder or a radio map (Parquet).")]
Out = Annotated[Path, typer.Option("--out", "-o", help="File to write.")]
FloorNames = Annotated[str, typer.Option(help="Name of the floor of each map, comma-separated.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    for command in (survey, locate, track, health, coverage, export, georeference):
        app.command()(command)
    app.command("access-points")(access_points)
    app.command("merge-maps")(merge_maps)


def load_map(path: Path) -> RadioMap:
    """The radio map of a result folder, or a file of its own."""
    from radioslam.radio_map import RadioMap

    return RadioMap.load(path / "radio_map.parquet" if path.is_dir() else path)


def survey(
    logs: Annotated[list[Path], typer.Argument(metavar="LOGS...", help="Logs with positions, or folders of them.")],
    out: Out = Path("survey.parquet"),
) -> None:
    """Make a radio map of scans whose positions the logs know; no motion is needed, nothing is corrected."""
    from radioslam.config import load_config
    from radioslam.formats import read_walks
    from radioslam.surveying import survey_map

    surveyed = survey_map(read_walks(logs, check=False), load_config().fingerprints)
    surveyed.save(out)
    typer.echo(f"{len(surveyed)} scans of {len(surveyed.transmitters)} access points in {out}")


def locate(
    map: Map,
    scans: Annotated[
        list[Path], typer.Argument(metavar="SCAN...", help="JSON of access point -> RSS in dBm, or logs with scans.")
    ],
) -> None:
    """Position of scans, one JSON line each: position, deviations, 95 % radius, floor; or why it is not here."""
    from radioslam.positioning import Positioner

    read = [labelled for path in scans for labelled in _scans(path)]
    locations = Positioner.of(load_map(map)).locate_many([scan for _, scan in read])
    for (label, _), location in zip(read, locations, strict=True):
        typer.echo(json.dumps({**label, **location.as_dict()}))


def _scans(path: Path) -> Iterator[tuple[dict[str, Any], dict[str, float]]]:
    """The scan of a JSON file, or those of a log with their times; scans that heard nothing have no place."""
    from radioslam.formats import is_log, read_walk
    from radioslam.positioning import read_scan

    if not (path.is_file() and is_log(path)):
        yield {"scan": str(path)}, read_scan(path)
        return
    wifi = read_walk(path).wifi
    for time_s, scan in zip(wifi.scan_time_s.tolist(), wifi.as_dicts(), strict=True):
        if scan:
            yield {"scan": str(path), "time_s": time_s}, scan


def track(
    map: Map,
    log: Annotated[Path, typer.Argument(help="A log with scans and motion, or its folder.")],
    seed: Annotated[int, typer.Option(help="Of the particles.")] = 1,
) -> None:
    """Follow a walk through the map, start unknown: CSV time_s,x_m,y_m,heading_rad,sigma_m."""
    from radioslam.config import load_config
    from radioslam.errors import LogError
    from radioslam.following import follow
    from radioslam.formats import read_walks
    from radioslam.positioning import Positioner

    radio_map, walks = load_map(map), read_walks([log])
    if len(walks) != 1:
        raise LogError(log, "one log", f"{len(walks)}", "track them one by one")
    walked = follow(Positioner.of(radio_map), walks[0], load_config(), seed)
    typer.echo("time_s,x_m,y_m,heading_rad,sigma_m")
    for time_s, pose, sigma in zip(walked.time_s, walked.poses, walked.sigma_m, strict=True):
        typer.echo(f"{time_s:.3f},{pose[0]:.2f},{pose[1]:.2f},{pose[2]:.3f},{sigma:.2f}")


def health(map: Map) -> None:
    """List access points that moved, vanished or travel, and why."""
    from radioslam.map_health import find_unhealthy

    for finding in find_unhealthy(load_map(map)):
        typer.echo(f"{finding.transmitter}\t{finding.kind}\t{finding.reason}")


def access_points(
    map: Map,
    csv: Annotated[Path | None, typer.Option("--csv", help="File to write instead of printing the table.")] = None,
) -> None:
    """Each access point: how often and how strongly it was heard, where it stands or why that is unknown, health."""
    from radioslam.access_points import as_rows, write_csv
    from radioslam.tables import access_point_table

    rows = as_rows(load_map(map))
    if csv is not None:
        write_csv(rows, csv)
    else:
        show(access_point_table(rows))


def coverage(map: Map) -> None:
    """Where somebody should walk next: the least certain places within reach, as CSV."""
    from radioslam.coverage import walk_next

    floors = load_map(map).by_floor()
    typer.echo("x_m,y_m,floor,sigma_db")
    for floor, samples in floors:
        for x, y, sigma_db in walk_next(samples):
            typer.echo(f"{x:.1f},{y:.1f},{floor},{sigma_db:.2f}")


def export(
    map: Map,
    out: Out,
    ap: Annotated[str | None, typer.Option(help="Access point of a heat map; default: the one heard most.")] = None,
    form: Annotated[
        str | None, typer.Option(help="samples or field; default: the field for .png, else the samples.")
    ] = None,
) -> None:
    """Write the map as .parquet, .csv, .geojson, or a heat map as .png."""
    from radioslam.coverage import checked_form
    from radioslam.map_export import export_map

    export_map(load_map(map), out, ap, None if form is None else checked_form(form))


def merge_maps(
    maps: Annotated[list[Path], typer.Argument(metavar="MAP...")], out: Out, floors: FloorNames = ""
) -> None:
    """One map of several results in one frame, or of several floors of a building."""
    from radioslam.map_export import merge

    merge([load_map(path) for path in maps], floors.split(",") if floors else None).save(out)


def georeference(
    map: Map,
    point: Annotated[list[str], typer.Option(metavar="X,Y,LAT,LON", help="A known point; two or more.")],
    out: Out,
) -> None:
    """Tie a map's metres to latitude and longitude."""
    from radioslam.georeference import georeferenced, parse_point

    georeferenced(load_map(map), [parse_point(text) for text in point]).save(out)
