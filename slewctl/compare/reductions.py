"""A better basis before modelling, or a reduction after it: designs with equally many states.

Each design model has n flexible modes or 2n flexible states beside the rigid body.  Four
are Galerkin models on n functions; the others are reductions of the truth, which cost its
computation first.  All designs use the same method and are judged on the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

from slewctl._show import DataFrame, table_html, to_frame
from slewctl._threads import single_threaded
from slewctl.compare.case import Case
from slewctl.compare.design_basis import REDUCTIONS, SOURCES, check_reducible
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.errors import InputError, SlewctlError


@dataclass(frozen=True, eq=False)
class ReductionRow:
    """A design on one small model, judged on the truth.

    Attributes
    ----------
    name : str
        The basis, or the reduction.
    after : bool
        Whether the small model is a reduction of the truth.
    evaluation : Evaluation or None
        The design with its judgement.
    refused : str
        Why there is no design; empty where there is one.
    """

    name: str
    after: bool
    evaluation: Evaluation | None = None
    refused: str = ""

    @property
    def stable(self) -> bool:
        """Whether there is a design and its loop on the truth is stable."""
        return self.evaluation is not None and self.evaluation.stable

    @property
    def loss(self) -> float | None:
        """Cost over the optimum, less one; None without a stable loop."""
        return self.evaluation.loss if self.evaluation else None

    def told(self) -> dict[str, object]:
        """Return the row as plain values."""
        design = self.evaluation.design if self.evaluation else None
        return {
            "name": self.name,
            "after": self.after,
            "states": int(design.plant.linear.nstates) if design else None,
            "bound": design.reduced.bound if design and design.reduced else None,
            "verified": self.evaluation is not None and self.evaluation.verified,
            "stable": self.stable,
            "loss": self.loss,
            "refused": self.refused,
        }


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

    def table(self) -> list[dict[str, object]]:
        """Return one row of plain values for each design."""
        return [row.told() for row in self.rows]

    def _repr_html_(self) -> str:
        caption = f"{self.name}: {self.method} on {self.order} flexible modes, judged on the truth"
        return table_html(self.table(), caption)

    def to_frame(self) -> DataFrame:
        """Return the table as a pandas data frame."""
        return to_frame(self.table())

    def __getitem__(self, name: str) -> ReductionRow:
        """Return the row of a basis or a reduction by its name."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)


@single_threaded
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
        If the truth has not more modes than `order`, or the case has a given law.
    DesignError
        If the case's objective admits no optimal controller on the truth.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, compare_reductions
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> [row.name for row in compare_reductions(case, order=1).rows][:2]
    ['clamped-free', 'slewing']
    """
    if case.is_given:
        raise InputError(
            "a given law is made on no model",
            where="method",
            remedy="compare reductions for a method that designs",
        )
    judge = Judge(case)
    check_reducible(case.truth_modes, order, "order")
    rows = tuple(_row(judge, name, order) for name in SOURCES)
    best = judge.yardstick.optimum().h2_cost
    return Reductions(case.name, order, case.method, best, judge.truth.modes, rows)


def _row(judge: Judge, name: str, order: int) -> ReductionRow:
    """Design on one small model, judge it on the truth, or say why there is no design."""
    after = name in REDUCTIONS
    try:
        design, controller = judge.design(name, order)
    except SlewctlError as error:
        return ReductionRow(name, after, refused=str(error))
    return ReductionRow(name, after, Evaluation(design, judge.judge(controller)))
