"""Many independent pieces of work over any executor, with results that survive.

Every finished piece is one line of a file, written at once (see
`slewctl.compare.study.results_file`).  An interruption or a killed worker loses no more than the
pieces in flight, and a later run goes on from there.  Each piece runs with one BLAS thread
and the same versions of every program wherever it runs, so that its numbers do not depend on
the executor.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, groupby, islice
from typing import Any

from slewctl._threads import one_thread
from slewctl._types import FilePath
from slewctl.compare.study.processes import Processes, usable_cores
from slewctl.compare.study.results_file import Notice, Row, results_file
from slewctl.errors import InputError, SlewctlError, check_path
from slewctl.versions import difference, versions

# Tasks handed out for each worker before the first comes back: enough that none waits.
_IN_FLIGHT_PER_WORKER = 3
# Tasks for each worker at least, so that the last ones to come back do not keep all waiting.
_LEAST_PER_WORKER = 10
# When nothing comes back for so many seconds, it is asked whether there still are workers.
_PATIENCE = 60.0
# In s: the longest wait that a signal, which came as it began, has to sit out.
_HEEDED = 0.5

Progress = Callable[[int], None]
Work = Callable[[Any], Sequence[Row]]


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
    group : str
        Pieces of one group that follow each other share most of what they are computed from:
        they go to one worker, in one task or in several.
    """

    key: str
    work: Any
    size: int = 1
    group: str = ""


Task = tuple[Piece, ...]


