"""What the command line shows while it works and when it is done: a bar and tables, by ``rich``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Tell = Callable[[str, int | None, int | None], None]
"""What is being done, how many of it are done, and of how many; None where nobody knows."""


@contextmanager
def progress(quiet: bool) -> Iterator[Tell]:
    """A bar on standard error where somebody watches it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda text, done, total: None
        return
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=console) as bar:
        task = bar.add_task("reading", total=None)

        def tell(text: str, done: int | None, total: int | None) -> None:
            bar.update(task, description=text, completed=done or 0, total=total)

        yield tell


def show(table: Any) -> None:
    """Print a table of ``rich``."""
    from rich.console import Console

    console = Console()
    # Piped into a file, a table is as wide as it needs to be.
    if not console.is_terminal:
        console = Console(width=160)
    console.print(table)
