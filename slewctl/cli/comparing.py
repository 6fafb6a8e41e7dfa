"""The commands ``compare`` and ``ladder``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slewctl.check.words import told_finding
from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, Told, number_table, progress, show
from slewctl.compare import (
    QUANTITIES,
    CaseResult,
    Comparison,
    Rung,
    compare,
    count_designs,
    spillover_ladder,
)
from slewctl.compare.ladder import TOLD, redesigned
from slewctl.compare.study.processes import Processes, usable_cores
from slewctl.design import Controller
from slewctl.errors import InputError, SlewctlError, check_choice
from slewctl.files import (
    DesignFile,
    find_designs,
    name_designs,
    read_design,
)
from slewctl.gate import verdicts

if TYPE_CHECKING:
    from slewctl.loop.on_measured import OnMeasured

_HEADINGS = {
    "gain_margin_db": "gain (dB)",
    "phase_margin_deg": "phase (deg)",
    "disk_margin": "disk",
    "h2_loss": "lost (%)",
}


@dataclass(frozen=True)
class Outputs:
    """Where to write the report and the figures, and how."""

    out: Path
    parquet: bool = False
    split: bool = False
    figures: Path | None = None
    style: str | None = None

    def check(self) -> None:
        """Refuse what cannot be written, before anything is computed."""
        if self.style is None:
            return
        from slewctl.report.printed import STYLES  # loads matplotlib, for figures alone

        check_choice(self.style, STYLES, "--style")
        if self.figures is None:
            raise InputError(
                "is a style of figures, and none are asked for",
                where="--style",
                remedy="add --figures DIR",
            )

    @property
    def printed(self) -> str:
        """The style of the figures; empty where none are asked for."""
        return (self.style or "paper") if self.figures else ""


def compare_designs(paths: Sequence[Path], outputs: Outputs) -> int:
    """Write the comparison report of designs; return the exit status."""
    from slewctl.report import write_comparison

    outputs.check()
    names = name_designs(find_designs(paths))
    if not names:
        raise InputError("only studies or arms, no design", remedy="name a design file")
    told = Told()
    designs = [told.trying(read_design, path, name) for path, name in names.items()]
    good = [design for design in designs if design is not None]
    with progress(count_designs([design.case for design in good])) as step:
        found = [
            pair for pair in _all_compared(good, outputs.printed, told, step) if pair is not None
        ]
        results = tuple(result for result, _, _ in found)
        if results:
            step("writing")
            page = write_comparison(
                Comparison(results),
                outputs.out,
                as_parquet=outputs.parquet,
                sections=[section for _, section, _ in found],
                split=outputs.split,
            )
            if outputs.figures is not None:
                from slewctl.report import write_figures  # loads matplotlib

                drawn = [files for _, _, files in found]
                write_figures(Comparison(results), outputs.figures, drawn=drawn)
    for result, section, _ in found:
        stable = sum(e.stable for e in result.evaluations)
        line = f"{stable} of {len(result.evaluations)} designs stable on the truth"
        if failed := len(section["failed"]):
            asked = sum(map(len, section["verdicts"].values()))
            line += f"; the file's own fails {failed} of {asked} requirements"
        OUT.print(f"{result.case.name}: {line}", soft_wrap=True)
    if results:
        OUT.print(f"report: {page}")
        if outputs.figures is not None:
            OUT.print(f"figures: {outputs.figures}")
    return told.status


_Compared = tuple[CaseResult, dict[str, Any], dict[str, str | bytes]]
_Outcomes = dict[int, _Compared | SlewctlError]


def _all_compared(
    designs: Sequence[DesignFile], style: str, told: Told, step: Callable[[str], None]
) -> Iterator[_Compared | None]:
    """Yield each design's result and what is shown of it, from as many cores as there are."""
    workers = min(len(designs), usable_cores())
    if workers < 2:
        for place, design in enumerate(designs):
            yield told.trying(_compared, place, design, style, step)
        return
    with Processes(workers) as pool:
        futures: dict[int, Future[_Outcomes]] = {}
        for block in _alike(designs, -(-len(designs) // (2 * workers))):
            work = {place: designs[place] for place in block}
            futures |= dict.fromkeys(block, pool.submit(_compared_in_turn, work, style))
        try:
            for place, design in enumerate(designs):
                yield told.trying(_told, futures[place].result()[place])
                for origin in design.case.candidates:
                    step(f"{design.case.name}: {origin}")
        except BrokenProcessPool as error:
            raise SlewctlError(
                "a process that compared designs was ended from outside",
                remedy="compare fewer designs at once, if memory ran out",
            ) from error


def _alike(designs: Sequence[DesignFile], most: int) -> list[list[int]]:
    """Return the places of designs in blocks of at most so many, those of one arm together.

    What the truth of an arm yields is computed once in each process.
    """
    arms = list(dict.fromkeys(design.case.arm for design in designs))
    order = sorted(range(len(designs)), key=lambda k: arms.index(designs[k].case.arm))
    return [order[k : k + most] for k in range(0, len(order), most)]


def _compared_in_turn(designs: Mapping[int, DesignFile], style: str) -> _Outcomes:
    """Return what `_compared` returns of each, or the error that it raises."""
    outcomes: _Outcomes = {}
    for place, design in designs.items():
        try:
            outcomes[place] = _compared(place, design, style)
        except SlewctlError as error:
            outcomes[place] = error
    return outcomes


def _told(outcome: _Compared | SlewctlError) -> _Compared:
    if isinstance(outcome, SlewctlError):
        raise outcome
    return outcome


def _compared(
    place: int, design: DesignFile, style: str, step: Callable[[str], None] | None = None
) -> _Compared:
    """Return a design's result, its part of the page, and its figures in a style, if any."""
    from slewctl.report.comparison import section

    with design.source.computing():
        (result,) = compare([design.case], step).cases
        found = verdicts(design, result.chosen.judgement)
        result = replace(
            result,
            slewed="slew" in design.source.content,
            measured=_on_measured(design, result.chosen.controller),
        )
    files: dict[str, str | bytes] = {}
    if style:
        from slewctl.report.printed import design_files  # loads matplotlib

        files = design_files(place, result, style)
    return result, section(place, result, map(told_finding, found)), files


def _on_measured(design: DesignFile, controller: Controller) -> OnMeasured | None:
    """Return what the controller meets on the measured response of a design, if it has one."""
    plant = design.measured
    if plant is None:
        return None
    # They load what only measured designs need.
    from slewctl.loop.on_measured import on_measured
    from slewctl.measured.rig_parameters import Rig
    from slewctl.plant.dead_time import loop_dead_time

    rig = Rig(design.case.arm, delay=loop_dead_time(design.case.arm, [plant.response.sensor]))
    try:
        return on_measured(
            plant.response,
            controller,
            rig,
            unstable_poles=plant.unstable_poles,
            poles_at_zero=plant.poles_at_zero,
        )
    except SlewctlError as error:
        raise error.at("measured.file") from error


def print_ladder(design: Path, basis: str | None, n: int | None) -> None:
    """Print how a design fares on more and more modes of the truth."""
    file = read_design(design)
    with options_named({"model.basis": "--basis", "model.n": "-n", "truth.modes": "-n"}):
        case = redesigned(file.case, basis, n)
    with file.source.computing():
        ladder = spillover_ladder(case)
    headings = {name: _HEADINGS[name] for name in TOLD}
    if not case.objective.weighted:
        del headings["h2_loss"]
    table = number_table("modes N", "up to (Hz)", *headings.values())
    for rung in ladder.rungs:
        table.add_row(str(rung.modes), f"{rung.frequency_hz:.5g}", *_rung_cells(rung, headings))
    OUT.print(str(ladder))
    show(table)
    if ladder.unknown:
        OUT.print(f"Not known: {ladder.unknown}")


def _rung_cells(rung: Rung, names: Collection[str]) -> Iterable[str]:
    """Return margins and loss of a rung, or the frequency that grows."""
    if not rung.stable:
        hertz = rung.judgement.unstable_hz[0]
        what = "not proved, pole" if rung.judgement.loop.undecided else "unstable"
        return (f"{what} at {hertz:.4g} Hz", *[""] * (len(names) - 1))
    values = {name: rung.value(name) for name in names}
    return ("-" if value is None else _rounded(name, value) for name, value in values.items())


def _rounded(name: str, value: float) -> str:
    """Return a value in its column's unit; less than can be told from nothing is nothing."""
    known = 0.0 if abs(value) <= QUANTITIES[name].resolution else value
    return f"{100 * known if name == 'h2_loss' else known:.4g}"
