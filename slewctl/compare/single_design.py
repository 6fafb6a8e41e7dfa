"""A design alone, seen at once: its loop and its slew on its own truth, nothing followed yet."""

from __future__ import annotations

from dataclasses import replace

from slewctl._threads import single_threaded
from slewctl.compare.case import Case
from slewctl.compare.comparison import (
    CaseResult,
    TruthSummary,
    hub_ratio,
    loop_curves,
    mode_shapes,
)
from slewctl.compare.evaluation import Judge
from slewctl.compare.ladder import climb, steps


@single_threaded
def glance(case: Case, beside: CaseResult | None = None, *, whole: bool = False) -> CaseResult:
    """Return a case's own design on its truth, without what takes long.

    Parameters
    ----------
    case : Case
    beside : CaseResult, optional
        Another glance, such as at the same design before a change, whose curves are shown too.
    whole : bool
        Whether the ladder is climbed, too.

    Returns
    -------
    CaseResult
        With the design's curves and shapes; nothing is followed over finer truths, and of the
        truth neither the optimum nor its drift is told.

    Raises
    ------
    SlewctlError
        If there is no controller.

    Examples
    --------
    >>> from slewctl.compare import glance
    >>> from slewctl.files import example_design, read_design
    >>> result = glance(read_design(example_design()).case)
    >>> result.chosen.stable, len(result.curves), result.followed
    (True, 1, ())
    """
    judge = Judge(case)
    chosen = judge.evaluate(*case.origin)
    evaluations, curves = (beside.evaluations, beside.curves) if beside else ((), ())
    model, design = judge.truth, chosen.design
    shapes = []
    if not (model.given or design is None or design.model is None):
        shapes = [mode_shapes("truth", model, case.n)]
        shapes.append(mode_shapes(case.basis, design.model, case.n))
    ladders = [climb(steps(judge), judge, chosen.origin, chosen.controller)] if whole else []
    return CaseResult(
        case,
        TruthSummary(
            modes=model.modes,
            functions=model.functions,
            tolerance=model.tolerance,
            frequencies_hz=tuple(float(f) for f in model.frequencies_hz),
            optimal_cost=None,
            optimal_verified=False,
            optimum_drift=None,
            hub_ratio=hub_ratio(case.arm),
        ),
        chosen,
        followed=(),
        evaluations=(*evaluations, chosen),
        refused=(),
        curves=(*curves, loop_curves(chosen)),
        shapes=tuple(shapes),
        ladders=tuple(ladders),
    )


def named(result: CaseResult, name: str) -> CaseResult:
    """Return a glance whose design has another name than that of what it was made on.

    Parameters
    ----------
    result : CaseResult
        Of a design with a model: a given law has no name.
    name : str
        Such as ``before``.

    Returns
    -------
    CaseResult
    """
    found = result.chosen
    if found.design is None:
        return result
    found = replace(found, design=replace(found.design, source=name))
    (curves,) = result.curves
    return replace(
        result,
        chosen=found,
        evaluations=(found,),
        curves=(replace(curves, origin=found.origin),),
    )