@dataclass(frozen=True)
class Groups:
    """How many groups there are about, and how many pieces the largest has."""

    count: int
    size: int

    def per_task(self, workers: int) -> int:
        """Return how many pieces of a group are one task: all, if there are enough groups."""
        return max(1, min(self.size, self.count * self.size // (_LEAST_PER_WORKER * workers)))


class WorkerDiedError(SlewctlError):
    """A piece of work killed every worker that took it, or no worker is left."""


def sweep(
    function: Work,
    pieces: Iterable[Piece],
    results: FilePath,
    *,
    stamp: Mapping[str, Any],
    executor: Executor | None = None,
    workers: int | None = None,
    groups: Groups | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    notice: Notice | None = None,
) -> None:
    """Apply `function` to every piece and append what it returns to a file.

    Parameters
    ----------
    function : callable
        From the work of a piece to its rows, which JSON can hold.  Importable by name.
    pieces : iterable of Piece
        Taken one by one, so that millions of them need no memory.
    results : str or PathLike
        One line per piece, in the order in which they finish; read it with `rows`.
    stamp : mapping
        What the sweep is; a file can only be resumed by the same sweep, and the same versions
        of slewctl and what it computes with.
    executor : concurrent.futures.Executor, optional
        An existing one, such as that of `slewctl.compare.study.dask_cluster`; by default processes.
    workers : int, optional
        How many work at once; by default as many as the executor has, or there are cores.
    groups : Groups, optional
        Of the pieces; without it each goes to a worker by itself.
    resume : bool
        Go on with an existing file; its finished pieces are not done again.
    progress : callable, optional
        Called with the number of cases of each finished piece.
    notice : callable, optional
        Called with a sentence for every line of an existing file that is damaged, whose piece
        is done again, or that tells of no piece of this sweep, which is taken out.

    Raises
    ------
    InputError
        If the file exists and `resume` was not asked for, belongs to another sweep, is
        written to by another run or cannot be written, or a worker has other versions.
    WorkerDiedError
        If one piece alone kills its worker, when everything else has been done, or if an
        executor has lost its workers.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from slewctl.compare import Piece, rows, sweep
    >>> def square(number):
    ...     return [{"number": number, "square": number**2}]
    >>> path = Path(mkdtemp()) / "squares.jsonl"
    >>> sweep(square, [Piece("3", 3)], path, stamp={}, executor=ThreadPoolExecutor(1))
    >>> list(rows(path))
    [{'number': 3, 'square': 9}]
    """
    results = check_path(results, "results")
    report, tell = progress or (lambda _: None), notice or (lambda _: None)
    with results_file(results, stamp, resume=resume, notice=tell) as file:
        unclaimed = file.done

        def keep(piece: Piece, found: Sequence[Row]) -> None:
            file.add(piece.key, found)
            report(piece.size)

        def remaining() -> Iterator[Piece]:
            for piece in pieces:
                if piece.key in unclaimed:
                    unclaimed.remove(piece.key)
                    report(piece.size)
                else:
                    yield piece

        width = _width(executor, workers)
        most = groups.per_task(max(width(), 1)) if groups else 1
        tasks = _tasks(remaining(), most)
        if executor is not None:
            _run_elsewhere(executor, function, tasks, keep, width)
        else:
            _run_in_processes(function, tasks, keep, width())
        if unclaimed:
            tell(f"{results}: {len(unclaimed)} pieces are none of this study's; taken out")
            file.remove(unclaimed)


def _tasks(pieces: Iterator[Piece], most: int) -> Iterator[Task]:
    """Yield pieces of one group that follow each other together, so many at most."""
    for _, members in groupby(pieces, key=lambda piece: piece.group):
        while task := tuple(islice(members, most)):
            yield task


def _limited(function: Work, task: Sequence[Any], wanted: Mapping[str, str]) -> list[Sequence[Row]]:
    """Run the pieces of a task with one BLAS thread and the versions wanted, wherever it runs."""
    if other := difference(versions(), wanted):
        raise InputError(
            f"a worker has {other}",
            where="executor",
            remedy="install the same versions there: digits depend on them",
        )
    with one_thread():
        return [function(work) for work in task]


def _run(
    executor: Executor,
    function: Work,
    tasks: Iterator[Task],
    keep: Callable[[Piece, Sequence[Row]], None],
    window: Callable[[], int],
) -> None:
    """Hand out the tasks, never more than a window of them at a time.

    A window of none says that no worker is left; one task is handed out all the same, since
    a cluster may grow when there is work.
    """
    flying: dict[Future[list[Sequence[Row]]], Task] = {}
    taken: Task | None = None
    try:
        while True:
            most = max(window(), 1)
            while len(flying) < most and (taken := next(tasks, None)) is not None:
                work = [piece.work for piece in taken]
                flying[executor.submit(_limited, function, work, versions())] = taken
            if not flying:
                return
            finished = _finished(flying)
            if not finished and not window():
                raise _lost("no worker is left")
            for future in finished:
                for piece, found in zip(flying[future], future.result(), strict=True):
                    keep(piece, found)
                del flying[future]
    except BrokenExecutor as error:
        # A pool may break between two submissions, and then refuses the piece just taken.
        refused = [taken] if taken is not None and taken not in flying.values() else []
        raise _PoolBrokeError(tuple(chain(*flying.values(), *refused))) from error
    except CancelledError as error:
        raise _lost("the executor has dropped its work") from error
    except BaseException:
        for future in flying:
            future.cancel()
        raise


def _finished(flying: Collection[Future[list[Sequence[Row]]]]) -> set[Future[list[Sequence[Row]]]]:
    """Return what is finished, of nothing within `_PATIENCE` an empty set.

    Waited for in short times: a signal that comes as one begins is heeded at its end.
    """
    end = time.monotonic() + _PATIENCE
    finished: set[Future[list[Sequence[Row]]]] = set()
    while not finished and time.monotonic() < end:
        finished, _ = wait(flying, timeout=_HEEDED, return_when=FIRST_COMPLETED)
    return finished


def _lost(what: str) -> WorkerDiedError:
    return WorkerDiedError(
        what, where="executor", remedy="what was finished is kept; go on with --resume"
    )


class _PoolBrokeError(Exception):
    """The executor broke with these pieces in flight."""

    def __init__(self, pieces: Sequence[Piece]) -> None:
        super().__init__(len(pieces))
        self.pieces = pieces


def _run_elsewhere(
    executor: Executor,
    function: Work,
    tasks: Iterator[Task],
    keep: Callable[[Piece, Sequence[Row]], None],
    width: Callable[[], int],
) -> None:
    """Run on an executor that somebody else keeps."""
    try:
        _run(executor, function, tasks, keep, lambda: _IN_FLIGHT_PER_WORKER * width())
    except _PoolBrokeError as error:
        raise _lost("a worker was killed, and its pool is broken") from error


def _width(executor: Executor | None, workers: int | None) -> Callable[[], int]:
    """Return how to learn how many tasks an executor, or processes of our own, work at at once."""
    client: Any = getattr(executor, "_client", None)
    if workers or client is None:
        most: int = workers or getattr(executor, "_max_workers", None) or usable_cores()
        return lambda: most

    def threads() -> int:
        """Ask Dask's scheduler, whose workers come and go; without it none is left."""
        with suppress(OSError):
            return sum(client.nthreads().values())
        return 0

    return threads


def _run_in_processes(
    function: Work,
    tasks: Iterator[Task],
    keep: Callable[[Piece, Sequence[Row]], None],
    workers: int,
) -> None:
    """Run over processes of our own; when one is killed, its pieces are tried again alone."""
    suspects: deque[Piece] = deque()
    fatal: list[str] = []
    while True:
        alone = bool(suspects)
        try:
            if alone:
                with Processes(1) as pool:
                    _run(pool, function, _drained(suspects), keep, lambda: 1)
            else:
                with Processes(workers) as pool:
                    _run(pool, function, tasks, keep, lambda: _IN_FLIGHT_PER_WORKER * workers)
                break
        except _PoolBrokeError as error:
            if alone:
                fatal.append(error.pieces[0].key)
            else:
                suspects.extend(error.pieces)
    if fatal:
        raise WorkerDiedError(
            f"{len(fatal)} piece(s) killed their worker, the first being {fatal[0]}",
            where="sweep",
            remedy="the other results are kept; look for want of memory",
        )


def _drained(pieces: deque[Piece]) -> Iterator[Task]:
    while pieces:
        yield (pieces.popleft(),)
