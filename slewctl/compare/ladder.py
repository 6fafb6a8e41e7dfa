"""The spillover ladder: one design judged on the truth with more and more of its modes.

A controller made on n functions meets a model of the arm's own first N modes, for every N
from n to all that the truth keeps.  The rung at which the loop is first lost names the
mode that the design should have known, or filtered.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

from slewctl._show import Axes, Tabular, axes_or_new
from slewctl._threads import single_threaded
from slewctl.basis import Combined
from slewctl.compare.case import Case, Origin
from slewctl.compare.evaluation import Judge
from slewctl.compare.judgement import Judgement, Yardstick, yardstick
from slewctl.compare.quantities import PASSES, UNWEIGHTED
from slewctl.compare.reading import read
from slewctl.design import Controller
from slewctl.errors import InputError, SlewctlError, check_count
from slewctl.loop.robust.destabilised_mode import DestabilisedMode, destabilised_mode
from slewctl.model import Truth


@dataclass(frozen=True, eq=False)
class Rung:
    """The design on the truth's first modes.

    Attributes
    ----------
    judgement : Judgement
        On a truth that keeps only these modes; its loss compares with the optimum for them.
    destabilised : DestabilisedMode or None
        For the fastest growing pole of an unstable loop; a sampled controller's poles belong
        to no mode.
    """

    judgement: Judgement
    destabilised: DestabilisedMode | None

    @property
    def modes(self) -> int:
        """N, flexible modes of the truth that are present."""
        return self.judgement.modes

    @property
    def frequency_hz(self) -> float:
        """Of the last of them."""
        return float(self.judgement.yardstick.model.frequencies_hz[-1])

    @property
    def stable(self) -> bool:
        """Whether the loop is stable with these modes."""
        return self.judgement.stable

    def value(self, name: str) -> float | None:
        """Return a quantity of `slewctl.compare.QUANTITIES`, None where none is confirmed."""
        reading = read(self.judgement, name)
        return None if math.isnan(reading.value) or reading.doubt else reading.value


# What a ladder tells of each rung, in this order.
TOLD = ("gain_margin_db", "phase_margin_deg", "disk_margin", "h2_loss")


@dataclass(frozen=True, eq=False)
class Ladder(Tabular):
    """What becomes of one design as more modes of the truth are let in.

    Attributes
    ----------
    name : str
        The case's.
    origin : Origin
        What the controller was made on.
    method : str
    controller : Controller
    rungs : tuple of Rung
        For N = n, n + 1 … all modes of the truth; from the first mode on for a given law.
    truth_tolerance : float
        Largest estimated relative error of the truth's frequencies.
    """

    name: str
    origin: Origin
    method: str
    controller: Controller
    rungs: tuple[Rung, ...]
    truth_tolerance: float

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each rung."""
        return [
            {"modes": rung.modes, "frequency_hz": rung.frequency_hz, "stable": rung.stable}
            | {name: rung.value(name) for name in TOLD}
            for rung in self.rungs
        ]

    @property
    def caption(self) -> str:
        """What became of the design."""
        return str(self)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw gain and phase margin over the number of modes let in; unstable rungs are gaps.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        modes = [rung.modes for rung in self.rungs]
        for name, label in (
            ("gain_margin_db", "gain margin (dB)"), ("phase_margin_deg", "phase margin (deg)")
        ):  # fmt: skip
            values = [rung.value(name) for rung in self.rungs]
            ax.plot(modes, [math.nan if v is None else v for v in values], "o-", label=label)
        ax.set_xlabel("modes of the truth")
        ax.set_title(str(self.origin))
        ax.legend()
        return ax

    @property
    def first_unstable(self) -> Rung | None:
        """The lowest rung that is unstable: its `destabilised` is the first mode lost."""
        return next((rung for rung in self.rungs if not rung.stable), None)

    @property
    def unstable_from(self) -> int | None:
        """The N from which on every rung is unstable; None when the whole truth is stable."""
        stable = [rung.modes for rung in self.rungs if rung.stable]
        if self.rungs[-1].stable:
            return None
        return stable[-1] + 1 if stable else self.rungs[0].modes

    @property
    def stable_on_truth(self) -> bool:
        """Whether the last rung, with all modes, is stable."""
        return self.rungs[-1].stable

    @property
    def verdict(self) -> str:
        """What became of the design, in one sentence."""
        what = f"{self.method} on {self.origin}, " if self.origin.basis else "the given law "
        first, last = self.rungs[0].modes, self.rungs[-1].modes
        lost = self.first_unstable
        if lost is None:
            found = [rung.value("disk_margin") for rung in self.rungs]
            told = [margin for margin in found if margin is not None]
            if len(told) < len(found):
                return f"{what}is stable with N = {first} to {last} modes, by little: not proved"
            return what + (
                f"is stable with N = {first} to {last} modes; its disk margin "
                f"is {told[0]:.3g} with N = {first} and {min(told):.3g} at the least"
            )
        again = "; stable again with all modes" if self.stable_on_truth else ""
        return f"{what}is lost at N = {lost.modes}: {self._how(lost)}{again}"

    def _how(self, lost: Rung) -> str:
        """Return what grows; of a given law nobody knows what its designer neglected."""
        if lost.destabilised is None:
            return f"a pole at {lost.judgement.unstable_hz[0]:.4g} Hz"
        return str(lost.destabilised) if self.origin.basis else lost.destabilised.place

    @property
    def unknown(self) -> str:
        """Why the first stable rung of which a quantity is not known has none; empty if none."""
        for rung in self.rungs:
            for name in TOLD if rung.stable else ():
                reading = read(rung.judgement, name)
                told = reading.note in (UNWEIGHTED, PASSES)  # without weights, or infinite
                if rung.value(name) is None and not told:
                    what = name.replace("_", " ")
                    return f"{what} with N = {rung.modes}: {reading.doubt or reading.note}"
        return ""

    def __str__(self) -> str:
        return f"{self.name}: {self.verdict}"


