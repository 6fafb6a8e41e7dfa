"""H2 control with bounds on standard deviations: of the actuator, the tip, a moment.

With the Kalman filter's estimate for the state its error Y is fixed, and every stationary
variance is linear in the covariance P of the estimate and in W ⪰ L P⁻¹ Lᵀ, L = KP:

    var(c x) = c (P + Y) cᵀ,    var(u) = K P Kᵀ ≤ W.

So the best controller under any such bounds is found exactly, not only bounded (output
covariance constraints: Zhu, Rotea and Skelton, SIAM J. Control and Optimization 35, 1997).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.achieved import closed_cost
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import with_clock
from slewctl.design.lmi.blocks import Block
from slewctl.design.lmi.separation_principle import Innovations, innovations
from slewctl.design.lmi.state_feedback import Feedback, Regulator, Unknowns, solve_regulator
from slewctl.design.observer import observer_feedback
from slewctl.design.result import Controller, Guarantee, finished
from slewctl.errors import DesignError, InputError, check_choice, check_given, check_positive, shown
from slewctl.numerics.h2_norm import h2_cost
from slewctl.plant import ACTUATORS, GeneralisedPlant, check_plant, signal

COST = "cost"
# The bounds are met to rounding, so there is no room for the usual floor.
_NOISE_FLOOR = 1e-11
_GAP = 1e-6  # of the cost to its lower bound, as far as a solver at 1e-8 closes it


@guarded
@with_clock
def variance_bound(
    plant: GeneralisedPlant, *, std_max: Mapping[str, float] | None = None, minimise: str = COST
) -> Controller:
    """Return the controller that minimises a mean square while others stay bounded.

    Parameters
    ----------
    plant : GeneralisedPlant
        With its objective.
    std_max : mapping of str to float
        Largest stationary standard deviation of signals, in their units: the actuator
        (``torque`` in N·m or ``voltage`` in V), and outputs among the objective's limits or
        sensors, such as ``tip`` in m.
    minimise : str
        ``"cost"`` for the objective's H2 cost, or a signal by name: with ``minimise = "tip"``
        and a bound on the torque the stillest tip that the actuator can buy, with
        ``minimise = "torque"`` and a bound on the tip the dual.

    Returns
    -------
    Controller
        A Kalman filter with the state feedback u = −K x̂.  The guarantees hold every bound
        against the deviation that a Lyapunov equation gives for the closed loop.

    Raises
    ------
    DesignError
        If the bounds cannot be met together, with what can be; or as `lqg`.
    InputError
        For a signal that the plant does not have, or nothing that keeps the actuator small.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.variance_bound(plant, std_max={"torque": 1.0})
    >>> K.certificate.verified
    True
    """
    check_plant(plant, "variance_bound")
    signals = _signals(plant)
    bounds = _bounds(check_given(std_max, "std_max", "a table such as { torque = 0.5 }"), signals)
    check_choice(minimise, [COST, *signals], "minimise")
    actuator = plant.actuator
    if minimise not in (COST, actuator) and actuator not in bounds:
        raise InputError(
            f"nothing keeps the {actuator} small",
            where="std_max",
            remedy=f"bound it, as in std_max.{actuator}, or minimise the cost",
        )
    both = innovations(plant)
    task = _Task(both, signals, bounds, minimise)
    K, feedback = both.regulator.optimal, Feedback()
    if minimise != COST or not task.kept(K):
        task.check_reachable()
        feedback = solve_regulator(task.problem(), K)
        if feedback.K is None:
            raise task.impossible(feedback.status)
        K = feedback.K
    gain, Kf = both.state_feedback(K), both.observer_gain(both.observer.optimal)
    system = observer_feedback(plant, gain, Kf, "variance_bound")
    reached = task.deviations(K)
    closed = plant.close(system)
    cost = closed_cost(plant, system).value
    return finished(
        plant,
        system,
        "variance-bound",
        {"state_feedback": gain, "observer": Kf},
        checks=feedback.checks,
        guarantees=(
            *(
                Guarantee(
                    f"standard deviation of {name}",
                    bounds[name],
                    value,
                    "at most",
                    _unit(plant, name),
                )
                for name, value in _loop_deviations(plant, closed.A, closed.B, system.C, signals)
                if name in bounds
            ),
            *task.promise(feedback, reached, cost),
        ),
        assumptions=(
            f"J/J* = {cost / both.optimum:.6g} achieved; J* is the optimum without the bounds",
            f"minimised: {minimise}"
            + (f" (solver: {feedback.status})" if feedback.K is not None else ""),
            "disturbances and noises are white, as the objective has them",
        ),
        seconds=feedback.seconds,
    )


def _signals(plant: GeneralisedPlant) -> dict[str, Array]:
    """Return the signals that can be bounded with their rows of the plant's states.

    The actuator's row is empty: it is no function of the state.
    """
    objective = plant.objective
    if objective is None:
        raise InputError(
            "the plant has no objective, so its signals have no units",
            where="variance_bound",
            remedy="make the plant with slewctl.generalised_plant(model, objective)",
        )
    if np.any(plant.D22):
        raise InputError(
            f"a sensor reads the {plant.actuator} without delay (D22)",
            where="variance_bound",
            remedy="use lqg or h2-lmi, which take that into account",
        )
    rows = {plant.actuator: np.zeros((1, 0))}
    outputs = list(plant.linear.output_labels)
    for name in objective.performance:
        check_choice(f"z_{name}", outputs, "variance_bound")
        row = np.asarray(plant.linear.C)[[outputs.index(f"z_{name}")]]
        rows[name] = row * objective.limits[name]
    for i, name in enumerate(plant.sensors):
        rows.setdefault(name, plant.C2[i : i + 1])
    return rows


def _bounds(given: object, signals: Mapping[str, Array]) -> dict[str, float]:
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            f"{shown(given)} is not a table of bounds",
            where="std_max",
            remedy="give one, as in {'torque': 0.5}",
        )
    for name in given:
        if name in ACTUATORS and name not in signals:
            raise InputError(
                f"the plant is not driven by its {name}",
                where=f"std_max.{name}",
                remedy=f"bound the {next(iter(signals))}",
            )
        check_choice(name, signals, "std_max")
    return {name: check_positive(value, f"std_max.{name}") for name, value in given.items()}


def _unit(plant: GeneralisedPlant, name: str) -> str:
    if name in ACTUATORS:
        return "N·m" if name == "torque" else "V"
    beam = plant.model.arm.beam if plant.model is not None else None
    return signal(name, beam=beam).unit


def _loop_deviations(
    plant: GeneralisedPlant, A: Array, B: Array, Ck: Array, signals: Mapping[str, Array]
) -> list[tuple[str, float]]:
    """Return the standard deviation of each signal in the closed loop [x, x̂]."""
    n = len(plant.A)
    found = []
    for name, row in signals.items():
        if row.size:
            C = np.hstack([row, np.zeros((1, n))])
        else:
            C = np.hstack([np.zeros((1, n)), np.asarray(Ck)])
        found.append((name, math.sqrt(h2_cost(np.asarray(A), np.asarray(B), C).value)))
    return found


@dataclass(frozen=True, eq=False)
class _Task:
    """What is bounded and what is minimised, in the scaled plant's coordinates."""

    both: Innovations
    signals: Mapping[str, Array]
    bounds: Mapping[str, float]
    minimise: str

    @property
    def actuator(self) -> str:
        return self.both.plant.actuator

    def row(self, name: str) -> Array:
        """Return the signal's row of scaled states; for the actuator as if x̂ were nought."""
        return self.signals[name] @ self.both.scaled.state

    def error(self, name: str) -> float:
        """Return what the estimation error alone makes of the signal's variance."""
        if name == self.actuator:
            return 0.0
        row = self.row(name)
        return float((self.both.scaled.rate * row @ self.both.observer.X @ row.T).item())

    def deviations(self, F: Array) -> dict[str, float]:
        """Return the standard deviations for a scaled gain on top of the preliminary one."""
        half, s = self.both.regulator, self.both.scaled
        closed = half.dynamics.A - half.dynamics.B @ F
        found = {}
        for name in self.signals:
            driven = name == self.actuator
            C = s.control_unit @ (half.preliminary + F) if driven else self.row(name)
            value = s.rate * h2_cost(closed, half.dynamics.N, C).value
            found[name] = math.sqrt(value + self.error(name))
        return found

    def kept(self, F: Array) -> bool:
        found = self.deviations(F)
        return all(found[name] <= bound for name, bound in self.bounds.items())

    def check_reachable(self) -> None:
        """Refuse a bound below what the estimation error makes whatever the control."""
        for name, bound in self.bounds.items():
            least = math.sqrt(self.error(name))
            if bound <= least:
                raise DesignError(
                    f"a standard deviation of {bound:g} is below the {least:.4g} that the "
                    "estimation error alone makes",
                    where=f"std_max.{name}",
                    remedy="raise it, or give better sensors",
                )

    def problem(self) -> Regulator:
        """Return the inequalities' problem."""
        half = self.both.regulator
        C, weight = half.C, 1.0
        if self.minimise == self.actuator:
            C = np.zeros((1, len(half.dynamics.A)))
        elif self.minimise != COST:
            C, weight = self.row(self.minimise), 0.0
        return Regulator((half.dynamics,), C, weight, self.blocks, _NOISE_FLOOR, _GAP)

    def blocks(self, unknowns: Unknowns) -> Sequence[Block]:
        """Return one scalar inequality a bound, relative to it."""
        s = self.both.scaled
        found = []
        for name, bound in self.bounds.items():
            room = (bound**2 - self.error(name)) / s.rate
            if name == self.actuator:
                unit = float(np.linalg.norm(s.control_unit))
                used = unit**2 * unknowns.control_variance
            else:
                used = unknowns.variance(self.row(name))
            found.append(Block(f"variance of {name}", _one(1 - used / room)))
        return found

    def promise(
        self, feedback: Feedback, reached: Mapping[str, float], cost: float
    ) -> list[Guarantee]:
        """Return the bound on what was minimised."""
        if feedback.K is None:
            return [Guarantee("H2 cost", self.both.optimum, cost, "at most")]
        rate = self.both.scaled.rate
        if self.minimise == COST:
            bound = self.both.unavoidable + rate * feedback.bound
            return [Guarantee("H2 cost", bound, cost, "at most")]
        unit = float(np.linalg.norm(self.both.scaled.control_unit))
        scale = unit**2 if self.minimise == self.actuator else 1.0
        bound = math.sqrt(rate * scale * feedback.bound + self.error(self.minimise))
        name = f"least standard deviation of {self.minimise}"
        return [Guarantee(name, bound, reached[self.minimise], "at most",
                          _unit(self.both.plant, self.minimise))]  # fmt: skip

    def impossible(self, status: str) -> DesignError:
        """Return the error that says which bound to raise, and how far, the others kept."""
        advice = []
        for name in self.bounds:
            others = {key: value for key, value in self.bounds.items() if key != name}
            if self.actuator not in others and (name != self.actuator or not others):
                continue  # alone, the actuator's has no least value: it falls towards zero
            task = _Task(self.both, self.signals, others, name)
            found = solve_regulator(task.problem(), self.both.regulator.optimal)
            if found.K is not None:
                least = task.deviations(found.K)[name]
                advice.append(f"std_max.{name} = {least * 1.005:.3g}")
        wishes = " and ".join(f"{name} within {bound:g}" for name, bound in self.bounds.items())
        return DesignError(
            f"no controller was found that keeps the standard deviations of {wishes} "
            f"(solver: {status})",
            where="std_max",
            remedy=(
                f"possible with the others kept: {', or '.join(advice)}"
                if advice
                else "raise it"
                if len(self.bounds) == 1
                else "raise more than one of them"
            ),
        )


def _one(scalar: object) -> object:
    """Return a scalar expression as a matrix of one entry."""
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    return cp.reshape(scalar, (1, 1), order="C")
