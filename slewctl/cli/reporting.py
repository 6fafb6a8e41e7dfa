"""The command ``report``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from slewctl.arm import Arm
from slewctl.check.words import told_finding
from slewctl.cli.identifying import fitted_arm, free_names, read_named_log
from slewctl.cli.terminal import OUT, progress
from slewctl.compare import Judgement, compare
from slewctl.embedded import compile_program, program_files, provenance, read_back
from slewctl.errors import InputError, SlewctlError
from slewctl.files import DesignFile, find_arm, read_design
from slewctl.gate import verdicts
from slewctl.gate.compiled_design import design_program
from slewctl.gate.fingerprint import digest
from slewctl.loop import Simulation, simulate
from slewctl.measured.rig_fit_result import RigFit
from slewctl.versions import installed


@dataclass(frozen=True)
class Logged:
    """A log of the rig, and what of the data sheet's arm is fitted to it."""

    log: Path | None = None
    free: str = ""
    columns: Sequence[str] = ()
    sample_time: float | None = None
    counts: float | None = None

    def fitted(self, sheet: Arm | None, sheet_name: str) -> RigFit | None:
        """Return the fit; None without a log."""
        if self.log is None:
            for given, name in (
                (self.free, "--free"), (self.columns, "--column"), (self.counts, "--counts"),
                (self.sample_time, "--sample-time"),
            ):  # fmt: skip
                if given not in ("", (), None):
                    raise InputError(
                        "there is no log to be read", where=name, remedy="give --log FILE"
                    )
            return None
        names = free_names(self.free)
        if sheet is None or not names:
            raise InputError(
                "a log is what the data sheet's arm is fitted to",
                where="--log",
                remedy="give --sheet ARM and --free NAMES too",
            )
        log = read_named_log(self.log, self.columns, self.sample_time, self.counts)
        return fitted_arm(sheet, sheet_name, log, names)


def report_design(design: Path, sheet_name: str | None, logged: Logged, out: Path) -> int:
    """Write a design's way from data sheet to code; return 1 where a requirement fails."""
    from slewctl.report.whole_way import WholeWay, other_gain, write_whole_way

    file = read_design(design)
    sheet = find_arm(sheet_name) if sheet_name else None
    with progress(5) as step:
        step("fitting")
        fit = logged.fitted(sheet, sheet_name or "")
        step("judging")
        with file.source.computing():
            case = file.case
            if not case.is_given:
                case = replace(case, bases=(case.basis,), orders=(case.n,))
            (result,) = compare([case]).cases
            result = replace(result, slewed="slew" in file.source.content)
            judged = result.chosen.judgement
            found = list(verdicts(file, judged))
            step("slewing")
            slew = _slew(file, judged)
            step("writing code")
            code, notes = _code(file, judged)
        step("writing")
        page = write_whole_way(
            WholeWay(result, [told_finding(each) for each in found], slew, sheet, fit, code, notes),
            out,
        )
    failed = sum(not each.verdict.passed for each in found)
    if fit:
        OUT.print(f"through the fitted arm the input makes {fit.explained:.1%} of the log's output")
        if (gain := other_gain(fit)) is not None:
            OUT.print(f"the rig has {gain:.4g} times the gain of the arm: no verdict counts it")
    OUT.print(f"{failed} of {len(found)} requirements fail" if failed else
              f"all {len(found)} requirements hold")  # fmt: skip
    for note in notes:
        OUT.print(f"code: {note}", soft_wrap=True)
    OUT.print(f"report: {page}")
    return int(bool(failed))


def _slew(file: DesignFile, judged: Judgement) -> Simulation | None:
    if "slew" not in file.source.content or not judged.stable:
        return None
    return simulate(judged.loop, judged.slew)


def _code(file: DesignFile, judged: Judgement) -> tuple[dict[str, str] | None, list[str]]:
    """Return the files of the code with what is said of it, or why there is none."""
    if not judged.stable:
        return None, ["The loop is unstable: no code is written of it."]
    if not judged.controller.sample_time:
        return None, ["The design is continuous: give it a sample_time, and there is code of it."]
    notes = provenance(judged, file.case.name, digest(file.text), installed())
    program = design_program(judged, file.export, file.case.name, notes)
    told = [*notes[1:], *program.notes[len(notes) :]]
    if program.words:
        told.append(
            "The verdicts are of the law before it is rounded to these words; "
            "slewctl check --compiled judges the code."
        )
    try:
        read_back(program, compile_program(program))
        told.append("Compiled here: its A, B, C and D, read by stepping it, are the design's.")
    except InputError as error:  # no compiler
        told.append(f"It was not compiled here: {error.what}.")
    except SlewctlError as error:
        told.append(f"The compiled code is not the design: {error.what}.")
    return program_files(program), told
