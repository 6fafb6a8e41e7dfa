"""The commands: they parse, wire the rooms together and print."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from rich.table import Table

from slewctl.arm import Arm, catalogue
from slewctl.basis import NAMES, create
from slewctl.breakdown import computing
from slewctl.cli import interrupted
from slewctl.cli.check import check_command
from slewctl.cli.options import OUT_FOLDER, PARQUET
from slewctl.cli.study import recommend_command, study_command
from slewctl.cli.terminal import OUT, Told, number_table, progress, show
from slewctl.compare import (
    CaseResult,
    Comparison,
    Rung,
    compare,
    count_designs,
    spillover_ladder,
)
from slewctl.compare.ladder import TOLD
from slewctl.errors import InputError
from slewctl.files import (
    DesignFile,
    computing_arm,
    find_arm,
    find_designs,
    name_designs,
    read_design,
)
from slewctl.model import BOUNDARIES, assemble, frequencies, truth
from slewctl.paper import PARTS, reproduce

_PATHS = click.argument(
    "paths", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="PATH..."
)


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

    Exit status: 0 when all went well and all requirements hold, 1 when a requirement fails,
    2 for bad input.
    """


@cli.command("compare")
@_PATHS
@OUT_FOLDER
@PARQUET
@click.pass_context
def compare_command(
    context: click.Context, paths: tuple[Path, ...], out: Path, parquet: bool
) -> None:
    """Compare the designs in PATH (TOML files or folders of them) on the truth.

    A design that cannot be judged is told, and left out of the report.
    """
    from slewctl.report import write_comparison  # matplotlib is only needed here

    names = name_designs(find_designs(paths))
    if not names:
        raise InputError("only studies, no design", remedy="name a design file")
    told = Told()
    designs = [told.trying(read_design, path, name, slew=True) for path, name in names.items()]
    good = [design for design in designs if design is not None]
    with progress(count_designs([design.case for design in good])) as step:
        found = [told.trying(_compared, design, step) for design in good]
        results = tuple(case for cases in found if cases is not None for case in cases)
        if results:
            step("drawing")
            page = write_comparison(Comparison(results), out, as_parquet=parquet)
    for result in results:
        stable = sum(e.stable for e in result.evaluations)
        OUT.print(
            f"{result.case.name}: {stable} of {len(result.evaluations)} designs stable on the truth"
        )
    if results:
        OUT.print(f"report: {page}")
    context.exit(told.status)


def _compared(design: DesignFile, step: Callable[[str], None]) -> tuple[CaseResult, ...]:
    with design.source.computing():
        return compare([design.case], step).cases


cli.add_command(check_command)
cli.add_command(study_command)
cli.add_command(recommend_command)


@cli.command("ladder")
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--basis", help="Design on another basis than the file's.")
@click.option("-n", "n", type=click.IntRange(1), help="Design on another number of functions.")
def ladder_command(design: Path, basis: str | None, n: int | None) -> None:
    """Judge DESIGN (a TOML file) with more and more modes of the truth.

    Says at which number of modes the loop is lost, and which mode is lost first.
    """
    file = read_design(design)
    with file.source.computing():
        ladder = spillover_ladder(file.case, basis, n)
    table = number_table("modes N", "up to (Hz)", "gain (dB)", "phase (deg)", "disk", "lost (%)")
    for rung in ladder.rungs:
        table.add_row(str(rung.modes), f"{rung.frequency_hz:.5g}", *_rung_cells(rung))
    OUT.print(str(ladder))
    show(table)


def _rung_cells(rung: Rung) -> tuple[str, ...]:
    """Return margins and loss of a rung, or the frequency that grows."""
    if not rung.stable:
        return (f"unstable at {rung.judgement.unstable_hz[0]:.4g} Hz", "", "", "")
    *margins, loss = (rung.value(name) or 0.0 for name in TOLD)
    return tuple(f"{figure:.4g}" for figure in (*margins, 100 * loss))


@cli.command("modes")
@click.argument("arm")
@click.option("-n", "--orders", default=6, show_default=True, type=click.IntRange(1, 60),
              help="Largest number of functions.")  # fmt: skip
@click.option("-m", "--modes", default=3, show_default=True, type=click.IntRange(1, 20),
              help="How many flexible frequencies to print.")  # fmt: skip
def modes_command(arm: str, orders: int, modes: int) -> None:
    """Print the natural frequencies of ARM by basis and number of functions.

    ARM is a catalogue name or a TOML file with an [arm] table.
    """
    chosen = find_arm(arm)
    table = number_table("basis", "n", *(f"f{k} (Hz)" for k in range(1, modes + 1)))
    with computing_arm(arm):
        exact = truth(chosen, max(modes, 10))
        for basis in NAMES:
            for n in range(1, orders + 1):
                found = assemble(chosen, create(basis, n)).frequencies_hz[:modes]
                cells = [f"{f:.6f}" for f in found] + ["-"] * (modes - len(found))
                table.add_row(basis, str(n), *cells)
    table.add_row("truth", "", *(f"{f:.6f}" for f in exact.frequencies_hz[:modes]))
    show(table)
    OUT.print(str(exact))


@cli.command("arms")
@click.argument("name", required=False)
def arms_command(name: str | None) -> None:
    """List the arms of the catalogue, or tell all about the one called NAME."""
    if name is None:
        table = number_table("name", "length (m)", "what it is")
        for key, entry in catalogue.CATALOGUE.items():
            table.add_row(key, f"{entry.build().beam.length:g}", entry.summary)
        show(table)
        OUT.print("more about one: slewctl arms NAME")
        return
    arm = catalogue.get(name)
    entry = catalogue.CATALOGUE[name]
    parts = {"hub": arm.hub, "payload": arm.payload, "motor": arm.motor}
    texts = {"what": entry.summary, "source": entry.source, "uncertain": entry.uncertain}
    texts["damping ratio to design with"] = str(entry.damping)
    for title, text in {**texts, **parts}.items():
        OUT.print(f"{title}: {text}")
    with computing(name):
        table = _published(arm, entry)
    show(table)


def _published(arm: Arm, entry: catalogue.Entry) -> Table:
    """Return the arm's first frequencies, hub locked and free, beside those in print."""
    table = number_table("hub", "mode", "computed (Hz)", "published (Hz)", "difference")
    for boundary in BOUNDARIES:
        printed = {
            mode: hertz
            for published in entry.published
            if published.boundary == boundary
            for mode, hertz in published.frequencies_hz
        }
        computed = frequencies(arm, max([3, *printed]), boundary).hz
        for mode, hertz in enumerate(computed, start=1):
            beside = printed.get(mode)
            cells = ("", "") if beside is None else (f"{beside:g}", f"{hertz / beside - 1:+.2%}")
            table.add_row(boundary, str(mode), f"{hertz:.6g}", *cells)
    return table


@cli.command("paper")
@OUT_FOLDER
def paper_command(out: Path) -> None:
    """Reproduce and correct the paper's tables and figures."""
    from slewctl.report import write_paper  # matplotlib is only needed here

    with progress(len(PARTS)) as step, computing("paper"):
        reproduction = reproduce(step)
        page = write_paper(reproduction, out)
    OUT.print(f"report: {page}")
