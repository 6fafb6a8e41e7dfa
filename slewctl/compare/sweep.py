"""Many independent pieces of work over any executor, with results that survive.

Every finished piece is one line of an append-only file, written at once.  An interruption
or a killed worker loses no more than the pieces in flight, and a later run goes on from
there.  Each piece runs with one BLAS thread wherever it runs, so that its numbers do not
depend on the executor.
"""

from __future__ import annotations

import itertools
import json
import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from sys import intern
from typing import Any, overload

from threadpoolctl import ThreadpoolController

from slewctl.errors import InputError, SlewctlError

FORMAT = "slewctl-sweep-1"
# Pieces handed out before the first comes back: enough that no worker waits.
_IN_FLIGHT_PER_WORKER = 3

Row = Mapping[str, Any]
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Piece:
    """A piece of work.

    Parameters
    ----------
    key : str
        Names it among all pieces of the sweep.
    work : object
        What the function is given; can be pickled.
    size : int
        How many cases it holds, for the progress.
    """

    key: str
    work: Any
    size: int = 1


class WorkerDiedError(SlewctlError):
    """A piece of work killed every worker that took it."""


def sweep(
    function: Callable[[Any], Sequence[Row]],
    pieces: Iterable[Piece],
    results: Path,
    *,
    stamp: Mapping[str, Any],
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> None:
    """Apply `function` to every piece and append what it returns to a file.

    Parameters
    ----------
    function : callable
        From the work of a piece to its rows, which JSON can hold.  Importable by name.
    pieces : iterable of Piece
        Taken one by one, so that millions of them need no memory.
    results : Path
        One line per piece, in the order in which they finish; read it with `rows`.
    stamp : mapping
        What the sweep is; a file can only be resumed by the same sweep.
    executor : concurrent.futures.Executor, optional
        An existing one, such as Dask's ``client.get_executor()``; by default processes.
    workers : int, optional
        By default as many as there are cores.
    resume : bool
        Go on with an existing file; its finished pieces are not done again.
    progress : callable, optional
        Called with the number of cases of each finished piece.

    Raises
    ------
    InputError
        If the file exists and `resume` was not asked for, or belongs to another sweep.
    WorkerDiedError
        If one piece alone kills its worker; everything else has been done by then.
    """
    done = _open(results, stamp, resume)
    report = progress or (lambda _: None)
    cores = workers or os.cpu_count() or 1
    with results.open("a", encoding="utf-8") as file:

        def keep(piece: Piece, found: Sequence[Row]) -> None:
            file.write(json.dumps({"key": piece.key, "rows": list(found)}) + "\n")
            file.flush()
            report(piece.size)

        def remaining() -> Iterator[Piece]:
            for piece in pieces:
                if piece.key in done:
                    report(piece.size)
                else:
                    yield piece

        window = _IN_FLIGHT_PER_WORKER * cores
        if executor is not None:
            _run(executor, function, remaining(), keep, window)
        else:
            _run_in_processes(function, remaining(), keep, cores, window)


@dataclass(frozen=True)
class Rows(Sequence[Row]):
    """Rows that share their keys; only their values are kept, so that a million of them fit.

    Attributes
    ----------
    keys : tuple of str
    values : sequence of tuple
        One for each row.
    """

    keys: tuple[str, ...]
    values: Sequence[tuple[Any, ...]]

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, place: int) -> Row: ...
    @overload
    def __getitem__(self, place: slice) -> Rows: ...
    def __getitem__(self, place: int | slice) -> Row | Rows:
        if isinstance(place, slice):
            return Rows(self.keys, self.values[place])
        return dict(zip(self.keys, self.values[place], strict=True))


def rows(results: Path) -> Rows:
    """Return the rows of all finished pieces, ordered by the keys of the pieces.

    Raises
    ------
    InputError
        If the file is no result of a sweep.
    """
    keys: tuple[str, ...] = ()
    found: dict[str, list[tuple[Any, ...]]] = {}
    for entry in _entries(results):
        for row in entry["rows"]:
            keys = keys or tuple(row)
            if tuple(row) != keys:
                raise _no_results(results)
        found[entry["key"]] = [tuple(map(_shared, row.values())) for row in entry["rows"]]
    return Rows(keys, [values for key in sorted(found) for values in found[key]])


def _shared(value: Any) -> Any:
    """Return a value, of a text that comes again and again always the same copy."""
    return intern(value) if isinstance(value, str) else value


def _stamp_of(results: Path) -> dict[str, Any]:
    """Return what the sweep of a file is."""
    head = _parsed(next(_whole_lines(results), ""), ("format", "stamp"), results)
    if head["format"] != FORMAT or not isinstance(head["stamp"], dict):
        raise _no_results(results)
    return head["stamp"]


def _entries(results: Path) -> Iterator[dict[str, Any]]:
    """Yield the finished pieces one by one, as they stand in the file."""
    _stamp_of(results)
    for line in itertools.islice(_whole_lines(results), 1, None):
        yield _parsed(line, ("key", "rows"), results)


