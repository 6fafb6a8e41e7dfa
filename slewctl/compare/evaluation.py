"""One design, made on a small model and judged on the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.arm import Arm
from slewctl.compare.case import Case
from slewctl.compare.design_model import DesignModel, design_model
from slewctl.design import Controller, lqg
from slewctl.errors import SlewctlError
from slewctl.loop import Loop, Margins, SlewResponse, SlewSummary, close, simulate_slew
from slewctl.model import Truth, truth
from slewctl.plant import generalised_plant

# Times at which a slew is drawn; its summary is read from four times as many.
_SLEW_POINTS = 201


@dataclass(frozen=True)
class PoleDamping:
    """A property of the closed-loop poles and the frequency of the pole that sets it."""

    value: float
    frequency_hz: float


@dataclass(frozen=True)
class FinerVerdict:
    """A design on a truth with twice the modes: where it differs, neither is converged.

    Attributes
    ----------
    modes : int
    stable : bool
    loss : float or None
        None when unstable.
    optimum_drift : float
        Relative change of the optimal cost.
    """

    modes: int
    stable: bool
    loss: float | None
    optimum_drift: float


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a design on n functions of a basis achieves on the truth.

    Attributes
    ----------
    basis : str
    n : int
    frequencies_hz : ndarray, shape (n,)
        Of the design model.
    frequency_errors : ndarray, shape (n,)
        Relative to the truth.
    verified, certificate : bool, str
        Whether the design's own checks passed, and the checks.
    expected_cost : float
        Squared H2 norm on the design model.
    stable : bool
        On the truth; everything below that is None needs a stable loop.
    unstable_hz : tuple of float
        Frequencies of the poles that are not stable.
    poles : ndarray of complex
        Closed-loop poles on the truth, rad/s.
    damping_ratio, decay_rate : PoleDamping
        Smallest damping ratio, and smallest decay rate (1/s), of all closed-loop poles.
    margins : Margins or None
    cost : float or None
        Squared H2 norm on the truth, confirmed to `cost_discrepancy` by a second Gramian.
    cost_discrepancy : float or None
    loss : float or None
        cost / optimum − 1.
    slew : SlewSummary or None
    finer : FinerVerdict or None
        The case's own design is judged again on a truth of twice the modes.
    optimum_verified : bool
        Whether the checks of the optimal controller, to which `loss` compares, passed.
    truth_tolerance : float
        Largest estimated relative error of the truth's frequencies.
    """

    basis: str
    n: int
    frequencies_hz: Array
    frequency_errors: Array
    verified: bool
    certificate: str
    expected_cost: float
    stable: bool
    unstable_hz: tuple[float, ...]
    poles: ComplexArray
    damping_ratio: PoleDamping
    decay_rate: PoleDamping
    margins: Margins | None
    cost: float | None
    cost_discrepancy: float | None
    loss: float | None
    slew: SlewSummary | None
    finer: FinerVerdict | None
    optimum_verified: bool
    truth_tolerance: float

    @property
    def worst_frequency_error(self) -> float:
        """Largest relative error of the design model's frequencies."""
        return float(np.abs(self.frequency_errors).max())


@dataclass(frozen=True, eq=False)
class Outcome:
    """An evaluation with the design model, the loop and the slew that it was read from."""

    evaluation: Evaluation
    design: DesignModel
    loop: Loop
    slew: SlewResponse | None


