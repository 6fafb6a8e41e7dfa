"""What a large study costs after its points are done: its answer, its report, its memory.

Run as ``python tests/benchmarks/scale.py [rows]``: rows of a study of that size are drawn, as if
they had been computed, written as a sweep writes them, read, answered and reported.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from slewctl import arms
from slewctl.compare import Grid, Study
from slewctl.compare.study.point import Work, evaluate_point
from slewctl.compare.study.result import StudyResult
from slewctl.compare.study.results_file import rows
from slewctl.compare.study.sweep import Piece, sweep
from slewctl.report import write_study

BASES = ("clamped-free", "slewing", "hub-matched", "arm-matched")
# 4 bases, 5 orders, 10 hubs, 5 payloads, 2 damping ratios: so many rows to a bandwidth.
PER_BANDWIDTH = 2000
# What is known of a design whose loop is unstable, too.
OF_THE_MODEL = ("nu_gap", "generalised_margin", "frequency_error", "worst_frequency_error",
                "condition")  # fmt: skip


def study_of(number: int) -> Study:
    """Return a study of about so many points."""
    bandwidths = np.geomspace(0.05, 0.6, max(1, number // PER_BANDWIDTH))
    grid = Grid(
        BASES,
        orders=(1, 2, 4, 6, 8),
        hub_ratios=(0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0),
        payload_ratios=(0.0, 0.1, 0.3, 1.0, 3.0),
        damping_ratios=(0.002, 0.01),
        bandwidths=tuple(float(f"{b:.6g}") for b in bandwidths),
    )
    return Study("large", "", arms.paper_beam(), (grid,), truth_modes=20)


def drawn(study: Study) -> Callable[[Any], list[dict[str, Any]]]:
    """Return a function that gives every point a row such as it would have."""
    first = evaluate_point(Work(study.arm, study.truth_modes, next(iter(study.points()))))[0]
    random = np.random.default_rng(1)

    def row(point: Any) -> list[dict[str, Any]]:
        axes = dataclasses.asdict(point.setting) | {"basis": point.basis, "n": point.n}
        axes["sensors"] = first["sensors"]
        numbers = {
            key: float(value * random.lognormal(0.0, 0.4))
            for key, value in first.items()
            if isinstance(value, float)
        }
        if random.random() < 0.1:
            lost = dict.fromkeys(first) | {key: numbers[key] for key in OF_THE_MODEL}
            lost |= {"outcome": "unstable", "stable_on_twice": False, "verified": True}
            lost |= {"unstable_mode": int(random.integers(1, 9)), "optimum_drift": 1e-6}
            return [lost | {key: axes.get(key, first[key]) for key in list(first)[:9]}]
        known = {key: value for key, value in axes.items() if key in first}
        return [first | numbers | known | {"outcome": "stable"}]

    return row


def peak() -> float:
    """Return the peak memory of this process in MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def timed(what: str, call: Callable[[], Any]) -> Any:
    """Return what a call returns, and print its CPU time and the memory so far."""
    start = time.process_time()
    found = call()
    print(f"  {what:10} {time.process_time() - start:7.2f} s, {peak():7.0f} MB", flush=True)
    return found


def main() -> None:
    """Print what was measured."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    study = study_of(number)
    row = drawn(study)

    def pieces() -> Iterator[Piece]:
        for point in study.points():
            yield Piece(point.key, point, group=repr(point.setting))

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows.jsonl"
        with ThreadPoolExecutor(1) as threads:
            sweep(row, pieces(), path, stamp={}, executor=threads)
        print(f"{path.stat().st_size / 1e6:.0f} MB of results, {peak():.0f} MB")
        table = timed("read", lambda: rows(path))
        print(f"{len(table)} rows")
        result = StudyResult(study, table)
        timed("answered", lambda: result.answer)
        page = timed("reported", lambda: write_study(result, Path(folder) / "report"))
        print(f"  page {page.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
