"""Design files judged one by one, each with its variations."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slewctl import compare, gate
from slewctl._types import FilePath
from slewctl.check import NOMINAL, DesignResult, Finding, Verdict, judge, measure
from slewctl.check.measured import MEASURED
from slewctl.compare import (
    QUANTITIES,
    Judge,
    Judgement,
    Reading,
    on_other_arm,
    unit_notes,
)
from slewctl.errors import SlewctlError, check_path, check_paths, told_faults
from slewctl.files import DesignFile, find_designs, name_designs, read_design
from slewctl.files.uncertainty import WORST
from slewctl.gate.fingerprint import digest, fingerprint

if TYPE_CHECKING:
    from slewctl.check.baseline import Baseline


def check_designs(
    paths: FilePath | Iterable[FilePath],
    progress: Callable[[str], None] | None = None,
    baseline: Baseline | None = None,
    *,
    changed_only: bool = False,
    working: Callable[[str], None] | None = None,
    compiled: bool = False,
    marked: bool = True,
) -> tuple[DesignResult, ...]:
    """Return the result of every design in files and folders.

    Parameters
    ----------
    paths : path, or iterable of them
        TOML files, and folders of them.
    progress : callable, optional
        Called with a file's path before it is judged.
    baseline : Baseline, optional
        What it holds of a design is measured too, required or not.
    changed_only : bool
        Whether designs that the baseline accepted, and that have not changed since, are left
        as they are.
    working : callable, optional
        Called with a short text while a design is judged on many arms.
    compiled : bool
        Whether the code is judged that runs the controller, by what was read out of it.
    marked : bool
        Whether results carry a fingerprint, which a baseline takes.

    Returns
    -------
    tuple of DesignResult

    Raises
    ------
    InputError
        If a path does not exist or a folder holds no design.  A design that is broken is no
        error here: its result says why.

    Examples
    --------
    >>> from slewctl.files import example_design
    >>> path = example_design()
    >>> from slewctl.gate import check_designs
    >>> [result.status for result in check_designs([path])]
    ['passed']
    """
    paths = check_paths(paths, "paths")
    results = []
    for path, name in name_designs(find_designs(paths)).items():
        if progress is not None:
            progress(str(path))
        results.append(
            check_file(
                path,
                name,
                baseline,
                changed_only=changed_only,
                working=working,
                compiled=compiled,
                marked=marked,
            )
        )
    return tuple(results)


def check_file(
    path: FilePath,
    name: str = "",
    baseline: Baseline | None = None,
    *,
    changed_only: bool = False,
    working: Callable[[str], None] | None = None,
    compiled: bool = False,
    marked: bool = True,
) -> DesignResult:
    """Return the result of one design file; a broken one says why.

    Parameters
    ----------
    path : str or PathLike
    name : str
        By default the file's stem.
    baseline, changed_only, working, compiled, marked
        As for `check_designs`.

    Returns
    -------
    DesignResult

    Examples
    --------
    >>> from slewctl.files import example_design
    >>> path = example_design()
    >>> from slewctl.gate import check_file
    >>> check_file(path).status
    'passed'
    """
    path = check_path(path, "path")
    name = name or path.stem
    try:
        design = read_design(path, name)
    except SlewctlError as error:
        return DesignResult(name, path, **_refused(error, path))
    if baseline is None:
        return examine(design, working=working, compiled=compiled, marked=marked)
    skipped = skip_unchanged(design, baseline) if changed_only else None
    if skipped is not None:
        return skipped
    accepted = baseline.accepted(path, digest(design.text))
    known = accepted.arms if accepted else {}
    return examine(design, known, working=working, compiled=compiled, marked=marked)


def skip_unchanged(design: DesignFile, baseline: Baseline) -> DesignResult | None:
    """Return the result of a design that was accepted as it is, None if it must be judged.

    Parameters
    ----------
    design : DesignFile
    baseline : Baseline

    Returns
    -------
    DesignResult or None

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.files import example_design
    >>> path = example_design()
    >>> from slewctl.check import Baseline
    >>> from slewctl.files import read_design
    >>> from slewctl.gate import skip_unchanged
    >>> skip_unchanged(read_design(path), Baseline(Path("accepted.json"), {})) is None
    True
    """
    text = design.text
    accepted = baseline.accepted(design.path, digest(text))
    mark = fingerprint(text)
    if accepted is None or accepted.fingerprint != mark:
        return None
    return DesignResult(
        design.case.name, design.path, fingerprint=mark, digest=digest(text), unchanged=True
    )


def examine(
    design: DesignFile,
    known: Mapping[str, Mapping[str, float]] | None = None,
    *,
    working: Callable[[str], None] | None = None,
    compiled: bool = False,
    marked: bool = True,
) -> DesignResult:
    """Return the verdicts on a design: its arm, each variation, the worst of its box, and a rig.

    The controller is designed once, for the arm as the file describes it.

    Parameters
    ----------
    design : DesignFile
    known : mapping of str to mapping, optional
        By arm, quantities that are measured though nothing requires them.
    working, compiled, marked
        As for `check_designs`.

    Returns
    -------
    DesignResult

    Examples
    --------
    >>> from slewctl.files import example_design, read_design
    >>> path = example_design()
    >>> from slewctl.gate import examine
    >>> [finding.verdict.requirement for finding in examine(read_design(path)).findings]
    ['stable', 'gain_margin_db']
    """
    start = time.perf_counter()
    judging = Judge(design.case)
    findings: list[Finding] = []
    recorded: dict[str, Mapping[str, Reading]] = {}
    refused: dict[str, Any] = {}
    notes: list[str] = []
    try:
        with design.source.computing():
            notes += unit_notes(design.case.arm)
            if compiled:
                notes += gate.judge_of_compiled(judging, design.export, design.case.name)
            for arm, judgement, limits in _judgements(design, judging, notes, working):
                findings += _placed(design, arm, judge(judgement, limits))
                beside = [QUANTITIES[name].requirement for name in (known or {}).get(arm, {})]
                recorded[arm] = measure(judgement, [*limits, *beside])
            if design.measured is not None:
                controller = judging.own[1]
                met, recorded[MEASURED], told = gate.judge_on_measured(design.measured, controller)
                findings += _placed(design, MEASURED, met)
                notes += told
    except SlewctlError as error:
        refused = _refused(error, design.path)
    return DesignResult(
        design.case.name,
        design.path,
        tuple(findings),
        recorded,
        tuple(notes),
        fingerprint=fingerprint(design.text) if marked else "",
        digest=digest(design.text),
        **refused,
        seconds=time.perf_counter() - start,
    )


def verdicts(design: DesignFile, judged: Judgement) -> tuple[Finding, ...]:
    """Return the verdicts on a design that was judged already: its arm, variations and rig.

    Parameters
    ----------
    design : DesignFile
    judged : Judgement
        Of the file's own design on its own arm.

    Returns
    -------
    tuple of Finding

    Examples
    --------
    >>> from slewctl.compare import evaluate
    >>> from slewctl.files import example_design, read_design
    >>> design = read_design(example_design())
    >>> from slewctl.gate import verdicts
    >>> found = verdicts(design, evaluate(design.case).judgement)
    >>> all(finding.verdict.passed for finding in found)
    True
    """
    found = [
        finding
        for arm, judgement, limits in _on_named_arms(design, judged)
        for finding in _placed(design, arm, judge(judgement, limits))
    ]
    if design.measured is not None:
        met, _, _ = gate.judge_on_measured(design.measured, judged.controller)
        found += _placed(design, MEASURED, met)
    return tuple(found)


def _placed(design: DesignFile, arm: str, met: Iterable[Verdict]) -> list[Finding]:
    """Return verdicts with the lines that ask for them."""
    return [Finding(verdict, arm, _line(design, arm, verdict.requirement)) for verdict in met]


def _on_named_arms(
    design: DesignFile, judged: Judgement
) -> Iterator[tuple[str, Judgement, Mapping[str, float | bool]]]:
    """Yield a design on its own arm, as it was judged, and on each variation."""
    yield NOMINAL, judged, design.requirements
    for other in design.variations:
        varied = on_other_arm(design.case, other.arm, judged.controller, judged.slew)
        yield other.name, varied, other.requirements


def _judgements(
    design: DesignFile,
    judging: Judge,
    notes: list[str],
    working: Callable[[str], None] | None,
) -> Iterator[tuple[str, Judgement, Mapping[str, float | bool]]]:
    """Yield each arm's name, what the controller achieves on it, and what is required there."""
    yield from _on_named_arms(design, judging.evaluate(*judging.chosen).judgement)
    if design.uncertainty is not None:
        asked = design.uncertainty
        found = compare.worst_case(judging, asked.box, **asked.asked, progress=working)
        notes.append(str(found))
        yield WORST, judging.vary(found.arm), design.requirements


