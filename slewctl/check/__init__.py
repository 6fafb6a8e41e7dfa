"""Requirements on designs and the verdict on each."""

from slewctl.check.requirements import REQUIREMENTS, Requirement, Verdict, check_limits, judge

__all__ = ["REQUIREMENTS", "Requirement", "Verdict", "check_limits", "judge"]