def _parsed(line: str, keys: Sequence[str], results: Path) -> dict[str, Any]:
    try:
        found = json.loads(line)
        return {key: found[key] for key in keys}
    except (ValueError, KeyError, TypeError) as error:
        raise _no_results(results) from error


def _whole_lines(results: Path) -> Iterator[str]:
    """Yield the lines of a file, but a last one that a kill has torn."""
    try:
        with results.open(encoding="utf-8", newline="\n") as file:
            yield from (line for line in file if line.endswith("\n"))
    except (OSError, UnicodeDecodeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else "") or "it is not text"
        raise InputError(
            f"cannot be read: {reason}", where=str(results), remedy="check the path"
        ) from error


def _no_results(results: Path) -> InputError:
    return InputError(
        "not the results of a sweep", where=str(results), remedy="name another file, or remove it"
    )


def _open(results: Path, stamp: Mapping[str, Any], resume: bool) -> set[str]:
    """Return the keys already in the file, which is made if it isn't there."""
    if not results.exists():
        head = json.dumps({"format": FORMAT, "stamp": dict(stamp)})
        try:
            results.parent.mkdir(parents=True, exist_ok=True)
            results.write_text(head + "\n", encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"cannot be written: {error.strerror}",
                where=str(results.parent),
                remedy="name a folder that you may write to",
            ) from error
        return set()
    if not resume:
        raise InputError(
            "this file is there already",
            where=str(results),
            remedy="go on with it by --resume, or remove it",
        )
    if _stamp_of(results) != json.loads(json.dumps(dict(stamp))):
        raise InputError(
            "these are the results of another study or version",
            where=str(results),
            remedy="use another folder, or remove the file",
        )
    keys = {entry["key"] for entry in _entries(results)}
    _mend(results)
    return keys


def _mend(results: Path) -> None:
    """Cut off a last line that was torn by a kill: the next must begin afresh."""
    whole = sum(len(line.encode()) for line in _whole_lines(results))
    if whole < results.stat().st_size:
        os.truncate(results, whole)


def _limited(function: Callable[[Any], Sequence[Row]], work: Any) -> Sequence[Row]:
    """Run one piece with one BLAS thread, wherever it runs."""
    with _threads().limit(limits=1):
        return function(work)


@cache
def _threads() -> ThreadpoolController:
    """Return the libraries with threads of this process; to look for them takes a while."""
    return ThreadpoolController()


def _run(
    executor: Executor,
    function: Callable[[Any], Sequence[Row]],
    pieces: Iterator[Piece],
    keep: Callable[[Piece, Sequence[Row]], None],
    window: int,
) -> None:
    """Hand out the pieces, never more than `window` at a time."""
    flying: dict[Future[Sequence[Row]], Piece] = {}
    taken: Piece | None = None
    try:
        while True:
            while len(flying) < window and (taken := next(pieces, None)) is not None:
                flying[executor.submit(_limited, function, taken.work)] = taken
            if not flying:
                return
            finished, _ = wait(flying, return_when=FIRST_COMPLETED)
            for future in finished:
                keep(flying[future], future.result())
                del flying[future]
    except BrokenExecutor as error:
        # A pool may break between two submissions, and then refuses the piece just taken.
        refused = [taken] if taken is not None and taken not in flying.values() else []
        raise _PoolBrokeError((*flying.values(), *refused)) from error
    finally:
        for future in flying:
            future.cancel()


class _PoolBrokeError(Exception):
    """The executor broke with these pieces in flight."""

    def __init__(self, pieces: Sequence[Piece]) -> None:
        super().__init__(len(pieces))
        self.pieces = pieces


def _run_in_processes(
    function: Callable[[Any], Sequence[Row]],
    pieces: Iterator[Piece],
    keep: Callable[[Piece, Sequence[Row]], None],
    workers: int,
    window: int,
) -> None:
    """Run over processes of our own; when one is killed, its pieces are tried again alone."""
    suspects: deque[Piece] = deque()
    fatal: list[str] = []
    while True:
        alone = bool(suspects)
        batch: Iterator[Piece] = iter([suspects.popleft()]) if alone else pieces
        pool = ProcessPoolExecutor(workers, get_context("spawn"), initializer=_ignore_interrupts)
        try:
            _run(pool, function, batch, keep, window)
            pool.shutdown()
        except _PoolBrokeError as error:
            if alone:
                fatal.append(error.pieces[0].key)
            else:
                suspects.extend(error.pieces)
        except BaseException:
            _kill(pool)
            raise
        else:
            if not alone:
                break
    if fatal:
        raise WorkerDiedError(
            f"{len(fatal)} piece(s) killed their worker, the first being {fatal[0]}",
            where="sweep",
            remedy="the other results are kept; look for want of memory",
        )


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the parent, which ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _kill(pool: ProcessPoolExecutor) -> None:
    processes = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
