"""Sweeps: the same results on any executor, and nothing lost but what was in flight."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import distributed
import pytest
import sweep_work

from slewctl.compare.sweep import Piece, WorkerDiedError, rows, sweep
from slewctl.errors import InputError

STAMP = {"study": "a"}


def pieces(count: int) -> list[Piece]:
    return [Piece(f"{i:05d}", i) for i in range(count)]


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let worker processes import the functions that they are given."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))


def test_rows_come_back_in_order_whoever_computed_them(tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as threads:
        sweep(sweep_work.eigenvalues, pieces(6), tmp_path / "t", stamp=STAMP, executor=threads)
    sweep(sweep_work.eigenvalues, reversed(pieces(6)), tmp_path / "p", stamp=STAMP, workers=2)
    assert rows(tmp_path / "t") == rows(tmp_path / "p")
    assert [row["seed"] for row in rows(tmp_path / "p")] == list(range(6))


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
        sweep(counted, pieces(7), results, stamp=STAMP, executor=threads, resume=True)
    assert sorted(done) == list(range(7))
    assert [row["square"] for row in rows(results)] == [i**2 for i in range(7)]
    for line in results.read_text().splitlines():
        json.loads(line)


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


def test_a_killed_worker_costs_nothing_and_a_killer_is_named(tmp_path: Path) -> None:
    work = [Piece(f"{i:05d}", (i, str(tmp_path))) for i in range(9)]
    with pytest.raises(WorkerDiedError, match="00003"):
        sweep(sweep_work.deadly, work, tmp_path / "r", stamp=STAMP, workers=2)
    assert [row["number"] for row in rows(tmp_path / "r")] == [0, 1, 2, 4, 5, 6, 7, 8]


def test_an_interruption_leaves_what_was_finished(tmp_path: Path) -> None:
    results = tmp_path / "r"
    code = (
        "import sys, sweep_work\nfrom pathlib import Path\n"
        "from slewctl.compare.sweep import Piece, sweep\n"
        "if __name__ == '__main__':\n"
        "    work = [Piece(f'{i:05d}', i) for i in range(1000)]\n"
        "    sweep(sweep_work.slow, work, Path(sys.argv[1]), stamp={}, workers=2)\n"
    )
    script = tmp_path / "run.py"
    script.write_text(code)
    process = subprocess.Popen(
        [sys.executable, str(script), str(results)], env=dict(os.environ), stderr=subprocess.PIPE
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (
        results.exists() and results.read_text().count("\n") > 3
    ):
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode != 0
    assert errors.count(b"Traceback") == 1  # the parent's own; no worker complains
    found = rows(results)
    assert 3 <= len(found) < 1000


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
        sweep(sweep_work.squares, pieces(2), results, stamp=STAMP, executor=threads)
    with results.open("a") as file:
        file.write('{"key": "z", "rows": [{"number": 1, "cube": 1.0}]}\n')
    with pytest.raises(InputError, match="not the results of a sweep"):
        rows(results)
