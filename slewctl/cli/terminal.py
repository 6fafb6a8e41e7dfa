"""What the command line prints: progress on a terminal, tables, nothing in colour in a pipe."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console as RichConsole
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

# What a shell reports of a program that wrote to a pipe which nobody read any more.
NOBODY_READS = 141


class Console(RichConsole):
    """A console for which a reader that stops reading, such as ``head``, is no failure of ours."""

    def on_broken_pipe(self) -> None:
        """Stop silently, with a status unlike that of a failed requirement."""
        self.quiet = True
        # What Python still holds for this stream goes nowhere, instead of raising at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(NOBODY_READS)


# Names and paths are printed as they are: brackets in them are no markup.
OUT = Console(highlight=False, markup=False)
ERR = Console(stderr=True, highlight=False, markup=False)


@contextmanager
def counter(total: int) -> Iterator[Callable[[int], None]]:
    """Yield a function to tell how many more are done; with remaining time, on a terminal only."""
    if not ERR.is_terminal:
        yield lambda _: None
        return
    bar = Progress(
        BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=ERR, transient=True
    )
    with bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, advance=done)


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
