"""LQG: the H2-optimal output feedback, from two Riccati equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import read_clock
from slewctl.design.observer import observer_feedback, observer_reference
from slewctl.design.result import Controller, finished
from slewctl.design.riccati.discrete_lqg import sampled_plant_lqg
from slewctl.design.riccati.integral_action import integral_lqg
from slewctl.design.riccati.lqr_kalman import (
    check_finite_cost,
    optimal_feedback,
    optimal_filter,
    optimum_checks,
)
from slewctl.design.riccati.sampled_lqg import Gains, least_sampled_cost, sampled_lqg
from slewctl.errors import InputError, check_nonnegative, check_positive
from slewctl.numerics.matrix_equations import Regulator, RiccatiSolution
from slewctl.plant import GeneralisedPlant, check_plant

ASSUMPTIONS = (
    "u = −K(x̂ − x_ref), x̂ from a stationary Kalman filter on the sensors, driven by u",
    "w is white noise of unit density; what disturbs and what is measured may have it in common",
)


@guarded
def lqg(
    plant: GeneralisedPlant,
    *,
    integral_limit: float | None = None,
    sample_time: float | None = None,
    delay: float = 0.0,
) -> Controller:
    """Return the controller that minimises the H2 norm from w to z.

    Parameters
    ----------
    plant : GeneralisedPlant
        Made from the model that the designer has, never from the truth.  Continuous, with
        D₁₁ = 0, or sampled; all other matrices as they come.  Of a sampled plant the
        controller has the plant's clock and minimises the sampled H2 norm.
    integral_limit : float, optional
        Largest acceptable integral of the hub angle's error in rad·s (Bryson's rule).  Given,
        the measured ``theta`` is integrated and fed back too, and a constant torque leaves no
        steady error of the angle.  The sum of both costs is then minimised.
    sample_time : float, optional
        In s.  Given, the controller is a sampled one, designed for the plant behind a
        zero-order hold and for the mean of zᵀz over all times, between the samples too.
    delay : float
        Computation time in s of a sampled controller, any fraction of the sample time up to
        ten of them: the torque computed from the sample at t_k acts from t_k + delay to
        t_{k+1} + delay.

    Returns
    -------
    Controller
        A Kalman filter on the plant's sensors with the state feedback u = −K x̂.  Its
        certificate compares the optimal cost, as the two Riccati equations give it
        (Zhou, Doyle and Glover, Robust and Optimal Control, theorem 14.7), with that of
        the closed loop from a Lyapunov equation.

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached (see `lqr`, `kalman`).
    InputError
        For an option that is out of range, or an integral without the sensor ``theta``.
    AccuracyError
        If a Riccati equation has no stabilising solution, as where the samples miss a mode.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.lqg(plant)
    >>> K.certificate.verified, K.sensors
    (True, ('theta',))
    """
    check_plant(plant, "design", sampled=True)
    if plant.sample_time:
        own = check_nonnegative(delay, "delay") or None
        _refuse_options(integral_limit=integral_limit, sample_time=sample_time, delay=own)
        return sampled_plant_lqg(plant)
    if integral_limit is not None:
        check_positive(integral_limit, "integral_limit")
    clock = read_clock(sample_time, delay)
    if clock:
        return sampled_lqg(plant, **clock, integral_limit=integral_limit)
    if integral_limit is not None:
        return integral_lqg(plant, integral_limit)
    return _plain_lqg(plant)


def _refuse_options(**given: float | None) -> None:
    """Refuse options that have no meaning for a plant that is sampled already."""
    for name, value in given.items():
        if value is not None:
            raise InputError(
                "the plant is sampled already, with a clock of its own",
                where=name,
                remedy="leave it out, or give the continuous plant",
            )


def _plain_lqg(plant: GeneralisedPlant) -> Controller:
    check_finite_cost(plant)
    start = perf_counter()
    regulator, observer = optimal_feedback(plant), optimal_filter(plant)
    solved = perf_counter()
    K, Kf = regulator.gain, observer.gain.T
    system = observer_feedback(plant, K, Kf, "lqg")
    reference = observer_reference(plant, K, Kf)
    built = perf_counter()
    return finished(
        plant,
        system,
        "lqg",
        {"state_feedback": K, "observer": Kf},
        checks=optimum_checks(regulator, observer, optimal_cost(plant, regulator, observer)),
        assumptions=ASSUMPTIONS,
        seconds={"solve": solved - start, "build": built - solved},
        reference=reference,
    )


def optimal_cost(
    plant: GeneralisedPlant, regulator: RiccatiSolution, observer: RiccatiSolution
) -> float:
    """Return the optimal squared H2 norm tr B₁ᵀXB₁ + tr D₁₂K Y KᵀD₁₂ᵀ."""
    estimation = plant.D12 @ regulator.gain
    return float(
        np.trace(plant.B1.T @ regulator.X @ plant.B1)
        + np.trace(estimation @ observer.X @ estimation.T)
    )


@dataclass(frozen=True, eq=False)
class LeastCost:
    """The cost of an optimum that nobody has confirmed.

    Attributes
    ----------
    value : float
        The squared H2 norm.
    states : tuple of str
        Names of the plant's states.
    gains : tuple of ndarray
        Of the regulator, on them and what a clock adds below, and of the filter's dual.
    """

    value: float
    states: tuple[str, ...]
    gains: tuple[Array, Array]

    def near(self, states: Sequence[str]) -> Gains:
        """Return gains for a plant with more states: what is not known of them, zero."""
        names, known = list(states), len(self.states)
        if not set(self.states) <= set(names):
            return None, None
        columns, found = [names.index(name) for name in self.states], []
        for gain in self.gains:
            whole = np.zeros((len(gain), len(names)))
            whole[:, columns] = gain[:, :known]
            found.append(np.hstack([whole, gain[:, known:]]))
        return found[0], found[1]


@guarded
def least_cost(
    plant: GeneralisedPlant,
    sample_time: float = 0.0,
    delay: float = 0.0,
    below: LeastCost | None = None,
) -> LeastCost:
    """Return the cost of `lqg` without its controller, and without what confirms it.

    Parameters
    ----------
    plant : GeneralisedPlant
        Continuous.
    sample_time, delay : float
        In s, of a sampled controller; zero for a continuous one.
    below : LeastCost, optional
        Of the same arm with fewer modes: the optimum is sought from there.

    Returns
    -------
    LeastCost
        To the residual that the Riccati equations leave: 1e-7 of it.

    Raises
    ------
    AccuracyError
        If a Riccati equation has no stabilising solution.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.design.riccati.lqg import least_cost
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> abs(least_cost(plant).value / sc.lqg(plant).h2_cost - 1) < 1e-6
    True
    """
    exact = plant.exact if sample_time else plant
    names = tuple(exact.linear.state_labels)
    near = below.near(names) if below else (None, None)
    if sample_time:
        cost, gains = least_sampled_cost(plant, sample_time, delay, near)
        return LeastCost(cost, names, gains)
    check_finite_cost(plant)
    regulator = Regulator.of(plant.A, plant.B2, plant.C1, plant.D12)
    observer = Regulator.of(plant.A.T, plant.C2.T, plant.B1.T, plant.D21.T)
    K, L = regulator.solve(refine=False, near=near[0]), observer.solve(refine=False, near=near[1])
    return LeastCost(optimal_cost(plant, K, L), names, (K.gain, L.gain))
