"""Designs made on small models and judged on the truth of a case."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slewctl import design as laws
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.compare.case import Case, Origin
from slewctl.compare.design_basis import DesignModel, design_model
from slewctl.compare.judgement import Judgement, Yardstick, yardstick
from slewctl.design import Controller
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.loop import Slew
from slewctl.model import Truth, truth


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A design on n functions of a basis, or on a reduction, and what it achieves on the truth.

    Attributes
    ----------
    design : DesignModel or None
        None for a given law.
    judgement : Judgement
    """

    design: DesignModel | None
    judgement: Judgement

    @property
    def origin(self) -> Origin:
        """What the controller was made on."""
        return Origin(self.design.source, self.design.n) if self.design else Origin()

    @property
    def basis(self) -> str:
        """The basis, or the reduction; empty for a given law."""
        return self.origin.basis

    @property
    def n(self) -> int:
        """Flexible modes of the design model; zero for a given law."""
        return self.origin.n

    @property
    def controller(self) -> Controller:
        """The design."""
        return self.judgement.controller

    @property
    def verified(self) -> bool:
        """Whether the design's own checks passed."""
        return self.controller.certificate.verified

    @property
    def stable(self) -> bool:
        """Whether the loop on the truth is stable."""
        return self.judgement.stable

    @property
    def loss(self) -> float | None:
        """Cost over the optimum, less one; None for an unstable loop, without weights, or where
        either cost is not known."""
        if not (self.stable and self.judgement.loop.objective.weighted):
            return None
        try:
            return self.judgement.loss
        except AccuracyError:  # the reading of it says why
            return None

    @property
    def frequencies(self) -> Array:
        """Of the design model's flexible modes in rad/s, shape (≤ n,)."""
        return self.design.omega if self.design else np.zeros(0)

    @cached_property
    def frequency_errors(self) -> Array:
        """Of the design model relative to the truth, shape (≤ n,)."""
        omega = self.frequencies
        return omega / self.judgement.yardstick.model.omega[: len(omega)] - 1

    @property
    def worst_frequency_error(self) -> float | None:
        """Largest relative error of the design model's frequencies; None without a model."""
        return float(np.abs(self.frequency_errors).max()) if self.design else None


@dataclass(frozen=True, eq=False)
class Judge:
    """The truth of a case, on which its designs are judged.

    Parameters
    ----------
    case : Case
    """

    case: Case

    @cached_property
    def yardstick(self) -> Yardstick:
        """The truth with its optimum."""
        return yardstick(truth(self.case.arm, self.case.truth_modes), self.case.objective)

    @property
    def truth(self) -> Truth:
        """The converged model."""
        return self.yardstick.model

    def design(self, basis: str, n: int) -> tuple[DesignModel | None, Controller]:
        """Return the design model and the controller made on it alone.

        Of a given law there is no model, and what it takes is fitted to the objective.

        Raises
        ------
        DesignError
            If no controller can be designed for the case's objective.
        """
        case = self.case
        model = None if case.is_given else design_model(self.truth, case.objective, basis, n)
        try:
            if model is None:
                signals = case.objective.sensors, case.objective.actuator
                return None, laws.fitted_law(case.options, *signals)
            return model, model.controller(case.method, case.options)
        except SlewctlError as error:
            raise error.within("controller", ".") from error

    @cached_property
    def own(self) -> tuple[DesignModel | None, Controller]:
        """The case's own design model and controller."""
        return self.design(*self.chosen)

    @cached_property
    def slew(self) -> Slew:
        """The slew, its shaper made for the loop of the case's own arm and controller."""
        slew = self.case.slew
        return self.judge(self.own[1]).slew if isinstance(slew.shaper, str) else slew

    @property
    def chosen(self) -> Origin:
        """Basis and order of the case's own design."""
        return self.case.origin

    def judge(self, controller: Controller) -> Judgement:
        """Return what a controller achieves on the truth."""
        return self.yardstick.judge(controller, self.case.slew)

    def evaluate(self, basis: str, n: int) -> Evaluation:
        """Return a design with its judgement on the truth.

        Raises
        ------
        DesignError
            If no controller can be designed for the case's objective.
        """
        try:
            own = (basis, n) == self.chosen
            model, controller = self.own if own else self.design(basis, n)
            return Evaluation(model, self.judge(controller))
        except SlewctlError as error:
            raise error.within(self.case.source or self.case.name) from error

    def vary(self, arm: Arm) -> Judgement:
        """Return what the case's own controller achieves on the truth of another arm.

        The controller is made once, for the case's own arm, and so is the command.  Its loss
        compares with the optimum for the other arm.

        Parameters
        ----------
        arm : Arm
            The case's arm with another payload, hub, beam or damping (`slewctl.arm.vary`).

        Raises
        ------
        DesignError
            If no controller can be designed.
        """
        try:
            controller, slew = self.own[1], self.slew
        except SlewctlError as error:
            raise error.within(self.case.source or self.case.name) from error
        return on_other_arm(self.case, arm, controller, slew)


def on_other_arm(case: Case, arm: Arm, controller: Controller, slew: Slew) -> Judgement:
    """Return what a controller achieves on the truth of another arm than the case's own.

    Parameters
    ----------
    case : Case
    arm : Arm
    controller : Controller
        Made for the case's own arm.
    slew : Slew
        With its shaper made for that.

    Returns
    -------
    Judgement
        Its loss compares with the optimum for the other arm.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Judge, on_other_arm
    >>> from slewctl.files import example_design, read_design
    >>> case = read_design(example_design()).case
    >>> judge = Judge(case)
    >>> heavy = sc.vary(case.arm, payload_mass=0.05)
    >>> on_other_arm(case, heavy, judge.own[1], judge.slew).stable
    True
    """
    try:
        return Judge(replace(case, arm=arm, slew=slew)).judge(controller)
    except SlewctlError as error:
        raise error.within(case.source or case.name) from error


@single_threaded
def evaluate(case: Case) -> Evaluation:
    """Return the case's own design, judged on the truth.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Evaluation

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, evaluate
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> evaluate(case).stable
    True
    """
    return Judge(case).evaluate(*case.origin)
