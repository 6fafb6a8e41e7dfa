"""Reports: HTML with vector figures, Markdown, JSON, CSV, Parquet.  It formats, never computes."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.report.comparison import write_comparison
    from slewctl.report.export import check_parquet
    from slewctl.report.identification import write_identification
    from slewctl.report.measured_panel import margin_rows as margin_rows
    from slewctl.report.measured_panel import measured_figures as measured_figures
    from slewctl.report.paper import write_paper
    from slewctl.report.printed import write_figures
    from slewctl.report.replay import write_replay
    from slewctl.report.shaping import write_shaping
    from slewctl.report.simulation import write_simulation
    from slewctl.report.study import write_study

__all__ = [
    "check_parquet",
    "write_comparison",
    "write_figures",
    "write_identification",
    "write_paper",
    "write_replay",
    "write_shaping",
    "write_simulation",
    "write_study",
]

__getattr__, __dir__ = attach(__name__, __file__)
