"""The commands ``study`` and ``recommend``."""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from rich.table import Table

from slewctl.arm import catalogue
from slewctl.breakdown import computing
from slewctl.cli.options import options_named
from slewctl.cli.terminal import (
    ERR,
    OUT,
    PATIENCE,
    counter,
    next_step,
    number_table,
    progress,
    show,
)
from slewctl.compare import (
    COLUMNS,
    Recommendation,
    Study,
    count_points,
    count_trials,
    dask_cluster,
    recommend,
    run_study,
)
from slewctl.compare.study.grid import check_sensors
from slewctl.compare.study.processes import ENDINGS
from slewctl.compare.study.recommend import require_clock
from slewctl.compare.study.slices import COMMON
from slewctl.design.clocked import read_clock
from slewctl.errors import InputError, check_choice
from slewctl.files import computing_arm, find_arm, read_study


def study(
    file: Path,
    out: Path,
    *,
    resume: bool,
    workers: int | None,
    dask: str | None,
    slices: Sequence[str],
    parquet: bool,
) -> None:
    """Run a study, or go on with one, and write its report."""
    wanted = _slices(slices)
    asked = read_study(file)
    results = out / "results.jsonl"
    with _resumable(results):
        from slewctl.report import write_study  # matplotlib is only needed here

        cluster = nullcontext() if dask is None else dask_cluster(dask)
        if dask is not None:  # tasks of connections that break are told in our words
            logging.getLogger("asyncio").setLevel(logging.CRITICAL)
        # What is wrong with the results or the cluster is no fault of the file.
        elsewhere = {"dask": "--dask", "executor": "--dask", "study": str(file), "": str(file)}
        with (
            options_named(elsewhere),
            cluster as executor,
            counter(count_points(asked)) as step,
            computing(),
        ):
            result = run_study(
                asked, results, stamp=_stamp(asked), executor=executor,
                workers=workers, resume=resume, progress=step, notice=_notice,
            )  # fmt: skip
        with options_named({"slice": "--slice"}):
            page = write_study(result, out, as_parquet=parquet, wanted=wanted)
    for sentence in result.answer.sentences:
        OUT.print(sentence)
    if result.refused:
        refused = f"{result.refused} of {len(result.rows)} designs could not be made"
        OUT.print(f"{refused}; rows.csv.gz says why")
    OUT.print(f"report: {page}")


def _slices(given: Sequence[str]) -> dict[str, str]:
    """Return the values asked for by their axes."""
    wanted = {}
    for text in given:
        axis, sign, value = text.partition("=")
        check_choice(axis, COMMON, "--slice")
        if not (sign and value):
            raise InputError("no value", where=f"--slice {axis}", remedy=f"as in {axis}=0.1")
        wanted[axis] = value
    return wanted


def _stamp(study: Study) -> dict[str, Any]:
    """Return what the results depend on."""
    return {"columns": COLUMNS, "arm": repr(study.arm), "truth_modes": study.truth_modes}


def _notice(sentence: str) -> None:
    """Print a sentence on standard error, if that can be written to."""
    ERR.tell(sentence)


@contextmanager
def _resumable(results: Path) -> Iterator[None]:
    """Let Ctrl-C, a terminal that closes or SIGTERM end the work with one line.

    The line says how to go on; the status is that of a program which the signal has ended.
    """

    ended = False

    def end(number: int, _: object) -> None:
        nonlocal ended
        ended = True
        for each in before:  # a second signal must not disturb the end
            signal.signal(each, signal.SIG_IGN)
        raise _EndedError(number)

    before = {n: h for n in ENDINGS if (h := signal.getsignal(n)) not in (signal.SIG_IGN, None)}
    for number in before:
        signal.signal(number, end)
    try:
        yield
    except _EndedError as error:
        _notice(f"interrupted; what was finished is in {results}: go on with --resume")
        raise SystemExit(128 + error.number) from None
    finally:
        if not ended:
            for number, handler in before.items():
                signal.signal(number, handler)


class _EndedError(KeyboardInterrupt):
    """A signal has ended the work."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def print_recommendation(
    arm: str, sensors: str, sample_time: float | None, delay: float, as_json: bool
) -> None:
    """Print which basis, order and bandwidth suit an arm."""
    known = arm in catalogue.names()
    chosen = catalogue.damped(arm) if known else find_arm(arm)
    damping = str(catalogue.CATALOGUE[arm].damping) if known else ""
    with options_named({"sensors": "--sensors"}):
        names = check_sensors([name.strip() for name in sensors.split(",")])
    with options_named({"sample_time": "--sample-time", "delay": "--delay"}):
        read_clock(sample_time, delay)
        require_clock(chosen, sample_time)
    with progress(count_trials(), every=PATIENCE) as step, computing_arm(arm):
        advice = recommend(
            chosen, names, sample_time=sample_time, delay=delay, damping=damping, progress=step
        )
    if as_json:
        OUT.text(json.dumps(advice.to_dict(), indent=1))
        return
    OUT.text(str(advice))
    show(_evidence(advice))
    next_step(f"slewctl init design.toml --from {arm}" if known else f"slewctl check {arm}",
              "with that basis, n and speed in the file")  # fmt: skip


def _evidence(advice: Recommendation) -> Table:
    """Return the bandwidth limit in Hz of every basis and number of functions."""
    orders = sorted({trial.n for trial in advice.trials})
    table = number_table("bandwidth limit (Hz)", *(f"n = {n}" for n in orders))
    for basis in dict.fromkeys(trial.basis for trial in advice.trials):
        limits = [advice.limit(basis, n) for n in orders]
        table.add_row(basis, *(f"{limit:.4g}" if limit else "none" for limit in limits))
    return table
