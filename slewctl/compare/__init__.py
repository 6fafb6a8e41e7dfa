"""Designs on several bases and orders, judged on the converged truth of their arm."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.compare.case import Case
    from slewctl.compare.clock_loss import SamplingLoss, sampling_loss
    from slewctl.compare.comparison import (
        CaseResult,
        Comparison,
        LoopCurves,
        ModeShapes,
        Refusal,
        compare,
        count_designs,
    )
    from slewctl.compare.convergence import Followed, Seen, at_once, follow
    from slewctl.compare.design_basis import REDUCTIONS, SOURCES, DesignModel, design_model
    from slewctl.compare.doubtful_units import unit_notes
    from slewctl.compare.evaluation import Evaluation, Judge, evaluate, on_other_arm
    from slewctl.compare.judgement import Judgement, Yardstick
    from slewctl.compare.ladder import Ladder, Rung, first_modes, spillover_ladder
    from slewctl.compare.loss_of_digits import (
        DigitalLoss,
        digital_loss,
        least_word,
        loop_signals,
    )
    from slewctl.compare.quantities import QUANTITIES, Quantity, Reading, quantities_of
    from slewctl.compare.reading import describe, read
    from slewctl.compare.reductions import ReductionRow, Reductions, compare_reductions
    from slewctl.compare.single_design import glance
    from slewctl.compare.study.answer import (
        MEDIANS,
        PAPERS,
        Answer,
        Duel,
        GapScore,
        Lost,
        Share,
    )
    from slewctl.compare.study.count import count_points
    from slewctl.compare.study.dask_cluster import dask_cluster
    from slewctl.compare.study.designs import GOOD
    from slewctl.compare.study.grid import Grid, Point, Setting, Study
    from slewctl.compare.study.point import COLUMNS, Work, evaluate_point
    from slewctl.compare.study.recommend import Recommendation, Trial, count_trials, recommend
    from slewctl.compare.study.result import StudyResult
    from slewctl.compare.study.results_file import rows
    from slewctl.compare.study.run import run_study
    from slewctl.compare.study.slices import StudySlice
    from slewctl.compare.study.sweep import Piece, WorkerDiedError, sweep
    from slewctl.compare.truth_summary import TruthSummary
    from slewctl.compare.worst_arm import VariedArm, WorstCase, worst_case
    from slewctl.compare.worst_arm import most_arms as most_arms
    from slewctl.loop.robust.destabilised_mode import DestabilisedMode, destabilised_mode

__all__ = [
    "COLUMNS",
    "GOOD",
    "MEDIANS",
    "PAPERS",
    "QUANTITIES",
    "REDUCTIONS",
    "SOURCES",
    "Answer",
    "Case",
    "CaseResult",
    "Comparison",
    "DesignModel",
    "DestabilisedMode",
    "DigitalLoss",
    "Duel",
    "Evaluation",
    "Followed",
    "GapScore",
    "Grid",
    "Judge",
    "Judgement",
    "Ladder",
    "LoopCurves",
    "Lost",
    "ModeShapes",
    "Piece",
    "Point",
    "Quantity",
    "Reading",
    "Recommendation",
    "ReductionRow",
    "Reductions",
    "Refusal",
    "Rung",
    "SamplingLoss",
    "Seen",
    "Setting",
    "Share",
    "Study",
    "StudyResult",
    "StudySlice",
    "Trial",
    "TruthSummary",
    "VariedArm",
    "Work",
    "WorkerDiedError",
    "WorstCase",
    "Yardstick",
    "at_once",
    "compare",
    "compare_reductions",
    "count_designs",
    "count_points",
    "count_trials",
    "dask_cluster",
    "describe",
    "design_model",
    "destabilised_mode",
    "digital_loss",
    "evaluate",
    "evaluate_point",
    "first_modes",
    "follow",
    "glance",
    "least_word",
    "loop_signals",
    "on_other_arm",
    "quantities_of",
    "read",
    "recommend",
    "rows",
    "run_study",
    "sampling_loss",
    "spillover_ladder",
    "sweep",
    "unit_notes",
    "worst_case",
]

__getattr__, __dir__ = attach(__name__, __file__)
