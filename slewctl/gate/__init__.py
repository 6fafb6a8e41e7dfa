"""The gate: design files in, findings out; a broken file hides nothing of the others."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.gate.changes import Change, small_changes
    from slewctl.gate.compiled_design import judge_of_compiled as judge_of_compiled
    from slewctl.gate.explanation import Explanation, Trial, explain
    from slewctl.gate.measured_plant import judge_on_measured as judge_on_measured
    from slewctl.gate.run import check_designs, check_file, examine, skip_unchanged, verdicts

__all__ = [
    "Change",
    "Explanation",
    "Trial",
    "check_designs",
    "check_file",
    "examine",
    "explain",
    "skip_unchanged",
    "small_changes",
    "verdicts",
]

__getattr__, __dir__ = attach(__name__, __file__)
