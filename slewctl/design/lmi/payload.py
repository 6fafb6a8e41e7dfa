"""One controller for every payload and stiffness in a range.

With the functions kept, a tip mass that differs by μ from the model's changes the mass matrix
by the rank-one μ ccᵀ, c the tip's displacement row, and (Sherman and Morrison)

    M⁻¹ = M₀⁻¹ − δ M₀⁻¹ccᵀM₀⁻¹,    δ = μ / (1 + μ cᵀM₀⁻¹c),

so A and B are exactly affine in δ and two vertices cover the whole interval.  A factor on the
stiffness multiplies K_e, and the damping in proportion to it: four vertices.  One Lyapunov
matrix for all vertices is one for everything between them, however fast it may change
(Boyd, El Ghaoui, Feron and Balakrishnan 1994, section 5.1).

That holds for the state feedback.  The observer knows one payload only, so the loop with the
observer is verified afterwards, on assembled models of the changed arms.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.design.achieved import closed_cost
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import with_clock
from slewctl.design.lmi.blocks import largest
from slewctl.design.lmi.payload_loop import Worst, best_observer, changed_plant
from slewctl.design.lmi.region import Region
from slewctl.design.lmi.separation_principle import Innovations, innovations
from slewctl.design.lmi.state_feedback import Dynamics, Feedback, Regulator, solve_regulator
from slewctl.design.observer import observer_feedback
from slewctl.design.result import Check, Controller, Guarantee, finished
from slewctl.errors import (
    DesignError,
    InputError,
    check_each,
    check_given,
    check_nonnegative,
    check_number,
    shown,
)
from slewctl.model import Model
from slewctl.numerics.h2_norm import h2_cost
from slewctl.plant import GeneralisedPlant, check_plant, generalised_plant
from slewctl.plant.readings import refuse_lags
from slewctl.plant.statespace import drive

# At the edge of what is possible a solver does not reach its accuracy: a range is advised
# that is this much narrower.
_INSIDE = 0.9
_COARSE = 1e-5  # of the solver, where only whether a range can be met is asked
# Masses at which the loop with the observer is verified, and stiffness factors if they vary.
_MASSES, _FACTORS = 51, 5


@dataclass(frozen=True)
class Range:
    """What the payload's mass in kg and the factor on the stiffness may be."""

    mass: tuple[float, float]
    stiffness: tuple[float, float] = (1.0, 1.0)

    @property
    def vertices(self) -> list[tuple[float, float]]:
        """Corners as pairs of mass and factor, each once."""
        return list(itertools.product(sorted(set(self.mass)), sorted(set(self.stiffness))))

    @property
    def samples(self) -> list[tuple[float, float]]:
        """Pairs of mass and factor over the whole range."""
        low, high = self.stiffness
        factors = [1.0] if low == high == 1 else list(np.linspace(low, high, _FACTORS))
        return list(itertools.product(np.linspace(*self.mass, _MASSES), factors))

    def shrunk(self, share: float, mass: float) -> Range:
        """Return the range with its ends drawn towards the model's own payload."""
        ends = [mass + share * (end - mass) for end in self.mass]
        factors = [1 + share * (end - 1) for end in self.stiffness]
        return Range((ends[0], ends[1]), (factors[0], factors[1]))


def changed_dynamics(
    model: Model, actuator: str, mass: float, factor: float
) -> tuple[Array, Array]:
    """Return A and B of [x, ẋ], x = [θ, q], for another payload and another EI.

    The damping stays, but for what is in proportion to mass or stiffness.

    Parameters
    ----------
    model : Model
    actuator : {"torque", "voltage"}
    mass : float
        Of the payload, in kg.
    factor : float
        On the beam's bending stiffness.
    """
    arm = model.arm
    gain, drag = drive(arm, actuator)
    alpha, beta = arm.damping.coefficients if arm.damping is not None else (0.0, 0.0)
    c = model.displacement(np.array([arm.beam.length]))[0]
    bending = model.stiffness.copy()
    if arm.joint is not None:  # its spring is none of the beam's
        twist = model.basis.twist
        bending[1:, 1:] -= arm.joint.stiffness * np.outer(twist, twist)
    added = mass - arm.payload.mass
    U = model.mode_shapes
    spread = U @ (U.T @ c)  # M₀⁻¹c, M₀⁻¹ = UUᵀ
    delta = added / (1 + added * float(c @ spread))

    def accelerated(force: Array) -> Array:
        """Return M⁻¹ times forces."""
        return U @ (U.T @ force) - delta * np.multiply.outer(spread, spread @ force)

    damping = (
        model.damping
        + drag * np.outer(model.input, model.input)
        + beta * (factor - 1) * bending
        + alpha * added * np.outer(c, c)
    )
    size = len(U)
    A = np.block(
        [
            [np.zeros((size, size)), np.eye(size)],
            [-accelerated(model.stiffness + (factor - 1) * bending), -accelerated(damping)],
        ]
    )
    B = np.concatenate([np.zeros(size), gain * accelerated(model.input)])[:, None]
    return A, B


