"""What the command line prints: progress on a terminal, tables, nothing in colour in a pipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

# Names and paths are printed as they are: brackets in them are no markup.
OUT = Console(highlight=False, markup=False)
ERR = Console(stderr=True, highlight=False, markup=False)


@contextmanager
def progress(total: int | None) -> Iterator[Callable[[str], None]]:
    """Yield a function to call before each step; it draws a bar on a terminal only."""
    if not ERR.is_terminal:
        yield lambda _: None
        return
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=ERR,
        transient=True,
    )
    with bar:
        task = bar.add_task("", total=total)
        started = False

        def step(text: str) -> None:
            nonlocal started
            bar.update(task, description=text, advance=1 if started else 0)
            started = True

        yield step


def show(table: Table) -> None:
    """Print a table; in a pipe as wide as it needs to be."""
    console = OUT if OUT.is_terminal else Console(width=200, highlight=False, markup=False)
    console.print(table)
