"""The commands for one design file: what it is worth, what it does, and what it becomes."""

from __future__ import annotations

from pathlib import Path

import click

from slewctl.cli.options import OUT_FOLDER, OUT_MAYBE


@click.command("design")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path, dir_okay=False),
              metavar="FILE", help="Where to write it: .json, .mat or .npz.")  # fmt: skip
@click.pass_context
def design_command(context: click.Context, design: Path, out: Path) -> None:
    """Write the controller of DESIGN (a TOML file) to a file, as data.

    It is written whether its own checks pass or not; the exit status is 1 where they do not.
    """
    from slewctl.cli.designing import write_design

    context.exit(write_design(design, out))


@click.command("explain")
@click.argument("design", type=click.Path(path_type=Path))
def explain_command(design: Path) -> None:
    """Say what limits DESIGN (a TOML file), and what to change first.

    A few changes are made and judged: a larger model, a slower and a faster controller, a
    shorter clock; of a design that fails, a far slower one.  The one that leaves the tightest
    requirement the most room is told.
    """
    from slewctl.cli.beginning import print_explanation

    print_explanation(design)


@click.command("explore")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--port", default=0, type=click.IntRange(0, 65535), metavar="N",
              help="Where to listen; any free port by default.")  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Print the address, and open nothing.")
def explore_command(design: Path, port: int, no_browser: bool) -> None:
    """Turn what DESIGN (a TOML file) is made of, and see its verdicts and curves follow.

    A page on this machine alone: sliders for the arm, the model, the controller and its clock;
    what is set can be saved as a design file. Needs slewctl[explore]. Ctrl-C ends it.
    """
    from slewctl.cli.exploring import explore

    explore(design, port, show=not no_browser)


@click.command("export")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--format", "form", default="c", show_default=True,
              type=click.Choice(["c", "fmu", "mat", "npz", "json"]),
              help="Code, a unit for co-simulation, or data.")  # fmt: skip
@OUT_FOLDER
@click.pass_context
def export_command(context: click.Context, design: Path, form: str, out: Path) -> None:
    """Write the controller of DESIGN (a TOML file) for what runs it: as C code, or as data.

    The code needs no library: a header, a source, a test program with what it must give, and an
    Arduino sketch; an FMU (FMI 2.0, co-simulation) holds the same, compiled. Numbers and raw
    units are those of the file's [export] table. The controller must hold its loop on the
    truth; the exit status is 1 where its own checks fail.
    """
    from slewctl.cli.exporting import export_design

    context.exit(export_design(design, form, out))


@click.command("simulate")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--variation", metavar="NAME", help="On this variation's arm, not the file's own.")
@click.option("--step", type=float, metavar="S", help="The longest step in s.")
@click.option("--beside", type=click.Path(path_type=Path), metavar="DESIGN",
              help="Another design's slew, side by side in the animation.")  # fmt: skip
@click.option("--gif", type=click.Path(path_type=Path), metavar="FILE",
              help="Write the moving arm as a GIF.")  # fmt: skip
@OUT_MAYBE
def simulate_command(
    design: Path,
    variation: str | None,
    step: float | None,
    beside: Path | None,
    gif: Path | None,
    out: Path | None,
) -> None:
    """Simulate the slew of DESIGN (a TOML file) as it happens, on the truth.

    Limits, friction, encoder, clock, noise and loads are those of its [slew]. DIR gets the
    moving arm, the figures and all signals.
    """
    from slewctl.cli.simulating import simulate_design

    simulate_design(design, variation, step, out, beside=beside, gif=gif)


@click.command("shape")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("-m", "--modes", type=click.IntRange(1, 9), metavar="N",
              help="How many modes are shaped; those of the file, or one.")  # fmt: skip
@click.option("--error", default=0.1, show_default=True, type=float, metavar="FRACTION",
              help="How far off the frequencies may be, relative.")  # fmt: skip
@OUT_MAYBE
def shape_command(design: Path, modes: int | None, error: float, out: Path | None) -> None:
    """Compare input shapers and profiles for the slew of DESIGN (a TOML file).

    Durations, residuals with the frequencies as they are and off, what is left of the tip on
    the truth, and the shortest slew that the drive can make.
    """
    from slewctl.cli.shaping import shape_design

    shape_design(design, modes, error, out)


@click.command("report")
@click.argument("design", type=click.Path(path_type=Path))
@click.option(
    "--sheet", metavar="ARM", help="The data sheet's arm: a TOML file or a catalogue name."
)
@click.option("--log", type=click.Path(path_type=Path), metavar="FILE",
              help="A log of the rig, to which that arm is fitted.")  # fmt: skip
@click.option("--free", default="", metavar="NAMES", help="What of it is fitted, as in identify.")
@click.option("--column", "columns", multiple=True, metavar="NAME=COLUMN",
              help="A column of the log by another name; repeatable.")  # fmt: skip
@click.option("--sample-time", type=float, metavar="S", help="Of the log, where it has no times.")
@click.option("--counts", type=float, metavar="N", help="Counts per turn of the log's encoder.")
@OUT_FOLDER
@click.pass_context
def report_command(
    context: click.Context,
    design: Path,
    sheet: str | None,
    log: Path | None,
    free: str,
    columns: tuple[str, ...],
    sample_time: float | None,
    counts: float | None,
    out: Path,
) -> None:
    """Write the whole way of DESIGN (a TOML file) on one page, from data sheet to code.

    Arm, fit, design, verdict, slew and code. DIR gets the page, the C code, the signals of the
    slew and the fitted arm. With a data sheet and a log of the rig the page shows what the fit
    made of it, and whether the design's arm is the fitted one. The exit status is 1 where a
    requirement fails.
    """
    from slewctl.cli.reporting import Logged, report_design

    logged = Logged(log, free, columns, sample_time, counts)
    context.exit(report_design(design, sheet, logged, out))


@click.command("worst")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--box", multiple=True, metavar="NAME=LOW:HIGH",
              help="A property and its range, instead of the file's; repeatable.")  # fmt: skip
@click.option("--quantity", help="What is to be good; disk_margin by default.")
@click.option("--samples", type=click.IntRange(0), metavar="N",
              help="Arms inside of the box, beside its corners; 32 by default.")  # fmt: skip
@click.option("--searches", type=click.IntRange(0), metavar="N",
              help="Searches from the worst arms so far; 2 by default.")  # fmt: skip
@click.option("--evaluations", type=click.IntRange(1), metavar="N",
              help="Most arms of each search; 60 by default.")  # fmt: skip
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Of the samples; 0 by default.")
@click.option("--json", "as_json", is_flag=True, help="Print all arms as JSON.")
@click.pass_context
def worst_command(
    context: click.Context,
    design: Path,
    box: tuple[str, ...],
    quantity: str | None,
    samples: int | None,
    searches: int | None,
    evaluations: int | None,
    seed: int | None,
    as_json: bool,
) -> None:
    """Look for the worst arm in a box of properties around that of DESIGN (a TOML file).

    The controller is made once, for the file's own arm. What is found is an arm that can be
    judged again, and no proof that there is none worse. The exit status is 1 where the loop is
    unstable on it.
    """
    from slewctl.cli.worst import Asked, print_worst

    asked = Asked(box, quantity, samples, searches, evaluations, seed)
    context.exit(print_worst(design, asked, as_json))


DESIGN_COMMANDS = (
    design_command,
    explain_command,
    explore_command,
    export_command,
    report_command,
    simulate_command,
    shape_command,
    worst_command,
)
