"""Results as a record for other programs: schema ``slewctl-check/2``.

Keys are only ever added within a schema.  Infinite numbers become the strings "inf" and
"-inf" when the record is written; missing ones are null.

    schema, slewctl, status, summary, designs
    design:   name, file, status, error, line, notes, arms
    arm:      arm, requirements, baseline, measured
    verdict:  requirement, passed, value, limit, sense, unit, frequency_hz, mode, line, note, seen,
              at_least, intervals

``status`` of the run is the exit status; that of a design is passed, failed, broken, missing
or unchanged.  ``measured`` holds every required quantity and all margins; ``seen`` the value on
each truth, by its number of modes.  Of a margin ``at_least`` is what is proved of it on so many
``intervals`` of the frequency axis; null and zero where closed-loop poles alone confirm it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from slewctl.check.result import DesignResult, Finding, exit_status

SCHEMA = "slewctl-check/2"
_STATUS = ("passed", "failed", "broken", "missing", "unchanged")


def to_record(results: Sequence[DesignResult], version: str) -> dict[str, Any]:
    """Return results as nested dictionaries, always in the same order.

    Parameters
    ----------
    results : sequence of DesignResult
    version : str
        Version of slewctl.

    Returns
    -------
    dict of str to object

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> from slewctl.check.record import to_record
    >>> to_record([broken], "0.2.0")["schema"]
    'slewctl-check/2'
    """
    status: list[str] = [result.status for result in results]
    findings = [found for result in results for found in result.findings]
    return {
        "schema": SCHEMA,
        "slewctl": version,
        "status": exit_status(results),
        "summary": {
            "designs": len(results),
            **{word: status.count(word) for word in _STATUS},
            "verdicts": len(findings),
            "verdicts_failed": sum(not found.verdict.passed for found in findings),
        },
        "designs": [_design(result) for result in results],
    }


def number(value: float | None) -> float | None:
    """Return a value, or None for one that is missing."""
    return None if value is None or math.isnan(value) else value


def _design(result: DesignResult) -> dict[str, Any]:
    arms = dict.fromkeys([*(found.arm for found in result.findings), *result.recorded])
    return {
        "name": result.name,
        "file": result.file.as_posix(),
        "status": result.status,
        "error": result.error or None,
        "line": result.error_line,
        "faults": [{"error": text, "line": line} for text, line in result.faults],
        "notes": list(result.notes),
        "arms": [_arm(result, arm) for arm in arms],
    }


def _arm(result: DesignResult, arm: str) -> dict[str, Any]:
    here = [found for found in result.findings if found.arm == arm]
    measured = result.recorded.get(arm, {})
    return {
        "arm": arm,
        "requirements": [_finding(found) for found in here if found.against == "requirement"],
        "baseline": [_finding(found) for found in here if found.against == "baseline"],
        "measured": {
            name: {
                "value": number(found.value),
                "frequency_hz": found.frequency_hz,
                "at_least": found.at_least,
                "intervals": found.intervals,
            }
            for name, found in measured.items()
        },
    }


def _finding(finding: Finding) -> dict[str, Any]:
    verdict = finding.verdict
    return {
        "requirement": verdict.requirement,
        "passed": verdict.passed,
        "value": number(verdict.value),
        "limit": verdict.limit,
        "sense": verdict.quantity.sense,
        "unit": verdict.quantity.unit,
        "frequency_hz": verdict.frequency_hz,
        "mode": verdict.mode,
        "line": finding.line,
        "note": verdict.note,
        "seen": [{"modes": modes, "value": value} for modes, value in verdict.seen],
        "at_least": verdict.at_least,
        "intervals": verdict.intervals,
    }
