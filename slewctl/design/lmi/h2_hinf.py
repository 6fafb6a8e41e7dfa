"""H2 control with a bound on spillover: the controller's gain at high frequency.

A truth that differs from the design model by stable neglected modes Δ, added between actuator
and sensors, stays stable if |Δ| |W⁻¹| ‖W K S‖∞ < 1 at every frequency, where K S is what the
loop makes of a sensor's error and W = s/(s + ω_c) leaves what lies above ω_c.  So a bound

    ‖W K S‖∞ ≤ γ    admits every stable Δ with |Δ(jω)| < |W(jω)| / γ.

The controller comes from one matrix inequality for both norms, whose Lyapunov matrices may
differ by a factor; it is of the plant's order and one more, for the state of W.  Since one
Lyapunov matrix serves both, the norm that is reached lies below the one asked of the
inequality; so a larger one is asked until the recomputed norm comes close to γ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.design.achieved import closed_cost
from slewctl.design.breakdown import check_finite, guarded
from slewctl.design.clocked import with_clock
from slewctl.design.lmi.blocks import largest
from slewctl.design.lmi.output_feedback import Channel, OutputFeedback, OutputProblem, solve_output
from slewctl.design.lmi.separation_principle import Innovations, innovations
from slewctl.design.lmi.state_feedback import NOISE_FLOOR, Dynamics, covariance
from slewctl.design.observer import observer_feedback
from slewctl.design.result import Controller, Guarantee, finished
from slewctl.errors import DesignError, check_given, check_positive
from slewctl.numerics.hinf_norm import peak_gain
from slewctl.numerics.interconnect import behind_feedthrough
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, check_plant, signal

# Of the solver, relative: the first while bounds are compared, the second for the result.
_COARSE = 1e-5
_TOLERANCE = 1e-7
# The recomputed norm is this close to the bound, or the rounds are over.
_CLOSE = 0.97
_ROUNDS = 4  # each brings the norm nearer to its bound; a safeguard
_STEPS = 8  # of the search for a bound that can be met
# How much faster the norm asked for rises than the norm reached; found by trial.
_RISE = 1.3
# Of the weight's state the controller knows all: in place of no error, a small one.
_KNOWN = 1e-3


@dataclass(frozen=True, eq=False)
class _Channel:
    """W and the units of ‖W K S‖: sensors by their noise, all in the first one's unit."""

    corner: float  # rad/s
    weights: Array  # sensor error per unit noise, over the first sensor's: shape (sensors,)
    unit: str