@guarded
@with_clock
def payload_lmi(
    plant: GeneralisedPlant,
    *,
    payload_mass: Sequence[float] | None = None,
    stiffness: Sequence[float] = (1.0, 1.0),
    decay_rate_min: float = 0.0,
) -> Controller:
    """Return one controller for a range of payload masses and of stiffness.

    Parameters
    ----------
    plant : GeneralisedPlant
        With its model and objective; the model's own payload is the nominal one.
    payload_mass : sequence of float
        Least and largest mass at the tip, in kg.
    stiffness : sequence of float
        Least and largest factor on EI.
    decay_rate_min : float
        Decay rate in 1/s that the state feedback keeps over the whole range.

    Returns
    -------
    Controller
        The state feedback comes from one Lyapunov matrix for all vertices and minimises
        the bound on its cost.  The observer is a Kalman filter for the nominal arm; it
        believes in as much torque noise as makes the worst cost over the range least.  The
        certificate says at how many changed arms the loop was closed and found stable.

    Raises
    ------
    DesignError
        If no such gain was found, with the range that is possible; or as `lqg`.
    InputError
        For a plant without model or an impossible range.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.payload_lmi(plant, payload_mass=[0.0, 0.1])
    >>> K.certificate.verified
    True
    """
    check_plant(plant, "payload_lmi")
    if plant.model is None or plant.objective is None:
        raise InputError(
            "the plant does not know its arm",
            where="payload_lmi",
            remedy="make it with slewctl.generalised_plant(model, objective)",
        )
    refuse_lags(plant.model.arm, "payload_lmi")
    masses = check_given(payload_mass, "payload_mass", "the range in kg, such as [0.0, 0.1]")
    wanted = Range(
        _interval(masses, "payload_mass"), _interval(stiffness, "stiffness", positive=True)
    )
    decay = check_nonnegative(decay_rate_min, "decay_rate_min")
    nominal = generalised_plant(plant.model, plant.objective)
    both = innovations(nominal)
    task = _Task(both, plant.model, decay)
    feedback = task.solve(wanted)
    if feedback.K is None or not task.holds(feedback.K, wanted):
        raise task.impossible(wanted, feedback.status)
    K = both.state_feedback(feedback.K)
    changed = {at: changed_plant(nominal, *at) for at in wanted.samples}
    Kf, recovery, worst = best_observer(nominal, K, changed)
    system = observer_feedback(nominal, K, Kf, "payload_lmi")
    return finished(
        plant,
        system,
        "payload-lmi",
        {"state_feedback": K, "observer": Kf},
        checks=(
            *feedback.checks,
            worst.check(len(changed)),
            _same_plant(closed_cost(nominal, system).value, closed_cost(plant, system).value),
        ),
        guarantees=task.promises(feedback, wanted),
        assumptions=_words(both, worst, recovery, len(changed)),
        seconds=feedback.seconds,
    )


def _same_plant(of_its_arm: float, as_given: float) -> Check:
    """Return the check that a plant is that of its arm, on which the range was designed."""
    return Check(
        "cost on the plant as given against its arm's",
        0.0 if as_given == of_its_arm else abs(as_given / of_its_arm - 1),
        1e-6,
        "make the plant with slewctl.generalised_plant(model, objective) and leave it so",
    )


def _interval(given: object, name: str, *, positive: bool = False) -> tuple[float, float]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise InputError(
            f"{shown(given)} is not an interval", where=name, remedy="give [least, largest]"
        )
    low, high = check_each(given, name, check_number)
    if not low <= high or low < 0 or (positive and low == 0):
        raise InputError(
            f"{shown(given)} is not an interval of {'positive' if positive else 'possible'} values",
            where=name,
            remedy="give [least, largest]",
        )
    return low, high


