"""One design, made on a small model and judged on the truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.basis import create
from slewctl.compare.case import Case
from slewctl.design import METHODS, Controller, lqg
from slewctl.errors import SlewctlError
from slewctl.loop import Loop, Margins, SlewResponse, SlewSummary, close, simulate_slew
from slewctl.model import Model, Truth, assemble, truth
from slewctl.plant import generalised_plant


@dataclass(frozen=True)
class PoleDamping:
    """A property of the closed-loop poles and the frequency of the pole that sets it."""

    value: float
    frequency_hz: float


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

    @property
    def worst_frequency_error(self) -> float:
        """Largest relative error of the design model's frequencies."""
        return float(np.abs(self.frequency_errors).max())


@dataclass(frozen=True, eq=False)
class Outcome:
    """An evaluation with the loop and the slew response that it was read from."""

    evaluation: Evaluation
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

    @cached_property
    def optimum_drift(self) -> float:
        """Relative change of the optimal cost when the truth keeps twice the modes."""
        finer = truth(self.case.arm, 2 * self.case.truth_modes)
        cost = lqg(generalised_plant(finer, self.case.objective)).h2_cost
        return cost / self.optimal.h2_cost - 1

    def design(self, basis: str, n: int) -> tuple[Model, Controller]:
        """Return the design model and the controller made on it alone."""
        model = assemble(self.case.arm, create(basis, n))
        plant = generalised_plant(model, self.case.objective)
        return model, METHODS[self.case.method](plant)

    def evaluate(self, basis: str, n: int) -> Outcome:
        """Return the evaluation of a design on the truth, with its loop and slew.

        Raises
        ------
        DesignError
            If no controller can be designed for the case's objective.
        """
        try:
            model, controller = self.design(basis, n)
        except SlewctlError as error:
            raise error.within(self.case.source or self.case.name) from error
        loop = close(self.truth, self.case.objective, controller)
        kept = self.truth.omega[: model.n]
        stable = loop.stable
        slew = simulate_slew(loop, self.case.slew) if stable else None
        return Outcome(
            Evaluation(
                basis=basis,
                n=n,
                frequencies_hz=model.frequencies_hz,
                frequency_errors=model.omega / kept - 1,
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
            ),
            loop,
            slew,
        )


def evaluate(case: Case) -> Evaluation:
    """Return the evaluation of the case's own design on the truth."""
    return Judge(case).evaluate(case.basis, case.n).evaluation


def _smallest(poles: ComplexArray, values: Array) -> PoleDamping:
    k = int(np.argmin(values))
    return PoleDamping(float(values[k]), float(np.abs(poles[k]) / (2 * np.pi)))
