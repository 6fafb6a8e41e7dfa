"""What the user sees: progress on a terminal, tables, nothing in colour in a pipe.

Everything that is printed passes through `Console`: names and keys of files command neither a
terminal nor a CI log, and a stream that takes no more is no traceback.
"""

from __future__ import annotations

import io
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, ParamSpec, TextIO, TypeVar

from rich.console import Console as RichConsole
from rich.table import Table
from rich.text import Text

from slewctl.cli import BAD_INPUT
from slewctl.errors import SlewctlError
from slewctl.escape import console as escaped

if TYPE_CHECKING:
    from rich.progress import Progress

P = ParamSpec("P")
T = TypeVar("T")

# What a shell reports of a program that wrote to a pipe which nobody read any more.
NOBODY_READS = 141
# Seconds after which a program in a pipe is told that a long search goes on.
PATIENCE = 10.0
# Columns of a table that no screen breaks into lines.
_ENDLESS = 1_000_000
# Names and paths are printed as they are: brackets and colons in them are no markup, no emoji.
_Plain = partial(RichConsole, highlight=False, markup=False, emoji=False)


class Console:
    """One of the two streams."""

    def __init__(self, *, stderr: bool = False) -> None:
        self.rich = _Plain(stderr=stderr)
        self.is_error = stderr

    @property
    def is_terminal(self) -> bool:
        """Whether a person reads it, and not a program."""
        return self.rich.is_terminal

    def print(self, text: str, *, soft_wrap: bool = True) -> None:
        """Print one line, whatever is in it; a terminal breaks it where it must."""
        self._write(f"{escaped(text)}\n")

    def text(self, text: str) -> None:
        """Print a text of several lines."""
        for line in text.split("\n"):
            self.print(line)

    def tell(self, error: SlewctlError | str) -> None:
        """Print an error, one line for each fault."""
        for line in str(error).split("\n"):
            self.print(f"slewctl: {line}")

    def table(self, table: Table) -> None:
        """Print a table; in a pipe as wide as it needs to be."""
        rich = self.rich
        if not self.is_terminal:
            rich = _Plain(file=io.StringIO(), width=_ENDLESS)
        with rich.capture() as captured:
            rich.print(_harmless(table))
        self._write(captured.get())

    def _write(self, text: str) -> None:
        """Write to the stream; nothing that it refuses is tried again at exit."""
        stream = sys.stderr if self.is_error else sys.stdout
        if stream is None:  # the shell has closed it
            return
        try:
            stream.write(text)
            stream.flush()
        except BrokenPipeError:
            silence(stream)
            # Unlike the status of a failed requirement.
            raise SystemExit(NOBODY_READS) from None
        except OSError:
            silence(stream)
            if not self.is_error:  # there is nowhere left to say that of the other one
                raise


def next_step(command: str, why: str) -> None:
    """Tell a person what to run next; a program in a pipe knows."""
    if OUT.is_terminal:
        OUT.print(f"next: {command}    # {why}")


def silence(stream: TextIO) -> None:
    """Let go of a stream that takes no more, so that Python does not fail to flush it at exit."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    except (OSError, ValueError):  # a stream without a file
        return


def _harmless(table: Table) -> Table:
    """Return a table whose cells are single lines that command nothing."""
    columns = [column.copy() for column in table.columns]
    same = Table(*columns, box=table.box, pad_edge=table.pad_edge)
    for cells in zip(*(column.cells for column in table.columns), strict=True):
        same.add_row(*(_cell(cell) for cell in cells))
    return same


def _cell(cell: object) -> Text:
    if isinstance(cell, Text):
        return Text(escaped(cell.plain), cell.style)
    return Text(escaped(str(cell)))


OUT = Console()
ERR = Console(stderr=True)


def number_table(*headings: str) -> Table:
    """Return an empty table whose numbers keep all their digits on the narrowest screen."""
    table = Table(box=None)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    return table


@contextmanager
def counter(total: int) -> Iterator[Callable[[int], None]]:
    """Yield a function to tell how many more are done; with remaining time, on a terminal only."""
    if not ERR.is_terminal:
        yield lambda _: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    bar = Progress(
        BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=ERR.rich, transient=True
    )
    with bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, advance=done)


class Step:
    """Tells of steps, and of what goes on within one."""

    def __call__(self, text: str) -> None:
        """Begin a step."""

    def within(self, text: str) -> None:
        """Say what goes on within the step."""


class _Lines(Step):
    """A line every so many seconds, for a program that reads a pipe."""

    def __init__(self, total: int | None, every: float) -> None:
        self.total, self.every = total, every
        self.done, self.told = 0, time.monotonic()

    def __call__(self, text: str) -> None:
        self.within(text)
        self.done += 1

    def within(self, text: str) -> None:
        if time.monotonic() - self.told >= self.every:
            self.told = time.monotonic()
            count = f"{self.done}{f' of {self.total}' if self.total else ''} done"
            ERR.print(f"slewctl: {count}; {text}")


class _Bar(Step):
    def __init__(self, bar: Progress, total: int | None) -> None:
        self.bar, self.started = bar, False
        self.task = bar.add_task("", total=total)

    def __call__(self, text: str) -> None:
        self.bar.update(self.task, description=escaped(text), advance=1 if self.started else 0)
        self.started = True

    def within(self, text: str) -> None:
        self.bar.update(self.task, description=escaped(text))


@contextmanager
def progress(total: int | None, *, every: float = math.inf) -> Iterator[Step]:
    """Yield a function to call before each step; it draws a bar on a terminal.

    Elsewhere it is silent, or tells a line on standard error `every` so many seconds.
    """
    if not ERR.is_terminal:
        yield _Lines(total, every)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=ERR.rich,
        transient=True,
    )
    with bar:
        yield _Bar(bar, total)


class Told:
    """Errors that are told at once while the work goes on."""

    def __init__(self) -> None:
        self.status = 0

    def trying(self, work: Callable[P, T], *args: P.args, **keys: P.kwargs) -> T | None:
        """Return what `work` returns, or None after telling why it returns nothing."""
        try:
            return work(*args, **keys)
        except SlewctlError as error:
            ERR.tell(error)
            self.status = BAD_INPUT
            return None


def show(table: Table) -> None:
    """Print a table."""
    OUT.table(table)
