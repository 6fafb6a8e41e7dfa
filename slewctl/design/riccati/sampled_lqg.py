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

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference, at_rest
from slewctl.design.result import Check, Controller, finished
from slewctl.design.riccati.integral_action import INTEGRAL_STATE, angle_sensor, slowest_motion
from slewctl.design.riccati.lqr_kalman import check_assumptions
from slewctl.errors import check_nonnegative, check_positive
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import RiccatiSolution, solve_discrete_riccati
from slewctl.plant import GeneralisedPlant, SampledPlant, sampled_plant, split_delay


def sampled_lqg(
    plant: GeneralisedPlant, sample_time: float, delay: float, integral_limit: float | None
) -> Controller:
    """Return the sampled LQG controller; see `slewctl.lqg`."""
    T = check_positive(sample_time, "sample_time")
    late = check_nonnegative(delay, "delay") + plant.dead_time
    split_delay(T, late)
    angle = None if integral_limit is None else angle_sensor(plant)
    check_assumptions(plant)
    start = perf_counter()
    design = _Design(plant.exact, T, float(late), angle, integral_limit)
    whole, short = design.whole, design.short
    sampled = perf_counter()
    regulator, observer = design.regulator, design.observer
    assumptions = _assumptions(T, float(late), integral_limit)
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
    )