@dataclass(frozen=True, eq=False)
class Judge:
    """The truth of a case and the best that any controller can do on it."""

    case: Case

    @cached_property
    def truth(self) -> Truth:
        """The converged model."""
        return truth(self.case.arm, self.case.truth_modes)

    @cached_property
    def optimal(self) -> Controller:
        """The H2-optimal controller for the truth itself."""
        return lqg(generalised_plant(self.truth, self.case.objective))

    def model(self, basis: str, n: int) -> DesignModel:
        """Return what n functions of a basis, or a reduction to n modes, give to design on."""
        return design_model(self.truth, self.case.objective, basis, n)

    def design(self, basis: str, n: int) -> tuple[DesignModel, Controller]:
        """Return the design model and the controller made on it alone."""
        model = self.model(basis, n)
        try:
            return model, model.controller(self.case.method, self.case.options)
        except SlewctlError as error:
            raise error.within("controller", ".") from error

    def evaluate(self, basis: str, n: int) -> Outcome:
        """Return the evaluation of a design on the truth, with its loop and slew.

        Raises
        ------
        DesignError
            If no controller can be designed for the case's objective.
        """
        try:
            return self._evaluate(basis, n)
        except SlewctlError as error:
            raise error.within(self.case.source or self.case.name) from error

    def vary(self, arm: Arm) -> Evaluation:
        """Return the evaluation of the case's own controller on the truth of another arm.

        The controller is the one that `evaluate` judged: made once, for the case's own arm.
        Its loss compares with the optimum for the other arm.

        Parameters
        ----------
        arm : Arm
            The case's arm with another payload, hub, beam or damping (`slewctl.arm.vary`).

        Raises
        ------
        DesignError
            If no controller can be designed, or the other arm has no optimum to compare with.
        """
        try:
            other = Judge(replace(self.case, arm=arm))
            return other.assess(*self.own, again=True).evaluation
        except SlewctlError as error:
            raise error.within(self.case.source or self.case.name) from error

    def _evaluate(self, basis: str, n: int) -> Outcome:
        own = (basis, n) == self.chosen
        return self.assess(*(self.own if own else self.design(basis, n)), again=own)

    def assess(self, design: DesignModel, controller: Controller, *, again: bool) -> Outcome:
        """Return what a controller, made on a design model, achieves on the truth.

        Parameters
        ----------
        design : DesignModel
        controller : Controller
        again : bool
            Whether to judge it on a truth of twice the modes as well.
        """
        loop = close(self.truth, self.case.objective, controller)
        omega = design.omega
        stable = loop.stable
        slew = simulate_slew(loop, self.case.slew, _SLEW_POINTS) if stable else None
        return Outcome(
            Evaluation(
                basis=design.source,
                n=design.n,
                frequencies_hz=omega / (2 * np.pi),
                frequency_errors=omega / self.truth.omega[: len(omega)] - 1,
                verified=controller.certificate.verified,
                certificate=str(controller.certificate),
                expected_cost=controller.h2_cost,
                stable=stable,
                unstable_hz=loop.unstable_hz,
                poles=loop.poles,
                damping_ratio=_smallest(loop.poles, -loop.poles.real / np.abs(loop.poles)),
                decay_rate=_smallest(loop.poles, -loop.poles.real),
                margins=loop.margins if stable else None,
                cost=loop.h2.value if stable else None,
                cost_discrepancy=loop.h2.discrepancy if stable else None,
                loss=loop.h2.value / self.optimal.h2_cost - 1 if stable else None,
                slew=slew.summary if slew else None,
                finer=self._again(controller) if again else None,
                optimum_verified=self.optimal.certificate.verified,
                truth_tolerance=self.truth.tolerance,
            ),
            design,
            loop,
            slew,
        )

    @cached_property
    def own(self) -> tuple[DesignModel, Controller]:
        """The case's own design model and controller."""
        return self.design(*self.chosen)

    @property
    def chosen(self) -> tuple[str, int]:
        """Basis and order of the case's own design."""
        return self.case.basis, self.case.n

    def _again(self, controller: Controller) -> FinerVerdict:
        """Return the verdict on a controller on a truth of twice the modes."""
        finer = truth(self.case.arm, 2 * self.case.truth_modes)
        optimum = lqg(generalised_plant(finer, self.case.objective)).h2_cost
        loop = close(finer, self.case.objective, controller)
        return FinerVerdict(
            finer.modes,
            loop.stable,
            loop.h2.value / optimum - 1 if loop.stable else None,
            optimum / self.optimal.h2_cost - 1,
        )


def evaluate(case: Case) -> Evaluation:
    """Return the evaluation of the case's own design on the truth."""
    return Judge(case).evaluate(case.basis, case.n).evaluation


def _smallest(poles: ComplexArray, values: Array) -> PoleDamping:
    k = int(np.argmin(values))
    return PoleDamping(float(values[k]), float(np.abs(poles[k]) / (2 * np.pi)))
