"""A controller on the truth: one result, from which everything told of a design is read.

Stability is decided first.  What only a stable loop has is computed when it is asked for,
and not before; `slewctl.compare.quantities` lists what can be read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from slewctl import loop as loops
from slewctl._types import Array, ComplexArray
from slewctl.compare.case import MOST_TRUTH_MODES
from slewctl.design import Controller, lqg
from slewctl.design.riccati.lqg import LeastCost, least_cost
from slewctl.errors import AccuracyError
from slewctl.loop import Loop, Margins, Slew, close
from slewctl.loop.noise import NoiseLevels, noise_levels
from slewctl.model import Truth, truth
from slewctl.model.large_deflection import LargeDeflectionError
from slewctl.plant import GeneralisedPlant, Objective, generalised_plant

if TYPE_CHECKING:
    from slewctl.loop import SlewResponse

# Verdicts are followed over truths of twice the modes up to this many.
MOST_MODES = 2 * MOST_TRUTH_MODES
# Times at which a slew is drawn; its measures do not depend on them.
_SLEW_POINTS = 201


@dataclass(frozen=True, eq=False)
class Yardstick:
    """A truth of an arm, and the least cost that any controller reaches on it.

    Parameters
    ----------
    model : Truth
    objective : Objective
    """

    model: Truth
    objective: Objective
    _optima: dict[tuple[float, float], Controller] = field(default_factory=dict, repr=False)
    _least: dict[tuple[float, float], LeastCost] = field(default_factory=dict, repr=False)

    @property
    def modes(self) -> int:
        """Flexible modes of the truth."""
        return self.model.modes

    @cached_property
    def plant(self) -> GeneralisedPlant:
        """The generalised plant of the objective on the truth."""
        return generalised_plant(self.model, self.objective)

    def optimum(self, sample_time: float = 0.0, delay: float = 0.0) -> Controller:
        """Return the H2-optimal controller for the truth itself.

        Parameters
        ----------
        sample_time, delay : float
            In s: a sampled controller is compared with the best that has its clock and delay.
            Zero for continuous ones.
        """
        key = (sample_time, delay)
        if key not in self._optima:
            clock = {"sample_time": sample_time, "delay": delay} if sample_time else {}
            self._optima[key] = lqg(self.plant, **clock)
        return self._optima[key]

    def least_cost(
        self, sample_time: float = 0.0, delay: float = 0.0, below: Yardstick | None = None
    ) -> float:
        """Return the optimum's cost, unconfirmed where the optimum itself is not known yet.

        Parameters
        ----------
        sample_time, delay : float
            As for `optimum`.
        below : Yardstick, optional
            Of fewer modes: what is known of its optimum is begun with.
        """
        key = (sample_time, delay)
        if key in self._optima:
            return self._optima[key].h2_cost
        if key not in self._least:
            self._least[key] = least_cost(
                self.plant, *key, below._least.get(key) if below else None
            )
        return self._least[key].value

    @cached_property
    def finer(self) -> Yardstick | None:
        """The same arm's truth of twice the modes; None beyond `MOST_MODES`, or those given."""
        modes = 2 * self.modes
        if modes > MOST_MODES or self.model.complete:
            return None
        return yardstick(truth(self.model.arm, modes), self.objective)

    def judge(self, controller: Controller, slew: Slew) -> Judgement:
        """Return what a controller achieves on the truth."""
        loop = replace(close(self.model, self.objective, controller), source=self)
        return Judgement(loop, self, shaped_for(slew, loop))


def yardstick(model: Truth, objective: Objective) -> Yardstick:
    """Return a truth with its optimum; of the same truth and objective, the same again.

    Parameters
    ----------
    model : Truth
    objective : Objective
    """
    limits, noise = tuple(objective.limits.items()), tuple(objective.noise.items())
    return _yardstick(model, limits, noise, objective.weighted)


# Two objectives are one where their signals stand in the same order, too.
@lru_cache(maxsize=64)
def _yardstick(
    model: Truth,
    limits: tuple[tuple[str, float], ...],
    noise: tuple[tuple[str, float], ...],
    weighted: bool,
) -> Yardstick:
    return Yardstick(model, Objective(dict(limits), dict(noise), weighted))


def shaped_for(slew: Slew, loop: Loop) -> Slew:
    """Return a slew with its shaper made for a loop; an unstable one has no slew.

    Parameters
    ----------
    slew : Slew
    loop : Loop

    Raises
    ------
    InputError
        For conditions that the loop does not have, or a shaper that cannot be made.
    """
    slew.conditions.require(loop)
    return loops.shaped(slew, loop) if isinstance(slew.shaper, str) and loop.stable else slew