@single_threaded
def spillover_ladder(case: Case, basis: str | None = None, n: int | None = None) -> Ladder:
    """Return a case's design judged with N = n … all modes of the truth.

    Parameters
    ----------
    case : Case
    basis : str, optional
        Another basis for the design than the case's own.
    n : int, optional
        Another number of functions.

    Returns
    -------
    Ladder

    Raises
    ------
    InputError
        For an unknown basis, an n beyond the modes of the truth, or either for a given law.
    DesignError
        If no controller can be designed for the case's objective.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, spillover_ladder
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> len(spillover_ladder(case).rungs)
    5
    """
    judge = Judge(redesigned(case, basis, n))
    try:
        own = judge.judge(judge.own[1])
        return climb(steps(judge), judge.case, judge.case.origin, own)
    except SlewctlError as error:
        raise error.within(case.source or case.name) from error


def redesigned(case: Case, basis: str | None, n: int | None) -> Case:
    """Return a case whose design is made on another basis or order, where one is named."""
    if case.is_given and not (basis is None and n is None):
        raise InputError(
            "a given law is made on no basis and no number of functions",
            where="model.n" if basis is None else "model.basis",
            remedy="leave it out",
        )
    own = case.origin
    return replace(case, basis=own.basis if basis is None else basis, n=own.n if n is None else n)


def steps(judge: Judge) -> tuple[Yardstick, ...]:
    """Return the truth's first n, n + 1 … all modes; the ladders of several designs share them."""
    whole, lowest = judge.yardstick, max(judge.case.n, 1)
    models = _shorter(whole.model)[lowest - 1 :]
    return (*(yardstick(model, whole.objective) for model in models), whole)


@lru_cache(maxsize=8)
def _shorter(model: Truth) -> tuple[Truth, ...]:
    """Return the truth's first 1, 2, … modes: what they yield is computed once for all designs."""
    return tuple(first_modes(model, modes) for modes in range(1, model.modes))


def climb(steps: Sequence[Yardstick], case: Case, origin: Origin, judgement: Judgement) -> Ladder:
    """Return what becomes of one controller of a case step by step, to its known last one."""
    controller = judgement.controller
    judged = (*(step.judge(controller, case.slew) for step in steps[:-1]), judgement)
    return Ladder(
        name=case.name,
        origin=origin,
        method=case.method,
        controller=controller,
        rungs=tuple(_rung(each, origin.n) for each in judged),
        truth_tolerance=judgement.yardstick.model.tolerance,
    )


def _rung(judgement: Judgement, kept: int) -> Rung:
    if judgement.controller.sample_time:
        return Rung(judgement, None)
    return Rung(judgement, destabilised_mode(judgement.loop, kept))


def first_modes(model: Truth, modes: int) -> Truth:
    """Return a truth with only its first flexible modes: its modal truncation.

    The functions of a truth are the arm's modes in the body axis, so that the first of them
    span the same modes exactly, and every matrix is a leading block.

    Parameters
    ----------
    model : Truth
    modes : int

    Returns
    -------
    Truth

    Raises
    ------
    InputError
        If the truth has fewer modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> from slewctl.compare import first_modes
    >>> first_modes(sc.truth(arm, 6), 2).n
    2
    """
    if check_count(modes, "modes") > model.modes:
        raise InputError(
            f"the truth has {model.modes} modes", where="modes", remedy="keep more in the truth"
        )
    if not isinstance(model.basis, Combined):
        raise InputError(
            f"the model is on the {model.basis.name} basis, not in the arm's own modes",
            where="first_modes",
            remedy="give one made by slewctl.truth",
        )
    size = modes + 1
    values = {field.name: getattr(model, field.name) for field in fields(Truth)}
    for name in ("mass", "damping", "stiffness", "mode_shapes"):
        values[name] = values[name][:size, :size].copy()
    values["input"] = model.input[:size].copy()
    values["omega"] = model.omega[:modes].copy()
    values["frequency_errors"] = np.asarray(model.frequency_errors)[:modes].copy()
    values["basis"] = Combined(modes, model.basis.parent, model.basis.coefficients[:, :modes])
    return Truth(**values)