def _line(design: DesignFile, arm: str, requirement: str) -> int | None:
    """Return the line that asks for a requirement on an arm.

    A variation without requirements of its own has the common ones; what nobody wrote, such
    as stability, stands at the head of the table.
    """
    lines = design.source.lines
    for name, place in ((WORST, "uncertainty"), (MEASURED, "measured")):
        if arm == name:
            own = lines.get((place, "requirements", requirement))
            return own or lines.get(("requirements", requirement)) or lines.get((place,))
    table: tuple[str, ...] = ("requirements",)
    head = table
    if arm != NOMINAL:
        head = ("variations", arm)
        if (*head, "requirements") in lines:
            table = head = (*head, "requirements")
    return lines.get((*table, requirement)) or lines.get(head)


def _refused(error: SlewctlError, path: Path) -> dict[str, Any]:
    """Return what a result says of a design that could not be judged."""
    told = tuple((str(fault), _line_of(fault, path)) for fault in told_faults(error))
    return {"error": str(error), "error_line": _line_of(error, path), "faults": told}


def _line_of(error: SlewctlError, path: Path) -> int | None:
    """Return the line in an error's place, which reads FILE:LINE: KEY."""
    number = error.where.removeprefix(f"{path}:").partition(":")[0]
    return int(number) if number.isdecimal() else None