@dataclass(frozen=True, eq=False)
class _Task:
    """The state feedback over a range, in the nominal plant's scaled coordinates."""

    both: Innovations
    model: Model
    decay: float

    def dynamics(self, mass: float, factor: float) -> Dynamics:
        """Return the scaled dynamics of a changed arm, driven by the nominal innovations."""
        s, half = self.both.scaled, self.both.regulator
        A, B = changed_dynamics(self.model, self.both.plant.actuator, mass, factor)
        # x = [θ, q, …] = diag(U, U) T ξ with the plant's modal states T ξ.
        T = block_diag(self.model.mode_shapes, self.model.mode_shapes) @ s.state
        inner = np.linalg.solve(T, np.hstack([A @ T, B @ s.control_unit])) / s.rate
        A, B = np.asarray(inner[:, :-1], dtype=float), np.asarray(inner[:, -1:], dtype=float)
        return Dynamics(A - B @ half.preliminary, B, half.dynamics.N)

    def solve(self, wanted: Range, tolerance: float | None = None) -> Feedback:
        region = Region(self.decay / self.both.scaled.rate)
        half = self.both.regulator
        problem = Regulator(
            tuple(self.dynamics(*at) for at in wanted.vertices),
            half.C,
            blocks=region.blocks,
            nominal=half.dynamics,
        )
        if tolerance is None:
            return solve_regulator(problem, half.optimal)
        return solve_regulator(problem, half.optimal, tolerance=tolerance)

    def slowest(self, F: Array, wanted: Range) -> float:
        """Return the least decay rate of the state feedback at the vertices, in 1/s."""
        rates = []
        for at in wanted.vertices:
            vertex = self.dynamics(*at)
            rates.append(-np.linalg.eigvals(vertex.A - vertex.B @ F).real.max())
        return self.both.scaled.rate * float(min(rates))

    def holds(self, F: Array, wanted: Range) -> bool:
        return self.slowest(F, wanted) > self.decay * (1 - 1e-6)

    def promises(self, feedback: Feedback, wanted: Range) -> list[Guarantee]:
        """Return what one Lyapunov matrix promises, beside what the vertices achieve."""
        F, rate = feedback.K, self.both.scaled.rate
        if F is None:
            return []
        C = np.vstack([self.both.regulator.C, F])
        costs = []
        for at in wanted.vertices:
            vertex = self.dynamics(*at)
            costs.append(h2_cost(vertex.A - vertex.B @ F, vertex.N, C).value)
        kept = [
            Guarantee(
                "cost of the state feedback over the range",
                rate * feedback.bound,
                rate * max(costs),
                "at most",
            )
        ]
        if self.decay > 0:
            slowest = self.slowest(F, wanted)
            kept.append(
                Guarantee("decay rate of the state feedback over the range", self.decay, slowest,
                          "at least", "1/s")
            )  # fmt: skip
        return kept

    def impossible(self, wanted: Range, status: str) -> DesignError:
        """Return the error that says how wide a range, or what decay rate, is possible."""
        own = self.model.arm.payload.mass

        def possible(task: _Task, wanted: Range) -> bool:
            found = task.solve(wanted, _COARSE)
            return found.K is not None and task.holds(found.K, wanted)

        advice = []
        share = _searched(lambda share: possible(self, wanted.shrunk(share, own)), 0.01, 1.0)
        if share is not None:
            near = wanted.shrunk(_INSIDE * share, own)
            advice.append(
                f"payload_mass = [{near.mass[0]:.4g}, {near.mass[1]:.4g}]"
                + (
                    f" with stiffness = [{near.stiffness[0]:.4g}, {near.stiffness[1]:.4g}]"
                    if near.stiffness != (1.0, 1.0)
                    else ""
                )
            )
        if self.decay > 0:
            decay = _searched(
                lambda value: possible(_Task(self.both, self.model, value), wanted),
                1e-2 * self.decay,
                self.decay,
            )
            advice += [f"decay_rate_min = {decay:.2g}"] if decay is not None else []
        return DesignError(
            f"no one gain was found for payload_mass = {list(wanted.mass)} kg"
            + (f", stiffness = {list(wanted.stiffness)}" if wanted.stiffness != (1, 1) else "")
            + (f" and decay_rate_min = {self.decay:g} 1/s" if self.decay else "")
            + f" (solver: {status})",
            where="payload_mass",
            remedy=(
                f"possible with the others kept: {', or '.join(advice)}"
                if advice
                else "take a model whose own payload lies within the range"
            ),
        )


def _searched(possible: Callable[[float], bool], least: float, most: float) -> float | None:
    return largest(possible, least, most) if possible(least) else None


def _words(both: Innovations, worst: Worst, recovery: float, count: int) -> tuple[str, ...]:
    return (
        f"worst J/J* = {worst.cost / both.optimum:.6g} over {count} changed arms, with the "
        "observer; J* is the optimum for the nominal arm",
        "the inequalities are for the state feedback; with the observer, which knows the nominal "
        f"payload only, the loop was closed around {count} assembled models of the changed arms, "
        "in the same functions, and nothing between them is proved",
        f"the observer believes in {recovery:g} times the torque noise",
        "in the inequalities the modal damping is held as for the nominal arm; the changed arms "
        "that verify the loop have their own",
    )
