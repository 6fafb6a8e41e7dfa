"""Verdicts in words, alike in every output."""

from __future__ import annotations

import math

from slewctl.check.requirements import Verdict
from slewctl.check.result import NOMINAL, Finding

GONE = "in the baseline, not found: accept its end with --update-baseline"


def number_text(number: float | None, unit: str) -> str:
    """Return a number with four digits and its unit; infinite ones by name."""
    if number is None or math.isnan(number):
        return "none"
    if math.isinf(number):
        return "infinite" if number > 0 else "-infinite"
    return f"{number:.4g} {unit}".rstrip()


def value_text(verdict: Verdict) -> str:
    """Return a verdict's value, such as ``9.53 dB``."""
    if verdict.requirement == "stable":
        # A loop that is stable where it was looked at may still fail on a finer truth.
        return "yes" if verdict.passed else "no"
    return number_text(verdict.value, verdict.quantity.unit)


def limit_text(verdict: Verdict) -> str:
    """Return a verdict's limit, such as ``>= 6 dB``."""
    if verdict.requirement == "stable":
        return "yes"
    sign = ">=" if verdict.quantity.better == "greater" else "<="
    if not math.isfinite(verdict.limit):
        return f"{sign} infinite"
    digits = f"{verdict.limit:g}"
    return f"{sign} {digits} {verdict.quantity.unit}".rstrip()


def place_text(verdict: Verdict) -> str:
    """Return the frequency that sets the value and its mode, such as ``3.801 Hz, mode 1``.

    Empty where there is none, or where the note tells it.
    """
    if verdict.frequency_hz is None:
        return ""
    hertz = f"{verdict.frequency_hz:.4g} Hz"
    if f"at {hertz}" in verdict.note:
        return ""
    # The mode's own frequency, in brackets, is one number too many here.
    mode = verdict.mode.partition(" (")[0]
    return f"{hertz}{f', {mode}' if mode else ''}"


def proof_text(verdict: Verdict) -> str:
    """Return what is proved of a margin; empty for what is no margin, or has no value."""
    if verdict.quantity.kind != "margin" or verdict.value is None:
        return ""
    if verdict.at_least is None:
        return "confirmed by the poles of closed loops alone, not on intervals of the axis"
    least = f"{verdict.at_least:.6g} {verdict.quantity.unit}".rstrip()
    return f"proved on {verdict.intervals} intervals of the axis to be at least {least}"


def title(finding: Finding) -> str:
    """Return what was asked: the requirement, the arm unless nominal, the baseline if it asks."""
    arm = "" if finding.arm == NOMINAL else f" [{finding.arm}]"
    source = " (baseline)" if finding.against == "baseline" else ""
    return f"{finding.verdict.requirement}{arm}{source}"


def sentence(finding: Finding) -> str:
    """Return a finding as one sentence with value, limit, frequency and note."""
    verdict = finding.verdict
    if verdict.requirement == "stable":
        body = "stable" if verdict.passed else "not stable"
    else:
        at = place_text(verdict)
        value, limit = value_text(verdict), limit_text(verdict)
        body = f"{value}{f' at {at}' if at else ''}, required {limit}"
    note = f" ({verdict.note})" if verdict.note else ""
    return f"{title(finding)}: {body}{note}"


def told_finding(finding: Finding) -> dict[str, object]:
    """Return a finding in words, as a page shows it."""
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
