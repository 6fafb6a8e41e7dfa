"""Sweeps: the same results on any executor, and nothing lost but what was in flight."""

from __future__ import annotations

import logging
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import distributed
import psutil
import pytest
import sweep_work
from heed_signals import heed_signals
from hypothesis import given
from hypothesis import strategies as st

from slewctl.compare.study.dask_cluster import dask_cluster
from slewctl.compare.study.processes import Processes
from slewctl.compare.study.results_file import Row, rows
from slewctl.compare.study.sweep import Groups, Piece, WorkerDiedError, _limited, sweep
from slewctl.errors import InputError
from slewctl.versions import versions

STAMP = {"study": "a"}


def pieces(count: int) -> list[Piece]:
    return [Piece(f"{i:05d}", i) for i in range(count)]


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let worker processes import the functions that they are given."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(Path(__file__).parent), *sys.path)))


@pytest.mark.slow
def test_rows_come_back_in_order_whoever_computed_them(tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as threads:
        sweep(sweep_work.eigenvalues, pieces(6), tmp_path / "t", stamp=STAMP, executor=threads)
    sweep(sweep_work.eigenvalues, reversed(pieces(6)), tmp_path / "p", stamp=STAMP, workers=2)
    assert rows(tmp_path / "t") == rows(tmp_path / "p")
    assert [row["seed"] for row in rows(tmp_path / "p")] == list(range(6))


class Counting(ThreadPoolExecutor):
    """An executor that counts what it is given."""

    submitted = 0

    def submit(self, *args: Any, **keys: Any) -> Future[Any]:
        self.submitted += 1
        return super().submit(*args, **keys)


@given(count=st.integers(1, 500), size=st.integers(1, 50), workers=st.integers(1, 100))
def test_tasks_are_groups_or_as_many_parts_as_keep_all_workers(
    count: int, size: int, workers: int
) -> None:
    most = Groups(count, size).per_task(workers)
    tasks = count * -(-size // most)
    assert 1 <= most <= size
    assert tasks >= min(10 * workers, count * size)
    if count >= 10 * workers:
        assert most == size


@pytest.mark.parametrize(("groups", "submitted"), [(None, 120), (Groups(24, 5), 24)])
def test_a_group_is_one_task_and_each_of_its_pieces_one_result(
    tmp_path: Path, groups: Groups | None, submitted: int
) -> None:
    work = [Piece(f"{g:02}-{i}", (g, i), group=str(g)) for g in range(24) for i in range(5)]

    def done(key: tuple[int, int]) -> list[Row]:
        return [{"group": key[0], "number": key[1]}]

    seen: list[int] = []
    with Counting(2) as threads:
        sweep(done, work[:37], tmp_path / "r", stamp=STAMP, executor=threads, groups=groups)
        first = threads.submitted
        sweep(done, work, tmp_path / "r", stamp=STAMP, executor=threads, groups=groups,
              resume=True, progress=seen.append)  # fmt: skip
    # A group of which a part was done goes on with the rest of it.
    assert threads.submitted == submitted + (groups is not None)
    assert first == (8 if groups else 37)
    assert sum(seen) == len(work)
    found = [(row["group"], row["number"]) for row in rows(tmp_path / "r")]
    assert found == [piece.work for piece in work]


def test_pieces_are_taken_as_they_are_needed(tmp_path: Path) -> None:
    taken, finished = 0, 0
    largest = 0

    def endless() -> object:
        nonlocal taken, largest
        for piece in pieces(200):
            taken += 1
            largest = max(largest, taken - finished)
            yield piece

    def progress(cases: int) -> None:
        nonlocal finished
        finished += cases

    with ThreadPoolExecutor(2) as threads:
        sweep(sweep_work.squares, endless(), tmp_path / "r", stamp=STAMP, executor=threads,
              workers=2, progress=progress)  # fmt: skip
    assert finished == taken == 200
    assert largest <= 7  # three for each of two workers, and the one being taken


def test_a_second_run_goes_on_from_the_first(tmp_path: Path) -> None:
    results = tmp_path / "r"
    done: list[int] = []

    def counted(number: int) -> list[dict[str, float]]:
        done.append(number)
        return sweep_work.squares(number)

    with ThreadPoolExecutor(1) as threads:
        sweep(counted, pieces(4), results, stamp=STAMP, executor=threads)
        with results.open("a") as file:
            file.write('{"key": "00004", "ro')  # a kill tears the last line
        assert len(rows(results)) == 4
        sweep(counted, pieces(7), results, stamp=STAMP, executor=threads, resume=True,
              notice=pytest.fail)  # fmt: skip
    assert sorted(done) == list(range(7))
    assert [row["square"] for row in rows(results)] == [i**2 for i in range(7)]


def test_files_of_other_sweeps_are_refused(tmp_path: Path) -> None:
    results = tmp_path / "r"
    with ThreadPoolExecutor(1) as threads:
        sweep(sweep_work.squares, pieces(2), results, stamp=STAMP, executor=threads)
        with pytest.raises(InputError, match="--resume"):
            sweep(sweep_work.squares, pieces(2), results, stamp=STAMP, executor=threads)
        with pytest.raises(InputError, match="another study"):
            sweep(sweep_work.squares, pieces(2), results, stamp={"study": "b"},
                  executor=threads, resume=True)  # fmt: skip
    results.write_text("hello\n")
    with pytest.raises(InputError, match="not the results"):
        rows(results)
    with pytest.raises(InputError, match="cannot be read"):
        rows(tmp_path / "missing")


@pytest.mark.slow
def test_a_killed_worker_costs_nothing_and_a_killer_is_named(tmp_path: Path) -> None:
    work = [Piece(f"{i:05d}", (i, str(tmp_path))) for i in range(9)]
    with pytest.raises(WorkerDiedError, match="00003"):
        sweep(sweep_work.deadly, work, tmp_path / "r", stamp=STAMP, workers=2)
    assert [row["number"] for row in rows(tmp_path / "r")] == [0, 1, 2, 4, 5, 6, 7, 8]


SCRIPT = """\
import sys, sweep_work
from pathlib import Path
from slewctl.compare.study.sweep import Piece, sweep
if __name__ == "__main__":
    work = [Piece(f"{i:05d}", i) for i in range(300)]
    sweep(sweep_work.slow, work, Path(sys.argv[1]), stamp={}, workers=2, resume=True)
"""


class Sweep:
    """A sweep of 300 slow pieces in a process of its own, with two workers."""

    def __init__(self, folder: Path) -> None:
        self.results = folder / "results"
        (folder / "run.py").write_text(SCRIPT)
        self.process = subprocess.Popen(
            [sys.executable, str(folder / "run.py"), str(self.results)],
            stderr=subprocess.PIPE, start_new_session=True, preexec_fn=heed_signals,
        )  # fmt: skip

    def wait_for(self, finished: int) -> None:
        deadline = time.monotonic() + 120
        while not (self.results.exists() and self.results.read_bytes().count(b"\n") > finished):
            assert time.monotonic() < deadline
            time.sleep(0.02)

    def workers(self) -> list[psutil.Process]:
        return psutil.Process(self.process.pid).children(recursive=True)

    def end(self, number: int) -> bytes:
        """Return what stands on standard error after the end of every process of it.

        Ctrl-C comes to all processes of a terminal, another signal to the first of them.
        """
        family = self.workers()
        (os.killpg if number == signal.SIGINT else os.kill)(self.process.pid, number)
        _, errors = self.process.communicate(timeout=60)
        _, alive = psutil.wait_procs(family, timeout=30)
        assert not alive
        return errors


@pytest.mark.slow
def test_an_interruption_leaves_what_was_finished(tmp_path: Path) -> None:
    interrupted = Sweep(tmp_path)
    interrupted.wait_for(3)
    errors = interrupted.end(signal.SIGINT)
    assert interrupted.process.returncode != 0
    assert errors.count(b"Traceback") == 1  # the parent's own; no worker complains
    assert 3 <= len(rows(interrupted.results)) < 300


@pytest.mark.slow
def test_a_sweep_killed_at_random_moments_ends_with_the_same_rows(tmp_path: Path) -> None:
    """No worker outlives the sweep, and what was finished before is there after."""
    chance = random.Random(7)
    before = 0
    for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
        killed = Sweep(tmp_path)
        killed.wait_for(before + chance.randint(0, 12))
        for worker in killed.workers()[-1:]:
            worker.kill()  # which the sweep survives
        time.sleep(chance.uniform(0, 1))
        errors = killed.end(number)
        assert b"Traceback" not in errors or number == signal.SIGINT, errors
        found = [row["number"] for row in rows(killed.results)]
        assert len(found) >= before
        before = len(found)
    with ThreadPoolExecutor(50) as threads:
        sweep(sweep_work.slow, pieces(300), killed.results, stamp={}, executor=threads,
              resume=True, notice=pytest.fail)  # fmt: skip
    assert list(rows(killed.results)) == [{"number": i} for i in range(300)]


@pytest.mark.slow
def test_no_worker_outlives_a_killed_sweep(tmp_path: Path) -> None:
    killed = Sweep(tmp_path)
    killed.wait_for(3)
    assert len(killed.workers()) >= 2
    errors = killed.end(signal.SIGKILL)
    assert b"Traceback" not in errors
    assert 3 <= len(rows(killed.results)) < 300


def interrupted_after(moment: float) -> None:
    """Interrupt a pool with calls in every state and wait for the thread that serves it."""
    served = None
    try:
        with Processes(1) as pool:
            calls = [pool.submit(time.sleep, 0.001) for _ in range(200)]
            served = vars(pool)["_executor_manager_thread"]
            calls[0].result()
            time.sleep(moment)
            for call in calls[1:]:
                call.cancel()
            raise KeyboardInterrupt
    finally:
        assert served is not None
        served.join(30)


@pytest.mark.slow
@pytest.mark.parametrize("moment", [0.0, 0.01])
def test_an_interruption_at_any_moment_is_not_told_by_threads(
    moment: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[object] = []
    monkeypatch.setattr(threading, "excepthook", said.append)
    with pytest.raises(KeyboardInterrupt):
        interrupted_after(moment)
    assert not said


@pytest.mark.slow
def test_dask_cluster_gives_the_same_rows(tmp_path: Path) -> None:
    sweep(sweep_work.eigenvalues, pieces(8), tmp_path / "p", stamp=STAMP, workers=2)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        cluster.get_client() as client,
    ):
        sweep(sweep_work.eigenvalues, pieces(8), tmp_path / "d", stamp=STAMP,
              executor=client.get_executor())  # fmt: skip
    assert rows(tmp_path / "d") == rows(tmp_path / "p")


def test_dask_says_nothing_beside_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A connection that breaks is logged, with its traceback, by any of Dask's modules."""
    monkeypatch.setattr("slewctl.compare.study.dask_cluster._TIMEOUT", 0.1)
    with (
        pytest.raises(InputError, match="no Dask scheduler answers"),
        dask_cluster("tcp://[::1]:1"),
    ):
        pass
    for logger in ("distributed.batched", "distributed.client"):
        assert not logging.getLogger(logger).isEnabledFor(logging.ERROR)


def test_an_error_in_a_worker_comes_back_as_it_was(tmp_path: Path) -> None:
    """An error that cannot be pickled would break the pool, and look like a killed worker."""
    with pytest.raises(InputError) as caught:
        sweep(sweep_work.refusing, pieces(3), tmp_path / "r", stamp=STAMP, workers=2)
    assert str(caught.value) == "a.b: wrong; mend it"
    assert type(caught.value) is InputError


def test_rows_are_a_sequence_of_mappings(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as threads:
        sweep(sweep_work.squares, pieces(5), tmp_path / "r", stamp=STAMP, executor=threads)
    found = rows(tmp_path / "r")
    assert len(found) == 5
    assert list(found) == [{"number": i, "square": float(i**2)} for i in range(5)]
    assert found[-1] == {"number": 4, "square": 16.0}
    assert list(found[1:3]) == list(found)[1:3]
    with pytest.raises(IndexError):
        found[5]


def test_rows_with_other_keys_are_no_results(tmp_path: Path) -> None:
    results = tmp_path / "r"
    with ThreadPoolExecutor(1) as threads:
        sweep(lambda key: [{key: 1.0}], [Piece(key, key) for key in "ab"], results, stamp=STAMP,
              executor=threads)  # fmt: skip
    with pytest.raises(InputError, match="not the results of a sweep"):
        rows(results)


class Scheduler:
    """What Dask's executor is to a sweep: workers come and go, and so may the scheduler."""

    def __init__(self, threads: dict[str, int]) -> None:
        self.threads = threads
        self.waiting: list[tuple[Future[object], Callable[[], object]]] = []

    def nthreads(self) -> dict[str, int]:
        if not self.threads:
            raise OSError("no scheduler")
        return self.threads

    def submit(self, function: Callable[..., object], *arguments: object) -> Future[object]:
        future: Future[object] = Future()
        self.waiting.append((future, lambda: function(*arguments)))
        return future

    def cancel(self) -> None:
        for future, _ in self.waiting:
            future.cancel()
            future.set_running_or_notify_cancel()

    @property
    def executor(self) -> Executor:
        executor = Executor()
        vars(executor).update(submit=self.submit, _client=self)
        return executor


class Dropping(Scheduler):
    """Drops its work soon after it was given the third piece."""

    def submit(self, function: Callable[..., object], *arguments: object) -> Future[object]:
        future = super().submit(function, *arguments)
        if len(self.waiting) == 3:
            threading.Timer(0.1, self.cancel).start()
        return future


def test_pieces_in_flight_follow_the_workers_of_a_cluster(tmp_path: Path) -> None:
    cluster = Scheduler({"a": 2})
    seen: list[int] = []

    def watched() -> Iterator[Piece]:
        for piece in pieces(60):
            if piece.work == 30:
                cluster.threads = {"a": 2, "b": 8}
            seen.append(len(cluster.waiting))
            yield piece

    def wait(
        flying: Iterable[Future[object]], **_: object
    ) -> tuple[set[Future[object]], set[object]]:
        future, work = cluster.waiting.pop(0)
        future.set_result(work())
        return {future}, set()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules[sweep.__module__], "wait", wait)
        sweep(sweep_work.squares, watched(), tmp_path / "r", stamp=STAMP,
              executor=cluster.executor)  # fmt: skip
    assert max(seen[:30]) == 5  # three for each thread, the one being taken among them
    assert max(seen) == 29
    assert len(rows(tmp_path / "r")) == 60


def test_an_executor_that_loses_its_workers_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules[sweep.__module__], "_PATIENCE", 0.05)
    gone = Scheduler({})
    with pytest.raises(WorkerDiedError, match=r"no worker is left; .*--resume"):
        sweep(sweep_work.squares, pieces(3), tmp_path / "n", stamp=STAMP, executor=gone.executor)
    dropping = Dropping({"a": 1})
    with pytest.raises(WorkerDiedError, match=r"dropped its work; .*--resume"):
        sweep(sweep_work.squares, pieces(3), tmp_path / "d", stamp=STAMP,
              executor=dropping.executor)  # fmt: skip


def test_a_broken_pool_of_the_user_is_told(tmp_path: Path) -> None:
    work = [Piece(f"{i:05d}", (i, str(tmp_path))) for i in range(9)]
    with (
        ProcessPoolExecutor(1, get_context("fork")) as pool,
        pytest.raises(WorkerDiedError, match=r"its pool is broken; .*--resume"),
    ):
        sweep(sweep_work.deadly, work, tmp_path / "r", stamp=STAMP, executor=pool)


def test_a_worker_of_another_version_is_refused() -> None:
    """On whatever executor, and whenever it comes."""
    wanted = {**versions(), "scipy": "99.1"}
    with pytest.raises(
        InputError, match=rf"a worker has scipy {versions()['scipy']} \(here 99.1\)"
    ):
        _limited(sweep_work.squares, [1], wanted)
