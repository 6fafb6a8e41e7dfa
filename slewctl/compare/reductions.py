"""A better basis before modelling, or a reduction after it: designs with equally many states.

Each design model has n flexible modes or 2n flexible states beside the rigid body.  Four
are Galerkin models on n functions; the others are reductions of the truth, which cost its
computation first.  All designs use the same method and are judged on the truth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from slewctl._show import DataFrame, table_html, to_frame
from slewctl.compare.case import Case
from slewctl.compare.design_model import REDUCTIONS, SOURCES, check_reducible
from slewctl.compare.evaluation import Judge
from slewctl.errors import SlewctlError
from slewctl.loop import Margins, close


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

    def table(self) -> list[dict[str, object]]:
        """Return one row of plain values for each design."""
        names = ("name", "after", "states", "bound", "verified", "stable", "loss", "refused")
        return [{name: getattr(row, name) for name in names} for row in self.rows]

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
    check_reducible(case.truth_modes, order, "order")
    rows = tuple(_row(judge, name, order) for name in SOURCES)
    return Reductions(case.name, order, case.method, judge.optimal.h2_cost, judge.truth.modes, rows)


def _row(judge: Judge, name: str, order: int) -> ReductionRow:
    """Design on one small model, close around the truth, and say what came of it."""
    row = ReductionRow(name, name in REDUCTIONS, 2 * order + 2)
    try:
        design, controller = judge.design(name, order)
    except SlewctlError as error:
        return replace(row, refused=str(error))
    loop = close(judge.truth, judge.case.objective, controller)
    cost = loop.h2.value if loop.stable else None
    return replace(
        row,
        states=int(design.plant.system.nstates),
        bound=design.reduced.bound if design.reduced else None,
        verified=controller.certificate.verified,
        stable=loop.stable,
        unstable_hz=() if loop.stable else loop.unstable_hz,
        cost=cost,
        loss=None if cost is None else cost / judge.optimal.h2_cost - 1,
        margins=loop.margins if loop.stable else None,
    )
