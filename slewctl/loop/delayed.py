"""A continuous controller around an arm with dead time: exact where that decides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.loop.closed import Loop
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.dead_time import ORDER


@dataclass(frozen=True, eq=False, repr=False)
class DelayedLoop(Loop):
    """A continuous controller closed around a model of an arm with dead time.

    `stable`, `margins` and `response` are those of the loop with e^(−sT) itself.  What needs
    a state space, as poles, H2 cost, slews, noise levels and peaks, is of the all-pass Padé
    approximation that `plant` holds (see `slewctl.plant.dead_time`); where that is not stable
    although the loop is, it is refused.

    Parameters
    ----------
    model, objective, controller
        As for `Loop`.
    """

    @property
    def late(self) -> float:
        """T in s, of actuator and sensors together."""
        return self.plant.dead_time

    @property
    def exact_dead_time(self) -> float:
        return self.late

    @cached_property
    def undelayed(self) -> LinearSystem:
        """L without the dead time."""
        through = series(self.plant.exact.path, self.controller.linear)
        actuator = self.objective.actuator
        return LinearSystem(
            through.A,
            through.B,
            -through.C,
            -through.D,
            inputs=[actuator],
            outputs=[f"returned_{actuator}"],
            name="L",
        )

    @cached_property
    def _certified(self) -> Margins | SlewctlError:
        """Margins, which are there if the loop is stable, or why there are none."""
        try:
            return self.margins_at(0.0)
        except (UnstableLoopError, AccuracyError) as error:
            return error

    def margins_at(self, skew: float) -> Margins:
        return classical_margins(self.undelayed, skew=skew, modes=self.modes, factors=self.factors)

    @property
    def stable(self) -> bool:
        """Whether the loop with its exact dead time is proved to be stable."""
        return isinstance(self._certified, Margins)

    @property
    def poles_known(self) -> bool:
        """Padé's are no poles of this loop; see `require_stable`."""
        return True

    @property
    def undecided(self) -> str:
        """Why nobody knows whether the loop is stable; empty where it is known."""
        found = self._certified
        return found.what if isinstance(found, AccuracyError) else ""

    @property
    def unstable_hz(self) -> tuple[float, ...]:
        """Frequencies of the approximation's poles that are not stable, or of the least stable."""
        found = super().unstable_hz
        least = self.poles[np.argmax(self.poles.real)]
        return found or (float(abs(least) / (2 * np.pi)),)

    @cached_property
    def margins(self) -> Margins:
        self.require_stable("margins")
        found = self._certified
        return found if isinstance(found, Margins) else self.margins_at(0.0)

    @cached_property
    def _undelayed_response(self) -> FrequencyResponse:
        return FrequencyResponse(self.undelayed)

    def response(self, omega: Array) -> ComplexArray:
        """Return L at each ω in rad/s, its dead time exact."""
        lag = np.exp(-1j * np.asarray(omega) * self.late)
        return np.asarray(self._undelayed_response(omega) * lag)

    def require_stable(self, what: str) -> None:
        """Raise `UnstableLoopError` if the loop is not, `AccuracyError` if Padé's alone is not."""
        super().require_stable(what)
        if what != "margins" and self.poles.real.max() >= 0:
            raise AccuracyError(
                f"the loop with its dead time of {self.late:g} s is stable, but not with the Padé "
                f"approximation of order {ORDER} from which {what} would be computed",
                where="arm.actuator.delay",
                remedy="margins and stability are exact; design a loop that stands more delay",
            )
