"""Results beside the last accepted run: which quantities got worse, and what is gone."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from slewctl.check.baseline import Accepted, Baseline
from slewctl.check.requirements import Verdict
from slewctl.check.result import NOMINAL, DesignResult, Finding
from slewctl.check.words import number_text
from slewctl.compare import QUANTITIES, Reading

# Baselines keep ten digits: a smaller change is the file's rounding.
_ROUNDING = 1e-9


def compare_with(baseline: Baseline, result: DesignResult, tolerance: float) -> DesignResult:
    """Return a result with a finding for each quantity that the baseline knows as well.

    Parameters
    ----------
    baseline : Baseline
    result : DesignResult
    tolerance : float
        How much worse a quantity may be, relative to its accepted value.

    Returns
    -------
    DesignResult
        A variation that the baseline knows and the file does not fails.  A design, variation
        or quantity that the baseline does not know is told in the notes and does not fail:
        its requirements are judged anyway.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult, Baseline, compare_with
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> compare_with(Baseline(Path("accepted.json"), {}), broken, tolerance=0.01).error
    'no such basis'
    """
    if result.status in ("broken", "missing", "unchanged"):
        return result
    before = baseline.accepted(result.file, result.digest)
    if before is None:
        note = "not in the baseline: judged by its requirements alone until it is accepted"
        return replace(result, notes=(*result.notes, note))
    findings = [
        _finding(result, arm, name, values[name], reading, tolerance)
        for arm, values in before.arms.items()
        for name, reading in result.recorded.get(arm, {}).items()
        if name in values and not math.isnan(values[name])
    ]
    gone = [_gone(arm) for arm in before.arms if arm not in result.recorded]
    return replace(
        result,
        findings=(*result.findings, *findings, *gone),
        notes=(*result.notes, *_strangers(before, result)),
    )


def missing(baseline: Baseline, results: Sequence[DesignResult]) -> tuple[DesignResult, ...]:
    """Return a result for each design of the baseline whose file is gone and not renamed.

    Parameters
    ----------
    baseline : Baseline
    results : sequence of DesignResult
        Of the designs that are there.

    Returns
    -------
    tuple of DesignResult

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import Baseline, missing
    >>> missing(Baseline(Path("accepted.json"), {}), [])
    ()
    """
    # One that was accepted under its own name is no other one renamed.
    new = Counter(r.digest for r in results if baseline.key(r.file) not in baseline.designs)
    found = []
    for name in baseline.lost(results):
        digest = baseline.designs[name].digest
        if new[digest]:
            new[digest] -= 1
        else:
            found.append(DesignResult(name, baseline.path.parent / name, missing=True))
    return tuple(found)


def _finding(
    result: DesignResult, arm: str, name: str, old: float, new: Reading, tolerance: float
) -> Finding:
    quantity = QUANTITIES[name]
    limit = _limit(name, old, tolerance)
    note = f"accepted: {number_text(old, quantity.unit)}"
    if new.doubt:
        note += f"; {new.doubt}"
    verdict = Verdict(
        quantity.requirement,
        None if math.isnan(new.value) else new.value,
        limit,
        new.frequency_hz,
        quantity.holds(new.value, limit),
        note,
        new.mode,
    )
    return Finding(verdict, arm, _line(result, arm, quantity.requirement), "baseline")


def _gone(arm: str) -> Finding:
    note = "this variation is in the baseline, and not in the file"
    return Finding(Verdict("stable", None, 1.0, None, False, note), arm, None, "baseline")


def _limit(name: str, old: float, tolerance: float) -> float:
    """Return the worst value that is not yet worse than the accepted one."""
    if math.isinf(old):
        return old
    quantity = QUANTITIES[name]
    allowed = max(abs(old) * max(tolerance, _ROUNDING), quantity.resolution)
    return old - allowed if quantity.better == "greater" else old + allowed


def _line(result: DesignResult, arm: str, requirement: str) -> int | None:
    """Return the line that requires the quantity, else that of the arm's first requirement."""
    lines = {found.verdict.requirement: found.line for found in result.findings if found.arm == arm}
    return lines.get(requirement) or next(iter(lines.values()), None)


def _strangers(before: Accepted, result: DesignResult) -> list[str]:
    """Return what the result has and the baseline has not, in words."""
    notes = []
    for arm, readings in result.recorded.items():
        if arm not in before.arms:
            notes.append(f"variation {arm} is not in the baseline")
        else:
            notes += _strange_quantities(arm, before.arms[arm], readings)
    return notes


def _strange_quantities(
    arm: str, old: Mapping[str, float], new: Mapping[str, Reading]
) -> list[str]:
    place = "" if arm == NOMINAL else f" [{arm}]"
    return [
        f"{name}{place} is not in the baseline"
        for name in new
        if name not in old or math.isnan(old[name])
    ]
