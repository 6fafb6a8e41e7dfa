"""The H2-optimal state feedback and estimator alone, each from one matrix inequality."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.lmi.clarabel import solve
from slewctl.design.lmi.h2_lmi import filter_lmi, regulator_lmi
from slewctl.design.lmi.h2_problem import GAP, H2Setting, h2_setting, stable_cost
from slewctl.design.lmi.riccati_gain import GainLMI
from slewctl.design.result import Certificate, Check, Guarantee
from slewctl.plant import GeneralisedPlant


@dataclass(frozen=True, eq=False)
class GainProblem:
    """One inequality and the plant it is for.

    Attributes
    ----------
    setting : H2Setting
    lmi : GainLMI
    seconds : float
        What building took.
    """

    setting: H2Setting
    lmi: GainLMI
    seconds: float


@dataclass(frozen=True, eq=False)
class H2Gain:
    """A gain from a matrix inequality, with what it achieves recomputed.

    Attributes
    ----------
    gain : ndarray
        In the plant's coordinates: K, shape (1, n), with u = −K x; or K_f, shape
        (n, sensors), with x̂' = A x̂ + B₂u + K_f (y − C₂x̂).
    cost : float
        Squared H2 norm from a Lyapunov equation: from w to z with the state fed back, or from
        w to the estimate's error C₁(x − x̂).
    optimum : float
        The same by the Riccati equation.
    bound : Guarantee
        What the inequality says that no gain's cost is below.
    certificate : Certificate
    status : str
        What the solver said.
    iterations : int
    seconds : dict of str to float
        ``build``, ``solve`` and, within the latter, ``solver``.
    """

    gain: Array
    cost: float
    optimum: float
    bound: Guarantee
    certificate: Certificate
    status: str
    iterations: int
    seconds: dict[str, float]

    @property
    def gap(self) -> float:
        """How far the cost lies above the Riccati optimum, relative."""
        return self.cost / self.optimum - 1


@guarded
def h2_state_feedback(plant: GeneralisedPlant) -> H2Gain:
    """Return the H2-optimal state feedback of a plant by one matrix inequality.

    Parameters
    ----------
    plant : GeneralisedPlant
        In any coordinates, as for `slewctl.design.h2_lmi`.

    Returns
    -------
    H2Gain
        Its ``gain`` has shape (m, n).

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached.
    AccuracyError
        If the solver returns nothing.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> sc.h2_state_feedback(plant).gain.shape
    (1, 4)
    """
    return solve_state_feedback(build_state_feedback(plant))


@guarded
def h2_estimator(plant: GeneralisedPlant) -> H2Gain:
    """Return the stationary Kalman filter's gain by one matrix inequality.

    Parameters
    ----------
    plant : GeneralisedPlant

    Returns
    -------
    H2Gain
        Its ``gain`` has shape (n, p).

    Raises
    ------
    DesignError, AccuracyError
        As `h2_state_feedback`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> sc.h2_estimator(plant).gain.shape
    (4, 1)
    """
    return solve_estimator(build_estimator(plant))


def build_state_feedback(plant: GeneralisedPlant) -> GainProblem:
    """Return the inequality of the state feedback, scaled."""
    start = perf_counter()
    setting = h2_setting(plant)
    return GainProblem(setting, regulator_lmi(setting.scaled), perf_counter() - start)


def build_estimator(plant: GeneralisedPlant) -> GainProblem:
    """Return the inequality of the estimator, scaled."""
    start = perf_counter()
    setting = h2_setting(plant)
    return GainProblem(setting, filter_lmi(setting.scaled), perf_counter() - start)


def solve_state_feedback(problem: GainProblem) -> H2Gain:
    """Return the state feedback of a built problem."""
    setting, plant, twin = problem.setting, problem.setting.plant, problem.setting.twin
    solved = _solved(problem, "h2_state_feedback")
    K = setting.scaled.state_feedback(problem.lmi.gain)
    cost = stable_cost(plant.A - plant.B2 @ K, plant.B1, plant.C1 - plant.D12 @ K)
    X = setting.riccati()[0].X
    scaled_cost = np.trace(setting.scaled.B1.T @ problem.lmi.below @ setting.scaled.B1)
    return solved.result(
        K,
        cost,
        float(np.trace(twin.B1.T @ X @ twin.B1)),
        setting.scaled.rate * float(scaled_cost),
    )


def solve_estimator(problem: GainProblem) -> H2Gain:
    """Return the estimator of a built problem."""
    setting, plant, twin = problem.setting, problem.setting.plant, problem.setting.twin
    solved = _solved(problem, "h2_estimator")
    Kf = setting.scaled.observer_gain(problem.lmi.gain.T)
    cost = stable_cost(plant.A - Kf @ plant.C2, plant.B1 - Kf @ plant.D21, plant.C1)
    Y = setting.riccati()[1].X
    scaled_cost = np.trace(setting.scaled.C1 @ problem.lmi.below @ setting.scaled.C1.T)
    return solved.result(
        Kf,
        cost,
        float(np.trace(twin.C1 @ Y @ twin.C1.T)),
        setting.scaled.rate * float(scaled_cost),
    )


@dataclass(frozen=True)
class _Solved:
    """What is known of a solved problem before its gain is judged."""

    status: str
    iterations: int
    seconds: dict[str, float]

    def result(self, gain: Array, cost: float, optimum: float, bound: float) -> H2Gain:
        """Return the gain with its certificate."""
        promised = Guarantee("H2 cost by the inequality", bound, cost, "at least")
        gap = Check(f"cost over the Riccati optimum ({self.status})", abs(cost / optimum - 1), GAP)
        stable = Check("closed loop not stable", 0.0 if np.isfinite(cost) else 1.0, 0.0)
        return H2Gain(
            gain,
            cost,
            optimum,
            promised,
            Certificate((stable, gap, promised.check)),
            self.status,
            self.iterations,
            self.seconds,
        )


def _solved(problem: GainProblem, where: str) -> _Solved:
    start = perf_counter()
    run = solve(problem.lmi.problem, problem.lmi.tolerance, where)
    spent = perf_counter() - start
    return _Solved(
        run.status,
        run.iterations,
        {"build": problem.seconds, "solve": spent, "solver": run.seconds},
    )
