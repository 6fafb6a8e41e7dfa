"""Requirements on designs, the verdict on each, and every form in which they are told."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.check.baseline import Baseline, accept, read_baseline
    from slewctl.check.baseline import to_record as baseline_record
    from slewctl.check.github import to_annotations
    from slewctl.check.junit import to_junit
    from slewctl.check.record import to_record
    from slewctl.check.regression import compare_with, missing
    from slewctl.check.requirements import (
        REQUIREMENTS,
        Verdict,
        check_limits,
        judge,
        judge_at_once,
        measure,
    )
    from slewctl.check.result import NOMINAL, DesignResult, Finding, exit_status

__all__ = [
    "NOMINAL",
    "REQUIREMENTS",
    "Baseline",
    "DesignResult",
    "Finding",
    "Verdict",
    "accept",
    "baseline_record",
    "check_limits",
    "compare_with",
    "exit_status",
    "judge",
    "judge_at_once",
    "measure",
    "missing",
    "read_baseline",
    "to_annotations",
    "to_junit",
    "to_record",
]

__getattr__, __dir__ = attach(__name__, __file__)
