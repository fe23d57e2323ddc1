"""An evaluation as a table: for the terminal, for Markdown, for LaTeX."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from radioslam.evaluation import Evaluation, Row

HEADER = ("walk", "scans", "source", "mean", "std", "median", "p75", "p90", "p95", "max", "rmse", "size")


def _cells(row: Row) -> Iterator[list[str]]:
    for source, errors in row.errors.items():
        numbers = (errors.mean, errors.std, errors.median, errors.p75, errors.p90, errors.p95, errors.max, errors.rmse)
        size = row.size_ratio[source]
        yield [row.name, str(row.scans), source, *(f"{value:.2f}" for value in numbers), _number(size, 3)]


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if value == value else "–"


def _rows(evaluation: Evaluation) -> list[list[str]]:
    return [cells for row in (*evaluation.rows, evaluation.total) for cells in _cells(row)]


def remarks(evaluation: Evaluation) -> list[str]:
    """Alignment, ratio, segments, and what could not be judged, in words."""
    total = evaluation.total
    lines = [
        f"errors in metres; alignment {evaluation.alignment}; truth linear between fixes at most "
        f"{evaluation.max_gap_s:g} s apart; {evaluation.without_truth} scans without truth left out",
        f"mean error of the estimate over that of odometry: {_number(total.ratio, 3)}",
    ]
    if evaluation.tied < evaluation.walks:
        share = 100 * evaluation.tied / evaluation.walks
        lines.append(f"{evaluation.tied} of {evaluation.walks} walks ({share:.0f} %) are tied to map 0")
    for source, segments in total.segments.items():
        texts = [f"{100 * mean:.1f} % over {length:g} m" for length, mean in segments.items()]
        if texts:
            lines.append(f"relative error of {source}: {', '.join(texts)}")
    return lines


def terminal(evaluation: Evaluation) -> RenderableType:
    """A rich table, with the remarks below."""
    table = Table(title="Errors (m)", title_justify="left", header_style="bold")
    for name in HEADER:
        table.add_column(name, justify="left" if name in ("walk", "source") else "right")
    for row in evaluation.rows:
        for cells in _cells(row):
            table.add_row(*map(escape, cells))
    table.add_section()
    for cells in _cells(evaluation.total):
        table.add_row(*cells, style="bold")
    return Group(table, *(Text(line) for line in remarks(evaluation)))


def markdown(evaluation: Evaluation) -> str:
    """A table to paste into a page."""
    align = [":--" if name in ("walk", "source") else "--:" for name in HEADER]
    rows = [[cell.replace("|", "\\|") for cell in cells] for cells in _rows(evaluation)]
    lines = [f"| {' | '.join(cells)} |" for cells in [list(HEADER), align, *rows]]
    return "\n".join([*lines, "", *remarks(evaluation), ""])


def latex(evaluation: Evaluation) -> str:
    """A ``tabular`` with booktabs rules, to paste into a paper."""
    columns = "".join("l" if name in ("walk", "source") else "r" for name in HEADER)
    body = [" & ".join(_tex(cell) for cell in cells) + r" \\" for cells in _rows(evaluation)]
    total = len(evaluation.total.errors)
    lines = [*(f"% {_tex(line)}" for line in remarks(evaluation)), rf"\begin{{tabular}}{{{columns}}}", r"\toprule"]
    lines += [" & ".join(HEADER) + r" \\", r"\midrule", *body[:-total], r"\midrule", *body[-total:]]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def _tex(text: str) -> str:
    for character in "&%$#_{}":
        text = text.replace(character, "\\" + character)
    return text.replace("–", "--")
