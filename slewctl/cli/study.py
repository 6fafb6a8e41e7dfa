"""The commands ``study`` and ``recommend``."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from slewctl.breakdown import computing
from slewctl.cli.options import OUT_FOLDER, PARQUET
from slewctl.cli.terminal import ERR, OUT, counter, number_table, progress, show
from slewctl.compare import (
    COLUMNS,
    Recommendation,
    Study,
    count_points,
    count_trials,
    recommend,
    run_study,
)
from slewctl.errors import InputError
from slewctl.files import computing_arm, find_arm, read_study


@click.command("study")
@click.argument("file", type=click.Path(path_type=Path))
@OUT_FOLDER
@click.option("--resume", is_flag=True, help="Go on with the results that are in the folder.")
@click.option("--workers", type=click.IntRange(1), metavar="N",
              help="Processes to use; as many as there are cores by default.")  # fmt: skip
@click.option(
    "--dask", metavar="ADDRESS", help="Run on this Dask cluster, such as tcp://host:8786."
)
@PARQUET
def study_command(
    file: Path, out: Path, resume: bool, workers: int | None, dask: str | None, parquet: bool
) -> None:
    """Try the grid of designs in FILE on the truth and report which basis wins where.

    Every finished design is kept at once in DIR/results.jsonl; after an interruption
    --resume goes on from there.
    """
    from slewctl.report import write_study  # matplotlib is only needed here

    study = read_study(file)
    results = out / "results.jsonl"
    try:
        with (
            _executor(dask) as executor,
            counter(count_points(study)) as step,
            computing(str(file)),
        ):
            result = run_study(
                study, results, stamp=_stamp(study), executor=executor,
                workers=workers, resume=resume, progress=step,
            )  # fmt: skip
    except KeyboardInterrupt:
        ERR.print(f"what was finished is in {results}; go on with --resume", soft_wrap=True)
        raise
    page = write_study(result, out, as_parquet=parquet)
    for sentence in result.answer.sentences:
        OUT.print(sentence, soft_wrap=True)
    if result.refused:
        refused = f"{result.refused} of {len(result.rows)} designs could not be made"
        OUT.print(f"{refused}; rows.csv.gz says why", soft_wrap=True)
    OUT.print(f"report: {page}", soft_wrap=True)


def _stamp(study: Study) -> dict[str, Any]:
    """Return what the results depend on."""
    return {"slewctl": version("slewctl"), "columns": COLUMNS, "study": repr(study)}


@contextmanager
def _executor(address: str | None) -> Iterator[Executor | None]:
    """Yield the executor of a Dask cluster, or None for processes of our own."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client  # an option: only those who ask for it need it
    except ImportError as error:
        raise InputError(
            "Dask is not installed", where="--dask", remedy="pip install distributed"
        ) from error
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address}",
            where="--dask",
            remedy="give its address, such as tcp://host:8786",
        ) from error
    with client:
        yield client.get_executor()


@click.command("recommend")
@click.argument("arm")
@click.option("--sensors", default="theta,theta_dot", show_default=True,
              help="What is measured: of theta, theta_dot, tip and tip_deflection.")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the evidence as JSON.")
def recommend_command(arm: str, sensors: str, as_json: bool) -> None:
    """Say which basis, how many functions and how fast a controller suit ARM.

    ARM is a catalogue name or a TOML file with an [arm] table.
    """
    chosen = find_arm(arm)
    names = [name.strip() for name in sensors.split(",")]
    with progress(count_trials()) as step, computing_arm(arm):
        advice = recommend(chosen, names, progress=step)
    if as_json:
        OUT.text(json.dumps(advice.to_dict(), indent=1))
        return
    OUT.text(str(advice))
    show(_evidence(advice))


def _evidence(advice: Recommendation) -> Table:
    """Return the bandwidth limit in Hz of every basis and number of functions."""
    orders = sorted({trial.n for trial in advice.trials})
    table = number_table("bandwidth limit (Hz)", *(f"n = {n}" for n in orders))
    for basis in dict.fromkeys(trial.basis for trial in advice.trials):
        limits = [advice.limit(basis, n) for n in orders]
        table.add_row(basis, *(f"{limit:.4g}" if limit else "none" for limit in limits))
    return table