def _assumptions(T: float, delay: float, limit: float | None) -> tuple[str, ...]:
    words = (
        f"the sensors are read at t_k = k·{T:g} s; the torque computed from the reading at t_k is "
        f"held from t_k + {delay:g} s to t_(k+1) + {delay:g} s",
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
class _Design:
    """The pieces of a sampled design, each computed once.

    The regulator's states are [x; the input on its way, for a fraction of a sample; σ].
    """

    plant: GeneralisedPlant
    T: float
    delay: float
    angle: int | None
    limit: float | None

    @cached_property
    def whole(self) -> SampledPlant:
        """The plant with all of the delay."""
        return sampled_plant(self.plant, self.T, self.delay)

    @cached_property
    def short(self) -> SampledPlant:
        """The plant with the fraction of the delay: what u meets when it arrives."""
        samples, fraction = split_delay(self.T, self.delay)
        return sampled_plant(self.plant, self.T, fraction) if samples else self.whole

    @property
    def ahead(self) -> int:
        """Number of samples by which the state is predicted."""
        return self.whole.waiting - self.short.waiting

    @property
    def dynamics(self) -> tuple[Array, Array]:
        """A and B of the regulator's states."""
        return self._augmented(self.short)

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
            A, B, cost[:size, :size], cost[size:, size:], cost[:size, size:]
        )

    @cached_property
    def observer(self) -> RiccatiSolution:
        """Kalman filter of the plant's own states; X is the covariance before y_k is used."""
        n = len(self.plant.A)
        return solve_discrete_riccati(
            self.whole.A[:n, :n].T, self.plant.C2.T, self.whole.noise[:n, :n],
            self.whole.sensor_noise,
        )  # fmt: skip

    @cached_property
    def correction(self) -> Array:
        """M of x̂_{k|k} = x̂_{k|k−1} + M (y_k − C x̂_{k|k−1}), shape (n, sensors)."""
        C, P = self.plant.C2, self.observer.X
        return np.asarray(np.linalg.solve(C @ P @ C.T + self.whole.sensor_noise, C @ P).T)

    def _augmented(self, plant: SampledPlant) -> tuple[Array, Array]:
        """Return A and B of a sampled plant with σ_{k+1} = σ_k + T θ_k, if there is one."""
        if self.angle is None:
            return plant.A, plant.B
        n = len(plant.A)
        A = np.zeros((n + 1, n + 1))
        A[:n, :n], A[n, n] = plant.A, 1.0
        A[n, :n] = self.T * plant.C[self.angle]
        return A, np.vstack([plant.B, [[0.0]]])

    @cached_property
    def _gain(self) -> Array:
        """Gain on the states of the whole plant: K of the regulator on the prediction."""
        A = self._augmented(self.whole)[0]
        n, size = len(self.plant.A), len(A)
        met = [*range(n), *([n + self.whole.waiting - 1] if self.short.waiting else [])]
        met += [size - 1] if self.angle is not None else []
        return self.regulator.gain @ np.linalg.matrix_power(A, self.ahead)[met]

    @cached_property
    def _price(self) -> Array:
        """R + BᵀXB of the regulator."""
        B = self.dynamics[1]
        return self.short.cost[-1:, -1:] + B.T @ self.regulator.X @ B

    @cached_property
    def _surprise(self) -> float:
        """Gain on the part of θ's reading that is noise, which σ takes in as well."""
        if self.angle is None:
            return 0.0
        if self.ahead:
            return float(self.regulator.gain[0, -1] * self.T)
        B = self.dynamics[1]
        return float((B.T @ self.regulator.X)[0, -1] * self.T / self._price[0, 0])

    def system(self) -> LinearSystem:
        """Return the controller: states x̂_{k|k−1}, inputs on their way, σ_k."""
        F, G, H, J = self._observer
        states = [f"{state}_estimate" for state in self.whole.path.state_labels]
        return LinearSystem(
            F - H @ (self._gain - J @ self._seen),
            G - H @ J,
            J @ self._seen - self._gain,
            -J,
            self.T,
            inputs=list(self.plant.sensors),
            outputs=[self.plant.actuator],
            states=[*states, *([] if self.angle is None else [INTEGRAL_STATE])],
            name="lqg",
        )

    @cached_property
    def _seen(self) -> Array:
        """C from the controller's states: what the filter expects to measure."""
        return np.hstack([self.whole.C, np.zeros((len(self.whole.C), int(self.angle is not None)))])

    @cached_property
    def _observer(self) -> tuple[Array, Array, Array, Array]:
        """F, G, H of s⁺ = F s + G y + H u, and J of u = −gain·s − J (y − C s)."""
        n, size = len(self.plant.A), len(self._gain[0])
        A, H = self._augmented(self.whole)
        M = np.zeros((size, len(self.plant.sensors)))
        M[:n] = self.correction
        F, G = A @ (np.eye(size) - M @ self._seen), A @ M
        J = self._gain @ M
        if self.angle is not None:
            # σ takes in the measurement itself, not its estimate.
            F[-1], G[-1] = np.eye(size)[-1], self.T * np.eye(len(G[0]))[self.angle]
            noise = np.eye(len(G[0])) - self.plant.C2 @ self.correction
            J = J + self._surprise * noise[self.angle]
        return F, G, H, J

    def reference(self) -> Reference | None:
        """Return how the reference enters: by commanding the state, and σ by its error."""
        rest = at_rest(self.plant)
        if rest is None:
            return None
        H, size = self._observer[2], len(self._gain[0])
        there = np.zeros((size, 1))
        there[: len(self.plant.A)] = rest[0]
        there[len(self.plant.A) : len(self.whole.A)] = rest[1]
        entry = self._gain @ there + rest[1]
        B = H @ entry
        if self.angle is not None:
            B[-1] -= self.T
        return Reference(B, entry)

    @property
    def cost(self) -> float:
        """The optimum: mean of zᵀz (+ σ²/limit²) from the two Riccati equations.

        With X of the regulator and price R + BᵀXB, the cost of a sample is tr XW of all
        noise, plus the price of what u misses by not knowing the state that it meets, minus
        what it gains by knowing the noise that σ takes in.
        """
        K, X = self.regulator.gain, self.regulator.X
        n, size = len(self.plant.A), len(X)
        A = self._augmented(self.short)[0]
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
                missed[:, :n] -= self._surprise * C[self.angle]
                gained = self._surprise**2 * sensor
        if self.ahead:
            error[:n, :n] = P  # a sample later; σ takes in what was measured, so it is known
        for _ in range(self.ahead - 1):
            error = A @ error @ A.T + W
        price = float(self._price[0, 0])
        spent = price * (float((missed @ error @ missed.T)[0, 0]) - gained)
        return (float(np.sum(X * W)) + spent + self.short.noise_cost) / self.T
