"""Cases side by side: each design beside the same method on other bases and orders."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slewctl._show import Axes, Tabular, axes_or_new
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import ModalData
from slewctl.compare.case import Case, Origin
from slewctl.compare.convergence import Followed, follow
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.compare.ladder import Ladder, climb, steps
from slewctl.compare.quantities import QUANTITIES, RECORDED, WEIGHTED
from slewctl.compare.reading import row
from slewctl.compare.truth_summary import TruthSummary, summary_of
from slewctl.design.methods import GIVEN
from slewctl.errors import SlewctlError
from slewctl.loop import SlewResponse
from slewctl.loop.curves import curve
from slewctl.model import Model

if TYPE_CHECKING:
    from slewctl.loop.on_measured import OnMeasured

Progress = Callable[[str], None]

# More curves in a figure cannot be told apart.
SHAPES_SHOWN = 6
# What a report follows of the case's own design.
FOLLOWED = ("stable", "h2_loss", *RECORDED)
# Of the curves of a page, which holds many: see `slewctl.loop.curves`.
_CURVE_POINTS = 120
_CURVE_STEP = 0.25


@dataclass(frozen=True, eq=False)
class LoopCurves:
    """The return ratio L(jω) of one design on the truth, and its slew.

    Attributes
    ----------
    origin : Origin
        What the controller was made on.
    stable : bool
    frequency_hz, gain_db, phase_deg : ndarray
        Dense around every pole of the loop; the phase is continuous.
    slew : SlewResponse or None
        None for an unstable loop.
    """

    origin: Origin
    stable: bool
    frequency_hz: Array
    gain_db: Array
    phase_deg: Array
    slew: SlewResponse | None


@dataclass(frozen=True, eq=False)
class ModeShapes:
    """Arc displacement of the first flexible modes along the beam, at unit modal mass.

    Attributes
    ----------
    source : str
        The basis, or the truth.
    x : ndarray, shape (m,)
        m from the clamp.
    shapes : ndarray, shape (modes, m)
    frequencies_hz : ndarray, shape (modes,)
    """

    source: str
    x: Array
    shapes: Array
    frequencies_hz: Array


@dataclass(frozen=True)
class Refusal:
    """A basis and order for which the case's method makes no controller, and why not.

    Attributes
    ----------
    basis : str
    n : int
        Number of functions.
    reason : str
    """

    basis: str
    n: int
    reason: str


@dataclass(frozen=True, eq=False)
class CaseResult(Tabular):
    """A case with everything that was tried for it.

    Attributes
    ----------
    case : Case
    truth : TruthSummary
    chosen : Evaluation
        The case's own design.
    followed : tuple of Followed
        Its stability, loss and margins on truths of twice the modes.
    evaluations : tuple of Evaluation
        Every basis and order compared for which there is a design, the chosen one included.
    refused : tuple of Refusal
        The others, such as a model without the mode that an option names.
    curves : tuple of LoopCurves
        The chosen order on each basis.
    shapes : tuple of ModeShapes
        The truth, and the chosen order on each basis; none for a given law, and none of an arm
        from modal data.
    ladders : tuple of Ladder
        The chosen order on each basis, as more and more modes of the truth are let in.
    slewed : bool
        Whether a slew was asked for: without one what the case's own gives is not told.
    measured : OnMeasured or None
        The chosen controller on a measured response.
    """

    case: Case
    truth: TruthSummary
    chosen: Evaluation
    followed: tuple[Followed, ...]
    evaluations: tuple[Evaluation, ...]
    refused: tuple[Refusal, ...]
    curves: tuple[LoopCurves, ...]
    shapes: tuple[ModeShapes, ...]
    ladders: tuple[Ladder, ...]
    slewed: bool = True
    measured: OnMeasured | None = None

    @property
    def from_modal_data(self) -> bool:
        """Whether the arm is from modal data, so that they are the truth."""
        return isinstance(self.case.arm.beam, ModalData)

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each design: every quantity by its name."""
        return [
            {"case": self.case.name, **e.origin.cells, "verified": e.verified} | row(e.judgement)
            for e in self.evaluations
        ]

    @property
    def caption(self) -> str:
        """The case's name."""
        return f"{self.case.name}: designs judged on the truth"

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the loss of every basis over the number of functions; unstable designs are gaps.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        for basis in dict.fromkeys(e.basis for e in self.evaluations):
            own = [e for e in self.evaluations if e.basis == basis]
            losses = [np.nan if e.loss is None else e.loss for e in own]
            ax.plot([e.n for e in own], losses, "o-", label=basis or GIVEN)
        ax.set_yscale("log")
        ax.set_xlabel("functions n")
        ax.set_ylabel("lost of the optimal cost")
        ax.set_title(self.case.name)
        ax.legend()
        return ax


