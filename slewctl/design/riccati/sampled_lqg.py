"""Sampled LQG: designed in discrete time for a zero-order hold and a computational delay.

The plant with its hold is sampled exactly and the continuous cost is integrated over a
sample, so that the optimum is that of the hybrid loop: of the mean of zᵀz over all times.
At t_k the filter has used y_k already; what remains of the optimal control is

    u_k = −K χ̂_{k+l|k},

where l is the number of whole samples in the delay and χ̂ the prediction of the state that
u_k will meet (states of the plant, the input still on its way where the delay has a
fraction, and the integral of the measured angle).  Inputs on their way are known.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import TypeAlias

import numpy as np

from slewctl._types import Array
from slewctl.design.result import Check, Controller, finished
from slewctl.design.riccati.integral_action import angle_sensor, slowest_motion
from slewctl.design.riccati.lqr_kalman import check_assumptions
from slewctl.design.sampled_estimate import SampledEstimate
from slewctl.numerics.discrete_equations import solve_discrete_riccati
from slewctl.numerics.matrix_equations import RiccatiSolution
from slewctl.plant import GeneralisedPlant

Gains: TypeAlias = tuple[Array | None, Array | None]


def sampled_lqg(
    plant: GeneralisedPlant, sample_time: float, delay: float, integral_limit: float | None
) -> Controller:
    """Return the sampled LQG controller; see `slewctl.lqg`."""
    T, late = sample_time, float(delay) + plant.dead_time
    angle = None if integral_limit is None else angle_sensor(plant)
    check_assumptions(plant)
    start = perf_counter()
    design = _Design(plant.exact, T, late, "lqg", angle, integral_limit)
    whole, short = design.whole, design.short
    sampled = perf_counter()
    regulator, observer = design.regulator, design.observer
    assumptions = (design.timing, *_assumptions(T, integral_limit))
    if angle is not None:
        assumptions = (*assumptions, slowest_motion(*design.dynamics, regulator.gain, T))
    solved = perf_counter()
    system, reference = design.system(), design.reference()
    built = perf_counter()
    closed = whole.close(system)
    achieved = closed.h2.value
    if integral_limit is not None:
        achieved += float(closed.covariance[-1, -1]) / integral_limit**2
    n = len(plant.exact.A)
    gains = {"state_feedback": regulator.gain[:, :n], "observer": design.correction}
    if short.waiting:
        gains["input_on_its_way"] = regulator.gain[:, n : n + 1]
    if angle is not None:
        gains["integral"] = regulator.gain[:, -1:]
    return finished(
        plant,
        system,
        "lqg",
        gains,
        checks=(
            Check("Riccati residual, control", regulator.residual, 1e-10),
            Check("Riccati residual, filter", observer.residual, 1e-10),
            Check("hybrid cost, Lyapunov against Riccati", abs(achieved / design.cost - 1), 1e-9),
        ),
        assumptions=assumptions,
        seconds={"sample": sampled - start, "solve": solved - sampled, "build": built - solved},
        delay=float(delay),
        reference=reference,
        entry=design.entry,
    )


def least_sampled_cost(
    plant: GeneralisedPlant, sample_time: float, delay: float, near: Gains = (None, None)
) -> tuple[float, tuple[Array, Array]]:
    """Return the cost of the sampled LQG controller, unconfirmed, and its gains.

    Parameters
    ----------
    plant : GeneralisedPlant
    sample_time, delay : float
        In s.
    near : tuple of ndarray
        Gains of regulator and filter with which to begin.
    """
    late = float(delay) + plant.dead_time
    found = _Design(
        plant.exact, sample_time, late, "lqg", None, None, refine=False, near=near
    )  # fmt: skip
    return found.cost, (found.regulator.gain, found.observer.gain)


def _assumptions(T: float, limit: float | None) -> tuple[str, ...]:
    words = (
        "white torque noise of the objective's density, integrated exactly between the samples",
        f"sensor noise of density n averaged over a sample: variance n²/T, T = {T:g} s, "
        "independent from sample to sample, without the lag of an averaging filter",
        "u = −K x̂, x̂ the estimate from all readings up to t_k of the state that the torque "
        "will meet",
    )
    if limit is None:
        return (*words, "optimal for the mean of z² over all times, between the samples too")
    return (
        *words,
        "σ the sum of T (theta − theta_ref) as measured, fed back beside x̂",
        f"optimal for the mean of z² over all times + (σ / {limit:g} rad·s)² at the samples",
    )


@dataclass(frozen=True, eq=False)
class _Design(SampledEstimate):
    """The pieces of a sampled design, each computed once; unless refined, from gains near to it."""

    limit: float | None
    refine: bool = True
    near: Gains = (None, None)

    @property
    def feedback(self) -> Array:
        """K of the regulator."""
        return self.regulator.gain

    @cached_property
    def regulator(self) -> RiccatiSolution:
        """State feedback of the plant with the fraction of the delay."""
        A, B = self.dynamics
        size, n = len(A), len(self.short.A)
        cost = np.zeros((size + 1, size + 1))
        inside = [*range(n), size]
        cost[np.ix_(inside, inside)] = self.short.cost
        if self.limit is not None:
            cost[n, n] = self.T / self.limit**2
        return solve_discrete_riccati(
            A, B, cost[:size, :size], cost[size:, size:], cost[:size, size:],
            refine=self.refine, near=self.near[0],
        )  # fmt: skip

    @cached_property
    def observer(self) -> RiccatiSolution:
        """Kalman filter of the plant's own states; X is the covariance before y_k is used."""
        n = len(self.plant.A)
        return solve_discrete_riccati(
            self.whole.A[:n, :n].T, self.plant.C2.T, self.whole.noise[:n, :n],
            self.whole.sensor_noise, refine=self.refine, near=self.near[1],
        )  # fmt: skip

    @cached_property
    def correction(self) -> Array:
        """M of x̂_{k|k} = x̂_{k|k−1} + M (y_k − C x̂_{k|k−1}), shape (n, sensors)."""
        C, P = self.plant.C2, self.observer.X
        return np.asarray(np.linalg.solve(C @ P @ C.T + self.whole.sensor_noise, C @ P).T)

    @cached_property
    def _price(self) -> Array:
        """R + BᵀXB of the regulator."""
        B = self.dynamics[1]
        return self.short.cost[-1:, -1:] + B.T @ self.regulator.X @ B

    @cached_property
    def surprise(self) -> float:
        """Gain on the part of θ's reading that is noise, which σ takes in as well."""
        if self.angle is None:
            return 0.0
        if self.ahead:
            return float(self.regulator.gain[0, -1] * self.T)
        B = self.dynamics[1]
        return float((B.T @ self.regulator.X)[0, -1] * self.T / self._price[0, 0])

    @property
    def cost(self) -> float:
        """The optimum: mean of zᵀz (+ σ²/limit²) from the two Riccati equations.

        With X of the regulator and price R + BᵀXB, the cost of a sample is tr XW of all
        noise, plus the price of what u misses by not knowing the state that it meets, minus
        what it gains by knowing the noise that σ takes in.
        """
        K, X = self.regulator.gain, self.regulator.X
        n, size = len(self.plant.A), len(X)
        A = self.augmented(self.short)[0]
        W = np.zeros((size, size))
        W[:n, :n] = self.short.noise[:n, :n]
        error = np.zeros((size, size))
        P, C = self.observer.X, self.plant.C2
        error[:n, :n] = P - self.correction @ C @ P
        missed, gained = K.copy(), 0.0
        if self.angle is not None:
            sensor = float(self.short.sensor_noise[self.angle, self.angle])
            W[-1, -1] = self.T**2 * sensor
            if not self.ahead:
                missed[:, :n] -= self.surprise * C[self.angle]
                gained = self.surprise**2 * sensor
        if self.ahead:
            error[:n, :n] = P  # a sample later; σ takes in what was measured, so it is known
        for _ in range(self.ahead - 1):
            error = A @ error @ A.T + W
        price = float(self._price[0, 0])
        spent = price * (float((missed @ error @ missed.T)[0, 0]) - gained)
        return (float(np.sum(X * W)) + spent + self.short.noise_cost) / self.T
