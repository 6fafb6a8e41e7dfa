"""Reports: HTML with vector figures, JSON and CSV.  It formats and never computes."""

from slewctl.report.comparison import write_comparison
from slewctl.report.paper import write_paper
from slewctl.report.study import write_study

__all__ = ["write_comparison", "write_paper", "write_study"]
