"""Results beside the last accepted run: which quantities got worse, and by how much."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from slewctl.check.baseline import Accepted, Baseline
from slewctl.check.requirements import COST_TOLERANCE, REQUIREMENTS, Reading, Verdict
from slewctl.check.result import NOMINAL, DesignResult, Finding
from slewctl.check.words import number_text

# Baselines keep ten digits: a smaller change is the file's rounding.
_ROUNDING = 1e-9
# A loss is the difference of two costs, each known to this: what is below is noise.
_LEAST_CHANGE = {"h2_loss_max": COST_TOLERANCE}


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
        A design, variation or quantity that the baseline does not know, or that it alone
        knows, is told in the notes and does not fail: its requirements are judged anyway.
    """
    if result.status in ("broken", "unchanged"):
        return result
    before = baseline.accepted(result.file)
    if before is None:
        note = "not in the baseline: judged by its requirements alone until it is accepted"
        return replace(result, notes=(*result.notes, note))
    findings = [
        _finding(result, arm, name, values[name], reading, tolerance)
        for arm, values in before.arms.items()
        for name, reading in result.recorded.get(arm, {}).items()
        if name in values and not math.isnan(values[name])
    ]
    return replace(
        result,
        findings=(*result.findings, *findings),
        notes=(*result.notes, *_strangers(before, result)),
    )


def _finding(
    result: DesignResult, arm: str, name: str, old: float, new: Reading, tolerance: float
) -> Finding:
    rule = REQUIREMENTS[name]
    value = new.value
    limit = _limit(name, old, tolerance)
    passed = value >= limit if rule.sense == "at least" else value <= limit
    verdict = Verdict(
        name,
        None if math.isnan(value) else value,
        limit,
        rule.unit,
        rule.sense,
        new.frequency_hz,
        passed,
        f"accepted: {number_text(old, rule.unit)}",
        new.mode,
    )
    return Finding(verdict, arm, _line(result, arm, name), "baseline")


def _limit(name: str, old: float, tolerance: float) -> float:
    """Return the worst value that is not yet worse than the accepted one."""
    if math.isinf(old):
        return old
    allowed = max(abs(old) * max(tolerance, _ROUNDING), _LEAST_CHANGE.get(name, 0.0))
    return old - allowed if REQUIREMENTS[name].sense == "at least" else old + allowed


def _line(result: DesignResult, arm: str, name: str) -> int | None:
    """Return the line that requires the quantity, else that of the arm's first requirement."""
    lines = {found.verdict.requirement: found.line for found in result.findings if found.arm == arm}
    return lines.get(name) or next(iter(lines.values()), None)


def _strangers(before: Accepted, result: DesignResult) -> list[str]:
    """Return what the baseline and the result do not have in common, in words."""
    notes = []
    for arm in dict.fromkeys([*before.arms, *result.recorded]):
        if arm not in result.recorded:
            notes.append(f"variation {arm} is in the baseline and no longer judged")
        elif arm not in before.arms:
            notes.append(f"variation {arm} is not in the baseline")
        else:
            notes += _strange_quantities(arm, before.arms[arm], result.recorded[arm])
    return notes


def _strange_quantities(
    arm: str, old: Mapping[str, float], new: Mapping[str, Reading]
) -> list[str]:
    if not new:
        return []  # an unstable loop has no quantity, and fails
    place = "" if arm == NOMINAL else f" [{arm}]"
    gone = [
        f"{name}{place} is in the baseline and no longer required"
        for name in old
        if name not in new
    ]
    fresh = [
        f"{name}{place} is not in the baseline"
        for name in new
        if name not in old or math.isnan(old[name])
    ]
    return gone + fresh
