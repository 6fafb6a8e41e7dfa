"""The spillover ladder: one design judged on the truth with more and more of its modes.

A controller made on n functions meets a model of the arm's own first N modes, for every N
from n to all that the truth keeps.  The rung at which the loop is first lost names the
mode that the design should have known, or filtered.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from slewctl._show import Axes, Tabular, axes_or_new
from slewctl.basis import Combined
from slewctl.compare.case import Case
from slewctl.compare.design_model import DesignModel
from slewctl.compare.destabilised import DestabilisedMode, destabilised_mode
from slewctl.compare.evaluation import Judge
from slewctl.design import Controller, lqg
from slewctl.errors import AccuracyError, InputError, SlewctlError, check_count
from slewctl.loop import Margins, close
from slewctl.model import Truth
from slewctl.plant import Objective, generalised_plant


@dataclass(frozen=True)
class Rung:
    """The design on the truth's first modes; what needs a stable loop is None without one.

    Attributes
    ----------
    modes : int
        N, flexible modes of the truth that are present.
    frequency_hz : float
        Of the last of them.
    stable : bool
    unstable_hz : tuple of float
        Frequencies of the poles that are not stable.
    destabilised : DestabilisedMode or None
        For the fastest growing pole of an unstable loop; a sampled controller's poles belong
        to no mode.
    margins : Margins or None
    cost : float or None
        Squared H2 norm.
    optimum : float
        The smallest one that any controller reaches with these N modes.
    loss : float or None
        cost / optimum − 1.
    """

    modes: int
    frequency_hz: float
    stable: bool
    unstable_hz: tuple[float, ...]
    destabilised: DestabilisedMode | None
    margins: Margins | None
    cost: float | None
    optimum: float
    loss: float | None

    @property
    def gain_db(self) -> float | None:
        """Gain margin in dB; infinite where there is no limit."""
        return self.margins.gain_db.value if self.margins else None

    @property
    def phase_deg(self) -> float | None:
        """Phase margin in degrees."""
        return self.margins.phase_deg.value if self.margins else None

    @property
    def disk(self) -> float | None:
        """α of the symmetric disk margin."""
        return self.margins.disk.value if self.margins else None


@dataclass(frozen=True, eq=False)
class Ladder(Tabular):
    """What becomes of one design as more modes of the truth are let in.

    Attributes
    ----------
    name : str
        The case's.
    basis, n, method : str, int, str
        Of the design.
    controller : Controller
    rungs : tuple of Rung
        For N = n, n + 1 … all modes of the truth.
    truth_tolerance : float
        Largest estimated relative error of the truth's frequencies.
    """

    name: str
    basis: str
    n: int
    method: str
    controller: Controller
    rungs: tuple[Rung, ...]
    truth_tolerance: float

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each rung."""
        names = ("modes", "frequency_hz", "stable", "gain_db", "phase_deg", "disk", "loss")
        return [{name: getattr(rung, name) for name in names} for rung in self.rungs]

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
        for name, label in (("gain_db", "gain margin (dB)"), ("phase_deg", "phase margin (deg)")):
            values = [getattr(rung, name) for rung in self.rungs]
            ax.plot(modes, [math.nan if v is None else v for v in values], "o-", label=label)
        ax.set_xlabel("modes of the truth")
        ax.set_title(f"{self.basis}, n = {self.n}")
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
        what = f"{self.method} on {self.basis}, n = {self.n}, "
        lost = self.first_unstable
        if lost is None:
            margins = [rung.disk for rung in self.rungs if rung.disk is not None]
            return what + (
                f"is stable with N = {self.n} to {self.rungs[-1].modes} modes; its disk margin "
                f"is {margins[0]:.3g} with N = {self.n} and {min(margins):.3g} at the least"
            )
        how = lost.destabilised or f"a pole at {lost.unstable_hz[0]:.4g} Hz"
        again = "; stable again with all modes" if self.stable_on_truth else ""
        return what + f"is lost at N = {lost.modes}: {how}{again}"

    def __str__(self) -> str:
        return f"{self.name}: {self.verdict}"


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
        For an unknown basis, or an n beyond the modes of the truth.
    DesignError
        If no controller can be designed for the case's objective.
    """
    case = replace(case, basis=case.basis if basis is None else basis, n=case.n if n is None else n)
    judge = Judge(case)
    try:
        return climb(steps(judge, case.n), judge, *judge.own)
    except SlewctlError as error:
        raise error.within(case.source or case.name) from error


@dataclass(frozen=True, eq=False)
class Step:
    """The truth's first modes, and the smallest cost that any controller reaches with them."""

    model: Truth
    optimum: float


def steps(judge: Judge, n: int) -> tuple[Step, ...]:
    """Return the truth's first n, n + 1 … all modes; the ladders of several designs share them.

    Raises
    ------
    AccuracyError
        If an optimum is not confirmed by its own checks.
    """
    return tuple(_step(judge, modes) for modes in range(n, judge.truth.modes + 1))


def _step(judge: Judge, modes: int) -> Step:
    if modes == judge.truth.modes:
        model, optimal = judge.truth, judge.optimal
    else:
        model = first_modes(judge.truth, modes)
        optimal = lqg(generalised_plant(model, judge.case.objective))
    if not optimal.certificate.verified:
        raise AccuracyError(
            f"the optimum with {modes} modes is {optimal.certificate}", where="spillover_ladder"
        )
    return Step(model, optimal.h2_cost)


def climb(
    steps: Sequence[Step], judge: Judge, design: DesignModel, controller: Controller
) -> Ladder:
    """Return what becomes of one controller of a case step by step."""
    return Ladder(
        name=judge.case.name,
        basis=design.source,
        n=design.n,
        method=judge.case.method,
        controller=controller,
        rungs=tuple(_rung(step, judge.case.objective, controller, design.n) for step in steps),
        truth_tolerance=judge.truth.tolerance,
    )


def _rung(step: Step, objective: Objective, controller: Controller, kept: int) -> Rung:
    model = step.model
    loop = close(model, objective, controller)
    cost = loop.h2.value if loop.stable else None
    return Rung(
        modes=model.modes,
        frequency_hz=float(model.frequencies_hz[-1]),
        stable=loop.stable,
        unstable_hz=() if loop.stable else loop.unstable_hz,
        destabilised=None if controller.sample_time else destabilised_mode(loop, kept),
        margins=loop.margins if loop.stable else None,
        cost=cost,
        optimum=step.optimum,
        loss=None if cost is None else cost / step.optimum - 1,
    )


def first_modes(model: Truth, modes: int) -> Truth:
    """Return a truth with only its first flexible modes: its modal truncation.

    The functions of a truth are the arm's modes in the body axis, so that the first of them
    span the same modes exactly, and every matrix is a leading block.

    Parameters
    ----------
    model : Truth
    modes : int

    Raises
    ------
    InputError
        If the truth has fewer modes.
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
