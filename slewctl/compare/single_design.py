"""A design alone, seen at once: its loop and its slew on its own truth, nothing followed yet."""

from __future__ import annotations

from dataclasses import replace

from slewctl._threads import single_threaded
from slewctl.compare.case import Case, Origin
from slewctl.compare.comparison import (
    CaseResult,
    ModeShapes,
    loop_curves,
    mode_shapes,
)
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.compare.judgement import Judgement, Yardstick
from slewctl.compare.ladder import Ladder, climb, steps
from slewctl.compare.seen_ladder import climb_at_once
from slewctl.compare.truth_summary import truth_summary


@single_threaded
def glance(
    case: Case, beside: CaseResult | None = None, *, whole: bool = False, ladder: bool = True
) -> CaseResult:
    """Return a case's own design on its truth, without what takes long.

    Parameters
    ----------
    case : Case
    beside : CaseResult, optional
        Another glance, such as at the same design before a change, whose curves are shown too.
    whole : bool
        Whether what the ladder tells and the least cost are proved and confirmed; otherwise
        they are as they are seen.
    ladder : bool
        Whether there is one.

    Returns
    -------
    CaseResult
        With the design's curves, shapes and ladder; nothing is followed over finer truths, and
        of the truth neither the optimum nor its drift is told.

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
    if not whole:
        chosen = replace(chosen, judgement=replace(chosen.judgement, at_once=True))
    evaluations, curves = (beside.evaluations, beside.curves) if beside else ((), ())
    model, design = judge.truth, chosen.design
    shapes: tuple[ModeShapes, ...] = ()
    if not (model.given or design is None or design.model is None):
        sources = (("truth", model), (case.basis, design.model))
        shapes = tuple(mode_shapes(*source, case.n) for source in sources)
    ladders = beside.ladders if beside else ()
    if ladder:
        climbed = climb if whole else climb_at_once
        ladders = (*ladders, climbed(*_beginning(judge, chosen)))
    return CaseResult(
        case,
        truth_summary(model),
        chosen,
        followed=(),
        evaluations=(*evaluations, chosen),
        refused=(),
        curves=(*curves, loop_curves(chosen)),
        shapes=shapes,
        ladders=ladders,
    )


def glance_at_ladder(case: Case) -> Ladder:
    """Return the ladder of a `glance`, without what else is in that.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Ladder

    Raises
    ------
    SlewctlError
        If there is no controller.

    Examples
    --------
    >>> from slewctl.compare.single_design import glance_at_ladder
    >>> from slewctl.files import example_design, read_design
    >>> len(glance_at_ladder(read_design(example_design()).case).rungs)
    7
    """
    judge = Judge(case)
    return climb_at_once(*_beginning(judge, judge.evaluate(*case.origin)))


def _beginning(
    judge: Judge, chosen: Evaluation
) -> tuple[tuple[Yardstick, ...], Case, Origin, Judgement]:
    return steps(judge), judge.case, chosen.origin, chosen.judgement


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
    (curves,), (ladder,) = result.curves, result.ladders
    return replace(
        result,
        chosen=found,
        evaluations=(found,),
        curves=(replace(curves, origin=found.origin),),
        ladders=(replace(ladder, origin=found.origin),),
    )