@guarded
@with_clock
def h2_hinf(
    plant: GeneralisedPlant, *, hinf_max: float | None = None, weight_hz: float | None = None
) -> Controller:
    """Return an H2 controller with bounded gain from the sensors above a frequency.

    Parameters
    ----------
    plant : GeneralisedPlant
    hinf_max : float
        γ, the bound on ‖W K S‖∞ from the sensors' error to the actuator, in the actuator's
        unit per unit of the first sensor (N·m/rad from ``theta``).  Further sensors count
        by their noise: an error as large as their noise is to the first one's.
    weight_hz : float
        Corner of W = s/(s + 2π weight_hz), in Hz.

    Returns
    -------
    Controller
        The LQG design where that keeps the bound; otherwise the cheapest, by recomputed
        cost, of the controllers that the matrix inequalities gave and that keep it.

    Raises
    ------
    DesignError
        If no such controller was found, with the least bound and the corner that are
        possible; or as `lqg`.
    InputError
        If an option is not positive.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.h2_hinf(plant, hinf_max=100.0, weight_hz=5.0)
    >>> K.certificate.verified
    True
    """
    check_plant(plant, "h2_hinf")
    gamma = check_positive(
        check_given(hinf_max, "hinf_max", "the largest gain from the sensors to the actuator"),
        "hinf_max",
    )
    hertz = check_given(weight_hz, "weight_hz", "the frequency in Hz above which it holds")
    corner = 2 * math.pi * check_positive(hertz, "weight_hz")
    both = innovations(plant)
    channel = _channel(plant, corner)
    found = _optimum(both, channel)
    if found.norm > gamma:
        found = _best(both, channel, gamma, found.norm)
    return finished(
        plant,
        found.system,
        "h2-hinf",
        found.gains,
        checks=found.feedback.checks,
        guarantees=(
            Guarantee("gain from the sensors, weighted", gamma, found.norm, "at most",
                      channel.unit),
            Guarantee("H2 cost", found.bound, found.cost, "at most"),
        ),
        assumptions=_words(found, both.optimum),
        seconds=found.seconds,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A controller with its bound, and its norm and cost recomputed from the closed loop."""

    system: LinearSystem
    gains: dict[str, Array]
    feedback: OutputFeedback
    bound: float
    norm: float
    cost: float
    seconds: dict[str, float]

    def keeps(self, gamma: float) -> bool:
        """Whether the norm is within the bound and the inequalities are sound."""
        return self.norm <= gamma and self.cost <= self.bound and self.feedback.sound


def _recomputed(
    plant: GeneralisedPlant,
    system: LinearSystem,
    gains: dict[str, Array],
    feedback: OutputFeedback,
    bound: float,
    channel: _Channel,
    seconds: dict[str, float],
) -> _Candidate:
    norm, cost = spillover_gain(plant, system, channel), closed_cost(plant, system).value
    return _Candidate(system, gains, feedback, bound, norm, cost, seconds)


def _optimum(both: Innovations, channel: _Channel) -> _Candidate:
    """Return the LQG design."""
    K = both.state_feedback(both.regulator.optimal)
    Kf = both.observer_gain(both.observer.optimal)
    system = observer_feedback(both.plant, K, Kf, "h2_hinf")
    gains = {"state_feedback": K, "observer": Kf}
    return _recomputed(both.plant, system, gains, OutputFeedback(), both.optimum, channel, {})


def _best(both: Innovations, channel: _Channel, gamma: float, easy: float) -> _Candidate:
    """Return the cheapest candidate that keeps the bound, or raise what is possible.

    `easy` is the LQG design's norm.
    """
    spent = {"build": 0.0, "solve": 0.0}
    first, least = _reached(both, channel, gamma, easy, spent)
    if least > gamma:
        raise _impossible(both, channel, gamma, easy, least, first.status)
    best, found, asked = None, first, gamma
    for _ in range(_ROUNDS):
        candidate = _recomputed(
            both.plant,
            _system(both, found),
            {},
            found,
            both.scaled.rate * found.bound,
            channel,
            spent,
        )
        if best is None or _better(candidate, best, gamma):
            best = candidate
        if not 0 < candidate.norm < math.inf or _CLOSE * gamma <= candidate.norm <= gamma:
            break
        asked = max(gamma, asked * (gamma * (1 + _CLOSE) / 2 / candidate.norm) ** _RISE)
        found = _solved(both, channel, asked, easy, spent, found)
        if found.A is None:
            break
    if best is None or not best.norm <= gamma:
        raise _impossible(both, channel, gamma, easy, easy, first.status)
    return best


def _solved(
    both: Innovations,
    channel: _Channel,
    asked: float,
    easy: float,
    spent: dict[str, float],
    near: OutputFeedback | None = None,
    tolerance: float = _TOLERANCE,
) -> OutputFeedback:
    """Return the answer for a bound, in the coordinates of a near one if there is any."""
    problem = _problem(both, channel, asked)
    if near is not None and near.near is not None:
        problem = replace(near.near, level=problem.level)
    return solve_output(problem, spent, tolerance=tolerance, ratio=_ratio(asked, easy))


def _reached(
    both: Innovations, channel: _Channel, gamma: float, easy: float, spent: dict[str, float]
) -> tuple[OutputFeedback, float]:
    """Return the answer for a bound, and the least bound that was reached on the way.

    Where the LQG design is too far away for its coordinates to serve, easier bounds give
    better ones.
    """
    near, good, asked = None, easy, gamma
    found = OutputFeedback()
    for _ in range(_STEPS):
        found = _solved(both, channel, asked, easy, spent, near)
        if _holds(both, channel, found, asked):
            near, good, asked = found, asked, gamma
            if good <= gamma:
                break
        else:
            asked = math.sqrt(asked * good)
    return found, good


def _holds(both: Innovations, channel: _Channel, found: OutputFeedback, gamma: float) -> bool:
    """Whether there is a controller and its recomputed norm is within the bound."""
    if found.A is None:
        return False
    return spillover_gain(both.plant, _system(both, found), channel) <= gamma


def _better(one: _Candidate, other: _Candidate, gamma: float) -> bool:
    if one.keeps(gamma) != other.keeps(gamma):
        return one.keeps(gamma)
    return one.cost < other.cost if one.keeps(gamma) else one.norm < other.norm


def _ratio(asked: float, easy: float) -> float:
    """Return the factor between the norm's and the cost's Lyapunov matrix; found by trial."""
    return min(1.0, (asked / easy) ** 2)


def _words(found: _Candidate, optimum: float) -> tuple[str, ...]:
    how = (
        "the LQG design keeps the bound and is the answer"
        if found.feedback.A is None
        else f"the controller comes from matrix inequalities (solver: {found.feedback.status})"
    )
    return (
        f"J/J* = {found.cost / optimum:.6g} achieved, at most {found.bound / optimum:.6g} "
        "promised by the inequalities; J* is the optimum without the bound",
        how,
        "stable neglected modes Δ cannot destabilise the loop while |Δ| < |W| / hinf_max at "
        "every frequency",
    )


def _channel(plant: GeneralisedPlant, corner: float) -> _Channel:
    noise = np.linalg.norm(plant.D21, axis=1)
    unit = {"torque": "N·m", "voltage": "V"}.get(plant.actuator, "")
    sensor = plant.sensors[0]
    beam = plant.model.arm.beam if plant.model is not None else None
    known = plant.model is not None
    per = signal(sensor, beam=beam).unit if known else ""
    per = f"({per})" if "/" in per else per
    return _Channel(corner, noise / noise[0], f"{unit}/{per}" if known else "")


def spillover_gain(plant: GeneralisedPlant, system: LinearSystem, channel: _Channel) -> float:
    """Return ‖W K S‖∞ of a controller around its plant; infinite if the loop is unstable."""
    check_finite(channel.weights, *system.matrices)
    n, sensors = len(plant.A), len(plant.sensors)
    # Inputs: each sensor's error, then u; outputs: W u = u − x_w with x_w' = ω_c (u − x_w), y.
    spilling = LinearSystem(
        block_diag(plant.A, np.array([[-channel.corner]])),
        np.block([[np.zeros((n, sensors)), plant.B2], [np.zeros((1, sensors)), channel.corner]]),
        np.block([[np.zeros((1, n)), -1.0], [plant.C2, np.zeros((sensors, 1))]]),
        np.block([[np.zeros((1, sensors)), 1.0], [np.diag(channel.weights), plant.D22]]),
        inputs=[*(f"error_{name}" for name in plant.sensors), plant.actuator],
        outputs=["spilled", *plant.sensors],
    )
    closed = GeneralisedPlant(spilling, plant.sensors).close(system)
    if np.linalg.eigvals(np.asarray(closed.A)).real.max() >= 0:
        return math.inf
    return peak_gain(closed).value


def _problem(both: Innovations, channel: _Channel, gamma: float) -> OutputProblem:
    """Return the inequalities' data: the scaled plant with the state of W as its last."""
    s = both.scaled
    corner = channel.corner / s.rate
    # In the scaled problem every sensor's noise and the control's cost are the units.
    size = float(np.linalg.norm(both.plant.D21[0]) / np.linalg.norm(s.control_unit))
    n, sensors = len(s.A), len(s.C2)
    A = np.pad(s.A, ((0, 1), (0, 1)))
    A[-1, -1] = -corner
    B2 = np.vstack([s.B2, [[corner]]])
    L = (both.observer.preliminary + both.observer.optimal).T
    F = np.pad(both.regulator.preliminary + both.regulator.optimal, ((0, 0), (0, 1)))
    P = covariance(Dynamics(A, B2, np.pad(L, ((0, 1), (0, 0)))), F)
    Y = np.pad(both.observer.X, ((0, 1), (0, 1))) + NOISE_FLOOR * np.diag(np.diag(P))
    Y[-1, -1] = _KNOWN * P[-1, -1]
    cost = Channel(np.pad(s.B1, ((0, 1), (0, 0))), np.pad(s.C1, ((0, 0), (0, 1))), s.D12, s.D21)
    row = np.zeros((1, n + 1))
    row[0, -1] = -1.0  # W u = u − x_w
    bounded = Channel(np.zeros((n + 1, sensors)), row, np.eye(1), np.eye(sensors))
    deviation = float(np.sqrt(np.trace(F @ P @ F.T)))
    C2 = np.pad(s.C2, ((0, 0), (0, 1)))
    return OutputProblem(A, B2, C2, cost, bounded, gamma * size, P, Y, deviation)


def _system(both: Innovations, found: OutputFeedback) -> LinearSystem:
    """Return the controller in the plant's units.

    Its own state stands for the scaled plant's and that of W.
    """
    plant = both.plant
    system = LinearSystem(
        np.asarray(found.A),
        found.B,
        found.C,
        np.zeros((1, len(plant.sensors))),
        inputs=list(plant.sensors),
        outputs=[plant.actuator],
        name="h2_hinf",
    )
    return behind_feedthrough(both.scaled.controller(system), plant.D22)


def _impossible(
    both: Innovations, channel: _Channel, gamma: float, easy: float, least: float, status: str
) -> DesignError:
    """Return the error that says what bound, or what corner, is possible.

    `least` is the least bound that was reached.
    """

    def at(gamma: float, corner: float) -> bool:
        changed = replace(channel, corner=corner)
        spent = {"build": 0.0, "solve": 0.0}
        found = _solved(both, changed, gamma, easy, spent, tolerance=_COARSE)
        return _holds(both, changed, found, gamma)

    advice = [f"hinf_max = {least * 1.02:.3g}"]
    high = 1e2 * channel.corner
    if at(gamma, high):
        found = largest(lambda value: at(gamma, value), high, channel.corner)
        advice.append(f"weight_hz = {found * 1.02 / (2 * math.pi):.3g}")
    return DesignError(
        f"no controller was found that keeps hinf_max = {gamma:g} {channel.unit} above "
        f"weight_hz = {channel.corner / (2 * math.pi):g} (solver: {status})",
        where="hinf_max",
        remedy=f"possible with the other kept: {', or '.join(advice)}",
    )
