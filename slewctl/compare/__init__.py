"""Designs on several bases and orders, judged on the converged truth of their arm."""

from slewctl.compare.case import Case
from slewctl.compare.evaluation import Evaluation, FinerVerdict, Judge, Outcome, evaluate
from slewctl.compare.study import (
    CaseResult,
    Comparison,
    LoopCurves,
    ModeShapes,
    TruthSummary,
    compare,
    count_designs,
)

__all__ = [
    "Case",
    "CaseResult",
    "Comparison",
    "Evaluation",
    "FinerVerdict",
    "Judge",
    "LoopCurves",
    "ModeShapes",
    "Outcome",
    "TruthSummary",
    "compare",
    "count_designs",
    "evaluate",
]
