"""The commands: what each takes.  What a command does is loaded when it is run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import click
from click.core import ParameterSource

from slewctl.cli import interrupted
from slewctl.cli.design_commands import DESIGN_COMMANDS
from slewctl.cli.options import OUT_FOLDER, OUT_MAYBE, PARQUET

F = TypeVar("F", bound=Callable[..., object])
_PATHS = click.argument(
    "paths", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="PATH..."
)


_COLUMNS = click.option(
    "--column", "columns", multiple=True, metavar="NAME=COLUMN",
    help="What the file calls a signal, such as theta_deg=enc; repeatable.",
)  # fmt: skip
_CLOCK = click.option("--sample-time", type=float, metavar="S", help="The clock, in s.")
_COUNTS = click.option("--counts", type=float, metavar="N",
                       help="Counts of the encoder in a turn, for theta_counts.")  # fmt: skip


class _Group(click.Group):
    """Commands of which Ctrl-C ends each in the same way."""

    def invoke(self, context: click.Context) -> object:
        """Run the command asked for."""
        try:
            return super().invoke(context)
        except KeyboardInterrupt:
            interrupted()


@click.group(cls=_Group)
@click.version_option(package_name="slewctl")
def cli() -> None:
    """Control design for slewing flexible arms.

    Exit status: 0 when all went well, 1 where check or report finds a requirement that fails (of
    other commands see their --help), 2 for bad input.
    """


def _file(name: str, text: str) -> Callable[[F], F]:
    """Return an option that names a file."""
    return click.option(name, type=click.Path(path_type=Path, dir_okay=False),
                        metavar="FILE", help=text)  # fmt: skip


@cli.command("init")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--from", "origin", default="beam", show_default=True, metavar="NAME",
              help="What to begin with: beam, modal-data, pid, measured, or an arm of the "
              "catalogue.")  # fmt: skip
def init_command(file: Path, origin: str) -> None:
    """Write a commented design FILE to begin with, which passes `slewctl check`."""
    from slewctl.cli.beginning import write_starter

    write_starter(file, origin)


@cli.command("modes")
@click.argument("arm")
@click.option("-n", "--orders", default=6, show_default=True, type=click.IntRange(1, 60),
              help="Largest number of functions.")  # fmt: skip
@click.option("-m", "--modes", default=3, show_default=True, type=click.IntRange(1, 20),
              help="How many flexible frequencies to print.")  # fmt: skip
@click.option("--locked", is_flag=True, help="With the hub held, as on a clamp or in a data sheet.")
def modes_command(arm: str, orders: int, modes: int, locked: bool) -> None:
    """Print the natural frequencies of ARM by basis and number of functions.

    ARM is a catalogue name or a TOML file with an [arm] table.
    """
    from slewctl.cli.arms import print_modes

    print_modes(arm, orders, modes, locked)


@cli.command("arms")
@click.argument("name", required=False)
def arms_command(name: str | None) -> None:
    """List the arms of the catalogue, or tell all about the one called NAME."""
    from slewctl.cli.arms import print_arms

    print_arms(name)


@cli.command("compare")
@_PATHS
@OUT_FOLDER
@PARQUET
@click.option("--split", is_flag=True,
              help="Write one page per design, and one that leads to them.")  # fmt: skip
@click.option("--figures", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
              help="Write each figure as PDF and PNG too, its data as CSV, and tables for "
              "LaTeX.")  # fmt: skip
@click.option("--style", metavar="NAME",
              help="Of the figures: paper (one column, 3.5 in; by default), wide (7.2 in) or "
              "slides.")  # fmt: skip
@click.pass_context
def compare_command(
    context: click.Context,
    paths: tuple[Path, ...],
    out: Path,
    parquet: bool,
    split: bool,
    figures: Path | None,
    style: str | None,
) -> None:
    """Compare the designs in PATH (TOML files or folders of them) on the truth.

    A design that cannot be judged is told, and left out of the report.
    """
    from slewctl.cli.comparing import Outputs, compare_designs

    outputs = Outputs(out, parquet=parquet, split=split, figures=figures, style=style)
    context.exit(compare_designs(paths, outputs))


@cli.command("ladder")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--basis", help="Design on another basis than the file's.")
@click.option("-n", "n", type=click.IntRange(1), help="Design on another number of functions.")
def ladder_command(design: Path, basis: str | None, n: int | None) -> None:
    """Judge DESIGN (a TOML file) with more and more modes of the truth.

    Says at which number of modes the loop is lost, and which mode is lost first.
    """
    from slewctl.cli.comparing import print_ladder

    print_ladder(design, basis, n)


@cli.command("check")
@_PATHS
@click.option("--all", "every", is_flag=True, help="Show every requirement, not the tightest.")
@click.option("--quiet", is_flag=True, help="Print what failed, and nothing else.")
@_file("--junit", "Write the verdicts as JUnit XML.")
@_file("--json", "Write verdicts and measured values as JSON (schema slewctl-check/2).")
@click.option("--github", is_flag=True,
              help="Print failures as GitHub annotations, at the file's line.")  # fmt: skip
@_file("--baseline", "Fail when a margin or required quantity is worse than in this file, which "
       "holds the last accepted run.")  # fmt: skip
@click.option("--tolerance", default=0.01, show_default=True, type=float, metavar="FRACTION",
              help="How much worse than the baseline is allowed, relative.")  # fmt: skip
@click.option("--update-baseline", is_flag=True,
              help="Accept this run: write what passed to the --baseline file instead of "
              "comparing with it.")  # fmt: skip
@click.option("--changed-only", is_flag=True,
              help="Skip designs that the --baseline file accepted and that did not change: same "
              "text, same slewctl, same numerical packages.")  # fmt: skip
@click.option("--compiled", is_flag=True,
              help="Judge the code that runs: what `slewctl export` writes, compiled by the "
              "system's compiler and read back.")  # fmt: skip
@click.pass_context
def check_command(
    context: click.Context,
    paths: tuple[Path, ...],
    every: bool,
    quiet: bool,
    junit: Path | None,
    json: Path | None,
    github: bool,
    baseline: Path | None,
    tolerance: float,
    update_baseline: bool,
    changed_only: bool,
    compiled: bool,
) -> None:
    """Check the requirements of the designs in PATH (TOML files or folders of them).

    Each controller is designed as its file says and judged on the converged truth of its arm
    and of the arm's named variations.

    \b
    Exit status:
      0  all requirements hold, and nothing is worse than in the baseline
      1  a requirement failed, a quantity is worse than in the baseline, or a
         design of the baseline is gone
      2  bad input: a design that cannot be judged (the others are judged all the
         same), a path that is not there (nothing is judged), a missing or
         corrupt baseline, a file that cannot be written
    """
    _refuse_idle(context)
    from slewctl.cli.check import Outputs, check

    outputs = Outputs(junit, json, baseline)
    context.exit(
        check(
            paths, outputs, tolerance=tolerance, every=every, quiet=quiet, github=github,
            update_baseline=update_baseline, changed_only=changed_only, compiled=compiled,
        )
    )  # fmt: skip


def _refuse_idle(context: click.Context) -> None:
    """Refuse options of ``check`` that would do nothing beside the others."""

    def given(name: str) -> bool:
        return context.get_parameter_source(name) is not ParameterSource.DEFAULT

    for name, option in (("update_baseline", "--update-baseline"), ("changed_only",
                         "--changed-only"), ("tolerance", "--tolerance")):  # fmt: skip
        if given(name) and not given("baseline"):
            raise click.UsageError(f"{option} needs --baseline FILE.", context)
        if given(name) and given("update_baseline") and name != "update_baseline":
            raise click.UsageError(f"{option} means nothing with --update-baseline.", context)
    if given("compiled") and given("changed_only"):
        raise click.UsageError("--changed-only means nothing with --compiled.", context)
    if given("every") and given("quiet"):
        raise click.UsageError("--all means nothing with --quiet.", context)


@cli.command("identify")
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--arm", required=True, help="Where the fit starts: a catalogue name, or a TOML file "
              "with an [arm] table.")  # fmt: skip
@click.option("--free", required=True, metavar="NAMES",
              help="What to adjust, with commas between: beam.stiffness, beam.mass, hub.inertia, "
              "hub.radius, hub.friction, payload.mass, payload.inertia, damping or damping.1 and "
              "so on, delay, gain.")  # fmt: skip
@_COLUMNS
@_CLOCK
@_COUNTS
@click.option("--response", is_flag=True, help="The file holds a frequency response, no log.")
@click.option("--actuator", metavar="NAME",
              help="With --response: from what it is, torque or voltage; torque by default, "
              "unless the arm has a motor.")  # fmt: skip
@click.option("--sensor", metavar="NAME",
              help="With --response: to what it is, as columns are named, such as theta_deg; "
              "theta in rad by default.")  # fmt: skip
@_file("--controller", "Also judge this controller (.json, .mat or .npz) on the measured response "
       "and on the fitted arm.")  # fmt: skip
@OUT_FOLDER
def identify_command(
    log: Path,
    arm: str,
    free: str,
    columns: tuple[str, ...],
    sample_time: float | None,
    counts: float | None,
    response: bool,
    actuator: str | None,
    sensor: str | None,
    controller: Path | None,
    out: Path,
) -> None:
    """Fit an arm to a LOG of a rig, and report model beside measurement.

    Columns of LOG (.csv, .mat, .npz, .json) are known by names such as time_s, voltage,
    theta_deg and reference; docs/measurements.md has them all. DIR gets the report and the
    fitted arm as fitted.toml.
    """
    if not response:
        for given, option in ((actuator, "--actuator"), (sensor, "--sensor")):
            if given is not None:
                raise click.UsageError(f"{option} is for --response; columns of a log have names.")
    from slewctl.cli.identifying import identify

    identify(
        log, arm, free, out, columns=columns, between=(actuator, sensor) if response else None,
        sample_time=sample_time, counts=counts, controller=controller,
    )  # fmt: skip


@cli.command("replay")
@click.argument("log", type=click.Path(path_type=Path))
@click.argument("design", type=click.Path(path_type=Path))
@_COLUMNS
@_CLOCK
@_COUNTS
@OUT_MAYBE
def replay_command(
    log: Path,
    design: Path,
    columns: tuple[str, ...],
    sample_time: float | None,
    counts: float | None,
    out: Path | None,
) -> None:
    """Hold a LOG of a slew beside what DESIGN (a TOML file) predicts of it.

    How well they agree, where they part, what the drive had to give, and whether gain and dead
    time are within the margins. Columns of LOG are known by their names, as for identify.
    """
    from slewctl.cli.replaying import replay_log

    replay_log(log, design, out, columns=columns, sample_time=sample_time, counts=counts)


@cli.command("study")
@click.argument("file", type=click.Path(path_type=Path))
@OUT_FOLDER
@click.option("--resume", is_flag=True, help="Go on with the results that are in the folder.")
@click.option("--workers", type=click.IntRange(1), metavar="N",
              help="Processes to use; as many as there are cores by default.")  # fmt: skip
@click.option(
    "--dask", metavar="ADDRESS",
    help="Run on this Dask cluster, such as tcp://host:8786; needs slewctl[dask]. It runs the "
    "code that it is sent: name only one that you trust, in a network that you trust.",
)  # fmt: skip
@click.option("--slice", "slices", multiple=True, metavar="AXIS=VALUE",
              help="With --resume: draw the maps at this value, such as bandwidth=0.1 or "
              "sensors=theta; repeatable.")  # fmt: skip
@PARQUET
def study_command(
    file: Path,
    out: Path,
    resume: bool,
    workers: int | None,
    dask: str | None,
    slices: tuple[str, ...],
    parquet: bool,
) -> None:
    """Try the grid of designs in FILE on the truth and report which basis wins where.

    Every finished design is kept at once in DIR/results.jsonl; after an interruption, a kill
    or a full disk --resume goes on from there. A line of it that is damaged is named and its
    design tried again.
    """
    if dask is not None and workers:
        raise click.UsageError("--workers is for processes here; --dask has its own workers.")
    if slices and not resume:
        raise click.UsageError("--slice is for a study that is done; add --resume.")
    from slewctl.cli.study import study

    study(file, out, resume=resume, workers=workers, dask=dask, slices=slices, parquet=parquet)


@cli.command("recommend")
@click.argument("arm")
@click.option("--sensors", default="theta,theta_dot", show_default=True,
              help="What is measured: of theta, theta_dot, tip and tip_deflection.")  # fmt: skip
@click.option("--sample-time", type=float, metavar="SECONDS",
              help="The controller runs on this clock.")  # fmt: skip
@click.option("--delay", type=float, default=0.0, metavar="SECONDS",
              help="From a sample to the output that is computed from it.")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the evidence as JSON.")
def recommend_command(
    arm: str, sensors: str, sample_time: float | None, delay: float, as_json: bool
) -> None:
    """Say which basis, how many functions and how fast a controller suit ARM.

    ARM is a catalogue name, whose arm gets its suggested damping, or a TOML file with an
    [arm] table.
    """
    from slewctl.cli.study import print_recommendation

    print_recommendation(arm, sensors, sample_time, delay, as_json)


@cli.command("paper")
@OUT_FOLDER
def paper_command(out: Path) -> None:
    """Reproduce and correct the paper's tables and figures."""
    from slewctl.cli.paper import reproduce_paper

    reproduce_paper(out)


for command in DESIGN_COMMANDS:
    cli.add_command(command)
