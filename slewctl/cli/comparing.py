"""The commands ``compare`` and ``ladder``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slewctl.check import Finding
from slewctl.check.words import limit_text, place_text, value_text
from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, Told, number_table, progress, show
from slewctl.compare import (
    CaseResult,
    Comparison,
    Rung,
    compare,
    count_designs,
    spillover_ladder,
)
from slewctl.compare.ladder import TOLD, redesigned
from slewctl.compare.study.processes import Processes, usable_cores
from slewctl.errors import InputError, SlewctlError, check_choice
from slewctl.files import (
    DesignFile,
    find_designs,
    name_designs,
    read_design,
)
from slewctl.gate import verdicts

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
        from slewctl.report.printed import STYLES

        if self.style is not None:
            check_choice(self.style, STYLES, "--style")
        if self.style is not None and self.figures is None:
            raise InputError(
                "is a style of figures, and none are asked for",
                where="--style",
                remedy="add --figures DIR",
            )


def compare_designs(paths: Sequence[Path], outputs: Outputs) -> int:
    """Write the comparison report of designs; return the exit status."""
    from slewctl.report import write_comparison, write_figures  # matplotlib is only needed here

    outputs.check()
    names = name_designs(find_designs(paths))
    if not names:
        raise InputError("only studies, no design", remedy="name a design file")
    told = Told()
    designs = [told.trying(read_design, path, name, slew=True) for path, name in names.items()]
    good = [design for design in designs if design is not None]
    with progress(count_designs([design.case for design in good])) as step:
        found = [pair for pair in _all_compared(good, told, step) if pair is not None]
        results = tuple(result for result, _ in found)
        if results:
            step("writing")
            page = write_comparison(
                Comparison(results),
                outputs.out,
                as_parquet=outputs.parquet,
                sections=[drawn for _, drawn in found],
                split=outputs.split,
            )
            if outputs.figures is not None:
                write_figures(Comparison(results), outputs.figures, outputs.style or "paper")
    for result in results:
        stable = sum(e.stable for e in result.evaluations)
        OUT.print(
            f"{result.case.name}: {stable} of {len(result.evaluations)} designs stable on the truth"
        )
    if results:
        OUT.print(f"report: {page}")
        if outputs.figures is not None:
            OUT.print(f"figures: {outputs.figures}")
    return told.status


def _all_compared(
    designs: Sequence[DesignFile], told: Told, step: Callable[[str], None]
) -> Iterator[tuple[CaseResult, dict[str, Any]] | None]:
    """Yield each design's result and what the page shows of it, from as many cores as there are."""
    workers = min(len(designs), usable_cores())
    if workers < 2:
        for place, design in enumerate(designs):
            yield told.trying(_compared, place, design, step)
        return
    with Processes(workers) as pool:
        futures = [pool.submit(_compared, place, design) for place, design in enumerate(designs)]
        try:
            for future, design in zip(futures, designs, strict=True):
                yield told.trying(future.result)
                for origin in design.case.candidates:
                    step(f"{design.case.name}: {origin}")
        except BrokenProcessPool as error:
            raise SlewctlError(
                "a process that compared designs was ended from outside",
                remedy="compare fewer designs at once, if memory ran out",
            ) from error


def _compared(
    place: int, design: DesignFile, step: Callable[[str], None] | None = None
) -> tuple[CaseResult, dict[str, Any]]:
    from slewctl.report.comparison import section

    with design.source.computing():
        (result,) = compare([design.case], step).cases
        found = verdicts(design, result.chosen.judgement)
    return result, section(place, result, map(_told, found))


def _told(finding: Finding) -> dict[str, object]:
    """Return a finding in words, as the page shows it."""
    verdict = finding.verdict
    return {
        "arm": finding.arm,
        "requirement": verdict.requirement,
        "quantity": verdict.quantity.name,
        "passed": verdict.passed,
        "value": value_text(verdict),
        "limit": limit_text(verdict),
        "number": verdict.value,
        "bound": verdict.limit,
        "place": place_text(verdict),
        "note": verdict.note,
    }


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


def _rung_cells(rung: Rung, names: Collection[str]) -> Iterable[str]:
    """Return margins and loss of a rung, or the frequency that grows."""
    if not rung.stable:
        return (f"unstable at {rung.judgement.unstable_hz[0]:.4g} Hz", *[""] * (len(names) - 1))
    values = {name: rung.value(name) for name in names}
    return (
        "-" if value is None else f"{100 * value if name == 'h2_loss' else value:.4g}"
        for name, value in values.items()
    )
