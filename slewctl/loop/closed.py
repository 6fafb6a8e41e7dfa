"""A controller closed around a model: stability first, then everything that needs it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design import Controller
from slewctl.errors import AccuracyError
from slewctl.loop.curves import draw
from slewctl.loop.parts import Pair, negated
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.factored_loop import FactoredLoop, factored
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.mode_names import Modes, modes_of_pair
from slewctl.loop.single.proved_stability import proved_stability
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.loop.tracking import tracking_controller, tracking_loop
from slewctl.model import Model
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.h2_norm import H2Cost, cost_of_loop
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import stability_threshold
from slewctl.plant import GeneralisedPlant, Objective, generalised_plant
from slewctl.plant.readings import with_lags
from slewctl.plant.statespace import bare_equations

if TYPE_CHECKING:
    import control


class Planted(Protocol):
    """What has the generalised plant of an objective on a model."""

    @property
    def plant(self) -> GeneralisedPlant: ...


@dataclass(frozen=True, eq=False)
class Loop:
    """A controller closed around a model, usually the truth.

    Parameters
    ----------
    model : Model
        What the controller acts on.
    objective : Objective
        Disturbances and cost by which it is judged.
    controller : Controller
        Designed on any model of the same arm; which arm that was is not checked.
    source : object, optional
        Has the ``plant`` of the objective on the model, where several loops share it.
    """

    model: Model
    objective: Objective
    controller: Controller
    source: Planted | None = field(default=None, kw_only=True)

    @cached_property
    def plant(self) -> GeneralisedPlant:
        """The generalised plant of the objective on the model."""
        return self._planted

    @property
    def _planted(self) -> GeneralisedPlant:
        if self.source is not None:
            return self.source.plant
        return generalised_plant(self.model, self.objective)

    @property
    def late(self) -> float:
        """Dead time of the loop in s, from a reading to the torque that answers it."""
        return self.controller.delay

    @property
    def exact_dead_time(self) -> float:
        """Dead time in s that `response` knows of and `opened` does not."""
        return 0.0

    @cached_property
    def system(self) -> control.StateSpace:
        """The closed loop from the disturbances to the performance outputs."""
        return self.linear.to_control()

    @cached_property
    def linear(self) -> LinearSystem:
        """The same without python-control."""
        return self.plant.close(self.controller.linear)

    @cached_property
    def poles(self) -> ComplexArray:
        """Closed-loop poles in rad/s, by increasing magnitude."""
        values = np.linalg.eigvals(np.asarray(self.linear.A))
        return values[np.argsort(np.abs(values))].astype(complex)

    @property
    def stable(self) -> bool:
        """Whether every closed-loop pole is stable: by more than rounding, or as is proved."""
        return self.stable_by_poles or self._proved is True

    @property
    def undecided(self) -> str:
        """Why nobody knows whether the loop is stable; empty where it is known."""
        if self.stable_by_poles or not self._near_limit or self._proved is not None:
            return ""
        return f"a pole at {self.unstable_hz[0]:.4g} Hz is nearer to the limit than rounding"

    @property
    def fault(self) -> str:
        """What keeps the loop from being called stable; empty where it is."""
        if self.stable:
            return ""
        if self.undecided:
            return f"not proved to be stable: {self.undecided}"
        return f"unstable at {self.unstable_hz[0]:.4g} Hz"

    @property
    def loud_fault(self) -> str:
        """The same for a line of its own, its first words in capitals."""
        words = "not proved" if self.undecided else "unstable"
        return self.fault.replace(words, words.upper(), 1)

    @cached_property
    def stable_by_poles(self) -> bool:
        """The same as `poles` tell, which are of an approximation where there is dead time."""
        return bool(self.poles.real.max() < -self._rounding)

    @cached_property
    def _rounding(self) -> float:
        """How far from the axis a computed pole must be for its side to be known."""
        return stability_threshold(np.asarray(self.linear.A))

    @property
    def poles_known(self) -> bool:
        """Whether the poles of a stable loop are on their side by more than rounding."""
        return self.stable_by_poles

    @property
    def _near_limit(self) -> bool:
        """Whether no computed pole is unstable by more than rounding."""
        return bool(self.poles.real.max() <= self._rounding)

    @cached_property
    def _proved(self) -> bool | None:
        """What the intervals of the axis prove where computed poles cannot tell."""
        return proved_stability(self.factors) if self._near_limit else False

    @property
    def unstable_hz(self) -> tuple[float, ...]:
        """Frequencies of the poles that may not be stable, fastest growing first."""
        bad = self.poles[(self.poles.real >= -self._rounding) & (self.poles.imag >= 0)]
        bad = bad[np.argsort(-bad.real)]
        return tuple(float(abs(pole) / (2 * np.pi)) for pole in bad)

    @cached_property
    def return_ratio(self) -> control.StateSpace:
        """L = −K(s)G(s), the loop broken at the actuator; stability means 1 + L ≠ 0."""
        return self.opened.to_control()

    @cached_property
    def opened(self) -> LinearSystem:
        """L without python-control."""
        actuator, through = self.objective.actuator, series(self._path, self.controller.linear)
        return LinearSystem(
            through.A,
            through.B,
            -through.C,
            -through.D,
            self.controller.linear.dt,
            inputs=[actuator],
            outputs=[f"returned_{actuator}"],
            name="L",
        )

    @cached_property
    def tracking(self) -> control.StateSpace:
        """The closed loop from ``theta_ref`` (rad) to ``theta``, ``tip`` and the actuator.

        Raises
        ------
        UnstableLoopError
            If the loop is unstable.
        """
        self.require_stable("a response to the reference")
        controller = tracking_controller(self.controller, self.model)
        found = tracking_loop(self._path, controller, self.model, self.objective.actuator)
        return found.to_control()

    @property
    def _path(self) -> LinearSystem:
        """The plant from the actuator to the sensors, on the controller's clock."""
        return self.plant.path

    @property
    def nyquist_rad_s(self) -> float:
        """The highest frequency at which L says something: infinite for a continuous loop."""
        return np.inf

    @cached_property
    def open_poles(self) -> ComplexArray:
        """Poles of L in rad/s."""
        return np.linalg.eigvals(np.asarray(self.opened.A)).astype(complex)

    @cached_property
    def factors(self) -> FactoredLoop:
        """L as plant, controller and dead time, the arm's lags on the controller's side."""
        arm = bare_equations(self.model, self.objective.sensors, self.objective.actuator)
        if arm.nstates == self._path.nstates:  # no lags: the plant's modes are known already
            return factored(self._path, negated(self.controller.linear), self.late)
        controller = with_lags(self.controller.linear, self.model.arm)
        return factored(arm, negated(controller), self.late)

    @cached_property
    def margins(self) -> Margins:
        """Classical margins at the actuator.

        Raises
        ------
        UnstableLoopError
            An unstable loop has no margin.
        """
        self.require_stable("margins")
        return self.margins_at(0.0)

    def margins_at(self, skew: float) -> Margins:
        """Return the margins of a stable loop with this skew of the disk."""
        return classical_margins(self.opened, skew=skew, modes=self.modes, factors=self.factors)

    @cached_property
    def modes(self) -> Modes:
        """The modes by which frequencies of the loop are named."""
        pair = Pair(self.plant.path, self.controller.linear, 1)
        return modes_of_pair(pair, self.late, self.model.frequencies_hz)

    @cached_property
    def h2(self) -> H2Cost:
        """Squared H2 norm from w to z: the stationary mean of Σ z².

        Raises
        ------
        UnstableLoopError
            The cost of an unstable loop is infinite.
        AccuracyError
            If poles are known to rounding only; see `require_stable`.
        """
        self.require_stable("an H2 cost")
        return self.h2_by_poles

    @cached_property
    def h2_by_poles(self) -> H2Cost:
        """The same where `stable_by_poles` is known to hold, and nothing else is asked."""
        if np.any(np.asarray(self.linear.D)):
            return H2Cost(np.inf, 0.0)  # sensor noise passes straight to the actuator
        return cost_of_loop(*(np.asarray(getattr(self.linear, name)) for name in "ABC"))

    @cached_property
    def _undelayed_response(self) -> FrequencyResponse:
        """L without dead time, ready for any number of questions."""
        return FrequencyResponse(self.opened)

    def response(self, omega: Array) -> ComplexArray:
        """Return L at each ω in rad/s: L(jω), or L(e^(jωT)) of a sampled loop."""
        return self._undelayed_response(omega)

    def plot(self, kind: str = "bode", ax: Any = None) -> Any:
        """Draw the return ratio or the poles.

        Parameters
        ----------
        kind : {"bode", "nyquist", "nichols", "poles"}
            Bode and Nyquist with the margins marked; poles of the open and the closed loop.
        ax : matplotlib Axes, optional
            By default those of a new figure; a pair of them for Bode.

        Returns
        -------
        Axes, or an array of two

        Raises
        ------
        InputError
            For another kind, or one pair of axes too few.
        """
        return draw(self, kind, ax)

    def __repr__(self) -> str:
        return f"<{self.controller.method} loop on {self.model.arm.name}: {self.describe()}>"

    def _repr_html_(self) -> str:
        told = f"<p>{escape(self.describe())}</p>"
        with suppress(AccuracyError):
            return f"<div>{told}{self.margins._repr_html_()}</div>" if self.stable else told
        return told

    def describe(self) -> str:
        """Return one line: stable with its margins, or unstable and where."""
        if not self.stable:
            return f"{self.loud_fault} (an unstable loop has no margins)"
        try:
            return self._described()
        except AccuracyError as error:  # stable, but of its figures not all are known
            return f"stable; {error}"

    def _described(self) -> str:
        m = self.margins
        doubt = "" if m.confirmed else " (margins NOT confirmed)"
        doubt += "" if self.controller.certificate.verified else " (design NOT verified)"
        cost = f", H2 cost {self.h2.value:.4g}" if self.objective.weighted else ""
        return (
            f"stable{doubt}: gain margin {m.smaller_gain_db.value:.2f} dB, phase margin "
            f"{m.phase_deg.value:.1f} deg{cost}"
        )

    def require_stable(self, what: str) -> None:
        """Raise `UnstableLoopError` if the loop has not got `what` because it is unstable.

        Raises
        ------
        AccuracyError
            For all but margins, if the loop is stable as is proved but its computed poles are
            within rounding of the limit: what is computed from them would be rounding too.
        """
        if not self.stable:
            said = f"the loop is {self.fault}, and has not {what}"
            if not self.undecided and BrokenLoop(self.opened).stable_if_reversed:
                said += "; with the opposite sign of the feedback it is stable"
            raise UnstableLoopError(said, where="loop", remedy="ask loop.stable first")
        if what != "margins" and not self.poles_known:
            raise AccuracyError(
                f"the loop is proved to be stable, but of {what} nothing is known: a pole at "
                f"{self.unstable_hz[0]:.4g} Hz is nearer to the limit than rounding",
                where="loop",
                remedy="give modes some damping; margins do without poles",
            )