@dataclass(frozen=True, eq=False)
class Judgement:
    """What a controller achieves on the truth.

    Attributes
    ----------
    loop : Loop
        Of the controller and the truth.
    yardstick : Yardstick
        The truth with its optimum.
    slew : Slew
        The turn that is simulated, its shaper made.
    at_once : bool
        Whether the cost of the `optimum` is told without what confirms it, for a first look.
    """

    loop: Loop
    yardstick: Yardstick
    slew: Slew
    at_once: bool = False
    # What `slewctl.compare.read` has read of it, by name: verdicts and reports ask alike.
    _read: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    @property
    def controller(self) -> Controller:
        """What is judged."""
        return self.loop.controller

    @property
    def modes(self) -> int:
        """Flexible modes of the truth."""
        return self.yardstick.modes

    @property
    def stable(self) -> bool:
        """Whether the loop is stable; all below needs it, but for the poles."""
        return self.loop.stable

    @property
    def unstable_hz(self) -> tuple[float, ...]:
        """Frequencies of the poles that are not stable, fastest growing first."""
        return () if self.stable else self.loop.unstable_hz

    @property
    def poles(self) -> ComplexArray:
        """Closed-loop poles in rad/s."""
        return self.loop.poles

    @property
    def margins(self) -> Margins:
        """Margins at the actuator."""
        return self.loop.margins

    @cached_property
    def optimum(self) -> Controller:
        """The best controller with the same clock and delay, on the same truth."""
        return self.yardstick.optimum(*self.clock)

    @property
    def clock(self) -> tuple[float, float]:
        """Sample time and delay in s of what is judged, both zero of a continuous controller."""
        sampled = self.controller.sample_time
        return sampled, self.controller.delay if sampled else 0.0

    @cached_property
    def continuous(self) -> Judgement | None:
        """The continuous law that a sampled one was made of, on the same truth."""
        law = self.controller.continuous
        return None if law is None else self.yardstick.judge(law, self.slew)

    @property
    def cost(self) -> float:
        """Squared H2 norm."""
        return self.loop.h2.value

    @property
    def loss(self) -> float:
        """Cost over that of the `optimum`, less one."""
        own = self.yardstick
        least = own.least_cost(*self.clock) if self.at_once else self.optimum.h2_cost
        return self.cost / least - 1

    @cached_property
    def response(self) -> SlewResponse:
        """The slew: exact and as if there were no limits, or under its conditions."""
        if not self.slew.exact:
            return loops.simulate(self.loop, self.slew)
        return loops.simulate_slew(self.loop, self.slew, _SLEW_POINTS)

    @cached_property
    def moved(self) -> SlewResponse | None:
        """The slew; None of an unstable loop, and where nothing is known of its extremes."""
        try:
            return self.response if self.stable else None
        except (AccuracyError, LargeDeflectionError):
            return None

    @cached_property
    def saturation(self) -> str:
        """What the slew needs and motor or actuator have not; empty within their limits."""
        summary, arm = self.response.summary, self.loop.model.arm
        if self.slew.conditions.saturate:
            return ""
        beyond = arm.exceeded(summary.peak_torque, summary.peak_voltage)
        told = "; ".join(f"the slew needs {what}" for what in beyond)
        return f"{told}{loops.told_time(self.loop, self.slew)}" if beyond else ""

    @cached_property
    def noise(self) -> NoiseLevels:
        """Levels of tip, torque and voltage under the objective's noise."""
        return noise_levels(self.loop)

    @cached_property
    def finer(self) -> Judgement | None:
        """The same controller on a truth of twice the modes; None beyond `MOST_MODES`."""
        finer = self.yardstick.finer
        return None if finer is None else finer.judge(self.controller, self.slew)

    def ladder(self) -> Iterator[Judgement]:
        """Yield this judgement, then that on twice the modes, and so on to `MOST_MODES`."""
        judged: Judgement | None = self
        while judged is not None:
            yield judged
            judged = judged.finer

    def smallest(self, values: Array) -> tuple[float, float]:
        """Return the smallest of one value per pole, and that pole's frequency in Hz."""
        k = int(np.argmin(values))
        return float(values[k]), float(np.abs(self.poles[k]) / (2 * np.pi))
