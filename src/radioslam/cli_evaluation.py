"""Commands that judge: results against true positions, and the tables of experiments; registered by ``cli.py``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from radioslam.cli_options import AsJson, Overrides, Quiet
from radioslam.progress import progress, show

if TYPE_CHECKING:
    from radioslam.experiments import Experiment, Source


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command()(evaluate)
    app.command()(experiment)


def evaluate(
    result: Annotated[Path, typer.Argument(help="A result folder.", show_default=False)],
    reference: Annotated[
        Path | None,
        typer.Option(help="walk,time_s,x_m,y_m (CSV), WALK.tum, or a folder of them; default: what the logs had."),
    ] = None,
    align: Annotated[str | None, typer.Option(help="none, start or rigid; default: by the result's starts.")] = None,
    max_gap: Annotated[
        float, typer.Option(min=0.001, help="Seconds between fixes beyond which the truth is unknown.")
    ] = 60.0,
    as_json: AsJson = False,
    as_markdown: Annotated[bool, typer.Option("--markdown", help="Print Markdown.")] = False,
    as_latex: Annotated[bool, typer.Option("--latex", help="Print LaTeX.")] = False,
    plots: Annotated[Path | None, typer.Option(help="Folder for error-cdf.png and paths.png.")] = None,
    tum: Annotated[Path | None, typer.Option(help="Folder for pairs of TUM files that evo reads.")] = None,
) -> None:
    """Judge a result against true positions: errors, ratio to odometry, size ratio, relative errors."""
    from radioslam import evaluation_tables
    from radioslam.evaluation import evaluate as judge
    from radioslam.evaluation import load_references, with_references, write_tum_pairs
    from radioslam.results import SlamResult

    loaded = SlamResult.load(result)
    if reference is not None:
        loaded = with_references(loaded, load_references(reference, loaded.walks))
    judged = judge(loaded, _alignment(align), max_gap)
    if plots is not None:
        from radioslam.images import save_error_cdf_png, save_paths_png

        plots.mkdir(parents=True, exist_ok=True)
        save_error_cdf_png(judged.errors, plots / "error-cdf.png")
        save_paths_png(loaded, plots / "paths.png")
    if tum is not None:
        write_tum_pairs(loaded, judged, tum)
    if as_json:
        typer.echo(json.dumps(judged.as_dict(), indent=1))
    elif as_markdown or as_latex:
        typer.echo((evaluation_tables.markdown if as_markdown else evaluation_tables.latex)(judged), nl=False)
    else:
        show(evaluation_tables.terminal(judged))


def experiment(
    name: Annotated[
        str,
        typer.Argument(
            help="rss-threshold, similarity-threshold, bin-width, timing, accuracy, crowd, crowd-size, few-walks, "
            "positioning, into or two-phones."
        ),
    ],
    data: Annotated[list[str], typer.Argument(help="A simulated building, or logs with a reference.")],
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = 3,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 0,
    walks: Annotated[int | None, typer.Option(help="Walks drawn by each seed; default: all.", min=1)] = None,
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = "paper,default",
    values: Annotated[str | None, typer.Option(help="Only these settings, comma-separated.")] = None,
    starts: Annotated[str | None, typer.Option(help="common or known; default by the data.")] = None,
    set_: Overrides = None,
    jobs: Annotated[int | None, typer.Option(help="Worker processes; default: one per core.", min=1)] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the table (Markdown), CSV and plot.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Re-run a table of the paper: every setting, preset and seed; the paper's row beside ours."""
    from radioslam import experiments

    source = experiments.source_of(data, starts)
    chosen, run = _experiment(name, source, first_seed, walks)
    if values is not None:
        chosen = experiments.only(chosen, values.split(","))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    with progress(quiet) as tell:
        runs = experiments.Runs(
            source,
            tuple(presets.split(",")),
            tuple(range(first_seed, first_seed + seeds)),
            walks,
            tuple(set_ or ()),
            jobs,
            lambda done, total: tell(f"{name} on {source.name}", done, total),
        )
        outcomes = run(chosen, runs)
    table = experiments.markdown(chosen, source, outcomes)
    if not quiet:
        typer.echo(table)
    if out is not None:
        from radioslam.images import save_sweep_png

        stem = f"{name}-{source.name.replace('/', '-')}"
        (out / f"{stem}.md").write_text(table, "utf-8")
        experiments.write_csv(outcomes, out / f"{stem}.csv")
        save_sweep_png(chosen, outcomes, out / f"{stem}.png")


def _experiment(name: str, source: Source, seed: int, walks: int | None) -> tuple[Experiment, Callable[..., Any]]:
    """An experiment by its name, and what runs it."""
    from radioslam import experiments
    from radioslam.errors import ConfigError
    from radioslam.into_experiment import INTO, run_into
    from radioslam.positioning_experiment import POSITIONING, run_positioning
    from radioslam.two_phones_experiment import run_two_phones, two_phones

    for one, run in ((POSITIONING, run_positioning), (INTO, run_into)):
        if name == one.name:
            return one, run
    if name == "two-phones":
        return two_phones(source, seed, walks), run_two_phones
    if name in experiments.EXPERIMENTS:
        return experiments.EXPERIMENTS[name], experiments.run
    known = ", ".join((*experiments.EXPERIMENTS, POSITIONING.name, INTO.name, "two-phones"))
    raise ConfigError(f"unknown experiment {name!r}; expected one of {known}")


def _alignment(name: str | None) -> Any:
    from radioslam.errors import ConfigError

    if name not in (None, "none", "start", "rigid"):
        raise ConfigError(f"unknown alignment {name!r}; expected none, start or rigid")
    return name