@dataclass(frozen=True, eq=False)
class Comparison(Tabular):
    """The results of all cases compared.

    Attributes
    ----------
    cases : tuple of CaseResult
    """

    cases: tuple[CaseResult, ...]

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each design of each case."""
        return [row for case in self.cases for row in case.rows()]

    @property
    def caption(self) -> str:
        """What the rows are."""
        return "designs judged on the truth"


@single_threaded
def compare(cases: Iterable[Case], progress: Progress | None = None) -> Comparison:
    """Return every case's design, and its alternatives, judged on the truth.

    Parameters
    ----------
    cases : iterable of Case
    progress : callable, optional
        Called with a short text before each design.

    Returns
    -------
    Comparison

    Raises
    ------
    SlewctlError
        If there is no controller for a case's own design; for an alternative there is a
        `Refusal` instead.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, compare
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> [e.stable for e in compare([case]).cases[0].evaluations]
    [True, True]
    """
    return Comparison(tuple(_compare_one(case, progress or _quiet) for case in cases))


def count_designs(cases: Iterable[Case]) -> int:
    """Return how many times `compare` calls `progress`.

    Parameters
    ----------
    cases : iterable of Case

    Returns
    -------
    int

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, count_designs
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> count_designs([case])
    2
    """
    return sum(len(case.candidates) for case in cases)


def _quiet(_: str) -> None:
    return None


def _compare_one(case: Case, progress: Progress) -> CaseResult:
    judge = Judge(case)
    evaluations: list[Evaluation] = []
    refused: list[Refusal] = []
    curves: list[LoopCurves] = []
    ladders: list[Ladder] = []
    stairs = steps(judge)
    shown = not (case.is_given or judge.truth.given)
    shapes = [mode_shapes("truth", judge.truth, case.n)] if shown else []
    for origin in case.candidates:
        progress(f"{case.name}: {origin}")
        try:
            found = judge.evaluate(*origin)
            row(found.judgement)  # all of it is computed here, where it is waited for
        except SlewctlError as error:
            if origin == case.origin:
                raise
            refused.append(Refusal(*origin, str(error)))
            continue
        evaluations.append(found)
        if origin.n == case.n:
            curves.append(loop_curves(found))
            ladders.append(climb(stairs, case, origin, found.judgement))
            if found.design is not None and found.design.model is not None and shapes:
                shapes.append(mode_shapes(origin.basis, found.design.model, case.n))
    chosen = next(e for e in evaluations if e.origin == case.origin)
    return CaseResult(
        case,
        summary_of(judge, chosen),
        chosen,
        tuple(follow(chosen.judgement, name) for name in FOLLOWED if _told(case, name)),
        tuple(evaluations),
        tuple(refused),
        tuple(curves),
        tuple(shapes),
        tuple(ladders),
    )


def _told(case: Case, name: str) -> bool:
    """Whether a quantity has a meaning: nothing costs without limits and noise."""
    return case.objective.weighted or QUANTITIES[name].kind not in WEIGHTED


def loop_curves(evaluation: Evaluation) -> LoopCurves:
    """Return the curves of a design on the truth, and its slew."""
    loop = evaluation.judgement.loop
    drawn = curve(loop, _CURVE_POINTS, _CURVE_STEP)
    return LoopCurves(
        evaluation.origin,
        evaluation.stable,
        drawn.frequency_hz,
        drawn.gain_db,
        drawn.phase_deg,
        evaluation.judgement.moved,
    )


def mode_shapes(source: str, model: Model, n: int) -> ModeShapes:
    """Return the shapes of the first flexible modes of a model, as many as a figure shows."""
    modes = min(n, SHAPES_SHOWN)
    x = np.linspace(0.0, model.arm.beam.length, 51)
    displacements = (model.displacement(x) @ model.mode_shapes[:, 1 : modes + 1]).T
    return ModeShapes(source, x, displacements, model.frequencies_hz[:modes])
