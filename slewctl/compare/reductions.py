"""A better basis before modelling, or a reduction after it: designs with equally many states.

Each design model has n flexible modes or 2n flexible states beside the rigid body.  Four
are Galerkin models on n functions; the others are reductions of the truth, which cost its
computation first.  All designs use the same method and are judged on the truth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import control

from slewctl.basis import create
from slewctl.compare.case import Case
from slewctl.compare.evaluation import Judge
from slewctl.design import METHODS
from slewctl.errors import AccuracyError, DesignError, InputError, check_count
from slewctl.loop import Margins, close
from slewctl.model import assemble
from slewctl.plant import (
    GeneralisedPlant,
    Reduced,
    balanced_truncation,
    generalised_plant,
    modal_truncation,
)

BASES_BEFORE = ("clamped-free", "slewing", "hub-matched", "arm-matched")

REDUCTIONS_AFTER: dict[str, Callable[[GeneralisedPlant, int], Reduced]] = {
    "balanced truncation": lambda plant, n: balanced_truncation(plant, 2 * n + 2),
    "balanced truncation, control path": lambda plant, n: balanced_truncation(
        plant, 2 * n + 2, path="control"
    ),
    "modal truncation": lambda plant, n: modal_truncation(plant, n, False),
    "modal truncation, static correction": lambda plant, n: modal_truncation(plant, n, True),
}


@dataclass(frozen=True)
class ReductionRow:
    """A design on one small model, judged on the truth; without a stable loop no figures.

    Attributes
    ----------
    name : str
        The basis, or the reduction.
    after : bool
        Whether the small model is a reduction of the truth.
    states : int
        Of the design model.
    bound : float or None
        Of a reduction's error, see `Reduced`.
    refused : str
        Why there is no design; empty where there is one.
    verified : bool
        Whether the design's own checks passed.
    stable : bool
    unstable_hz : tuple of float
    cost, loss : float or None
        Squared H2 norm, and cost / optimum − 1.
    margins : Margins or None
    """

    name: str
    after: bool
    states: int
    bound: float | None = None
    refused: str = ""
    verified: bool = False
    stable: bool = False
    unstable_hz: tuple[float, ...] = ()
    cost: float | None = None
    loss: float | None = None
    margins: Margins | None = None


@dataclass(frozen=True, eq=False)
class Reductions:
    """The designs of one order side by side.

    Attributes
    ----------
    name : str
        The case's.
    order : int
        Flexible modes of each design model.
    method : str
    optimum : float
        The smallest cost that any controller reaches on the truth.
    truth_modes : int
    rows : tuple of ReductionRow
    """

    name: str
    order: int
    method: str
    optimum: float
    truth_modes: int
    rows: tuple[ReductionRow, ...]

    def __getitem__(self, name: str) -> ReductionRow:
        """Return the row of a basis or a reduction by its name."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)


def compare_reductions(case: Case, order: int) -> Reductions:
    """Return designs with `order` flexible modes by basis and by reduction of the truth.

    Parameters
    ----------
    case : Case
        Its arm, objective, method and truth are used; its flexible modes damped.
    order : int
        Flexible modes of each design model, fewer than the truth has.

    Returns
    -------
    Reductions
        A model on which the method finds no controller, or a reduction that cannot be had,
        has a row that says why.

    Raises
    ------
    InputError
        If the truth has not more modes than `order`.
    DesignError
        If the case's objective admits no optimal controller on the truth.
    """
    judge = Judge(case)
    if check_count(order, "order") >= case.truth_modes:
        raise InputError(
            f"the truth has {case.truth_modes} modes, there is nothing to reduce",
            where="order",
            remedy=f"give an order below {case.truth_modes}",
        )
    rows = [_before(judge, name, order) for name in BASES_BEFORE]
    whole = generalised_plant(judge.truth, case.objective)
    rows += [_after(judge, whole, name, order) for name in REDUCTIONS_AFTER]
    return Reductions(
        case.name, order, case.method, judge.optimal.h2_cost, judge.truth.modes, tuple(rows)
    )


def _before(judge: Judge, name: str, order: int) -> ReductionRow:
    model = assemble(judge.case.arm, create(name, order, judge.case.arm))
    plant = generalised_plant(model, judge.case.objective)
    return _row(judge, name, plant, lambda system: system, None)


def _after(judge: Judge, whole: GeneralisedPlant, name: str, order: int) -> ReductionRow:
    try:
        reduced = REDUCTIONS_AFTER[name](whole, order)
    except (InputError, AccuracyError) as error:
        return ReductionRow(name, True, 2 * order + 2, refused=str(error))
    plant = reduced.plant or whole
    return _row(judge, name, plant, reduced.corrected, reduced.bound)


def _row(
    judge: Judge,
    name: str,
    plant: GeneralisedPlant,
    correct: Callable[[control.StateSpace], control.StateSpace],
    bound: float | None,
) -> ReductionRow:
    """Design on `plant`, close around the truth, and say what came of it."""
    case, after = judge.case, bound is not None
    states = int(plant.system.nstates)
    try:
        controller = METHODS[case.method](plant, **case.options)
    except (DesignError, InputError, AccuracyError) as error:
        return ReductionRow(name, after, states, bound, refused=str(error))
    loop = close(judge.truth, case.objective, correct(controller.system))
    cost = loop.h2.value if loop.stable else None
    return ReductionRow(
        name=name,
        after=after,
        states=states,
        bound=bound,
        verified=controller.certificate.verified,
        stable=loop.stable,
        unstable_hz=() if loop.stable else loop.unstable_hz,
        cost=cost,
        loss=None if cost is None else cost / judge.optimal.h2_cost - 1,
        margins=loop.margins if loop.stable else None,
    )
