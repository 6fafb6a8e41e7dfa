"""The generalised plant as a controller with a clock sees it, sampled without approximation.

At t_k = kT the controller reads y_k and computes u_k, which acts on the plant from
t_k + delay to t_{k+1} + delay.  What happens between the samples is not lost: the cost and
the disturbance are integrated over them exactly, so that the H2 cost of the sampled loop is
the mean of Σ z² over all times, not over the instants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from slewctl._show import Described
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_nonnegative, check_positive
from slewctl.numerics.discrete_equations import solve_discrete_lyapunov
from slewctl.numerics.h2_norm import H2Cost
from slewctl.numerics.interconnect import closed_matrix
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import stability_threshold
from slewctl.plant.hold import Held, held
from slewctl.plant.problem import GeneralisedPlant, check_plant
from slewctl.plant.rounding_errors import standing_cost, white_cost

if TYPE_CHECKING:
    import control

# A delay this near to a whole number of samples, in samples, is that number.
_WHOLE = 1e-9
Rounding: TypeAlias = tuple[Array, Array, float]
"""Variances that words add to the readings, to the controller's states and to the command."""
MOST_DELAY = 10  # samples: each is a state more, and no such loop is worth closing


@dataclass(frozen=True, eq=False, repr=False)
class SampledPlant(Described):
    """A generalised plant between a hold and a sampler.

    The states are those of the plant and, below them, the inputs that are still on their
    way, the latest first.  The noise of a sensor, of density n, is taken as averaged over a
    sample: its variance is n²/T.

    Attributes
    ----------
    plant : GeneralisedPlant
    sample_time, delay : float
        T and the time from a sample to the input that is computed from it, in s.
    A, B, C : ndarray, shapes (N, N), (N, 1), (sensors, N)
        x_{k+1} = A x_k + B u_k, y_k = C x_k + v_k.
    noise : ndarray, shape (N, N)
        Covariance that the disturbance adds in a sample.
    sensor_noise : ndarray, shape (sensors, sensors)
        Covariance of v_k.
    cost : ndarray, shape (N + 1, N + 1)
        ∫ zᵀz dt over a sample is the quadratic form of [x_k; u_k] …
    noise_cost : float
        … and on average this, which the disturbance of the same sample costs.
    """

    plant: GeneralisedPlant
    sample_time: float
    delay: float
    A: Array
    B: Array
    C: Array
    noise: Array
    sensor_noise: Array
    cost: Array
    noise_cost: float

    def __str__(self) -> str:
        late = f", {self.delay:g} s late" if self.delay else ""
        return f"{self.plant}, sampled every {self.sample_time:g} s{late}"

    @property
    def waiting(self) -> int:
        """Number of inputs on their way."""
        return len(self.A) - len(self.plant.A)

    @property
    def control_path(self) -> control.StateSpace:
        """From the actuator to the measurements, as a named discrete-time system."""
        return self.path.to_control()

    @property
    def path(self) -> LinearSystem:
        """The same without python-control."""
        states = [*self.plant.linear.state_labels]
        actuator = self.plant.actuator
        return LinearSystem(
            self.A,
            self.B,
            self.C,
            np.zeros((len(self.C), 1)),
            self.sample_time,
            inputs=[actuator],
            outputs=list(self.plant.sensors),
            states=[*states, *(f"{actuator}_before_{i + 1}" for i in range(self.waiting))],
            name=f"{self.plant.linear.name}_sampled",
        )

    def close(self, controller: object, rounding: Rounding | None = None) -> SampledClosed:
        """Return the closed loop of a discrete-time controller.

        Parameters
        ----------
        controller : control.StateSpace
            From the sensors to the actuator, connected with a plus sign, with the plant's
            sample time.
        rounding : tuple of ndarray, ndarray and float, optional
            Of one that computes in words; see `SampledClosed.cost_of_rounding`.

        Raises
        ------
        InputError
            If its signals or its sample time are others than the plant's.
        """
        return SampledClosed(self, self.plant.fitting(controller, self.sample_time), rounding)


@dataclass(frozen=True, eq=False)
class SampledClosed:
    """A sampled plant with a controller: states [x; inputs on their way; controller].

    Attributes
    ----------
    plant : SampledPlant
    controller : LinearSystem
    rounding : tuple of ndarray, ndarray and float, or None
        Variances of white errors in the controller; see `cost_of_rounding`.
    """

    plant: SampledPlant
    controller: LinearSystem
    rounding: Rounding | None = None

    @cached_property
    def A(self) -> Array:
        """State matrix from one sampling instant to the next."""
        return closed_matrix(self.plant.A, self.plant.B, self.plant.C, self._controller)

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles in the z-plane."""
        return np.linalg.eigvals(self.A).astype(complex)

    @property
    def stable(self) -> bool:
        """Whether every pole lies within the unit circle by more than rounding."""
        return bool(np.abs(self.poles).max() < self.largest_stable)

    @cached_property
    def largest_stable(self) -> float:
        """The |z| below which a computed pole counts as stable."""
        return 1 - stability_threshold(self.A)

    @cached_property
    def covariance(self) -> Array:
        """Stationary covariance of the states at the sampling instants."""
        return solve_discrete_lyapunov(self.A, self._noise)

    @cached_property
    def cost_to_go(self) -> Array:
        """What a state costs from now on: its quadratic form is the sum of ∫ zᵀz dt."""
        return solve_discrete_lyapunov(self.A.T, self._cost)

    @cached_property
    def h2(self) -> H2Cost:
        """Mean of zᵀz over all times, from both Gramians; the loop must be stable.

        That of rounding is in it.
        """
        p, (_, direct) = self.plant, self.driven
        at_once = float(np.trace(direct.T @ p.cost @ direct @ p.sensor_noise)) + p.noise_cost
        value = float(np.sum(self._cost * self.covariance)) + at_once
        other = float(np.sum(self.cost_to_go * self._noise)) + at_once
        size = max(abs(value), np.finfo(float).tiny)
        added = self.cost_of_rounding(*self.rounding) if self.rounding else 0.0
        return H2Cost(value / p.sample_time + added, abs(other - value) / size)

    @cached_property
    def _cost(self) -> Array:
        """∫ zᵀz dt over a sample as a quadratic form of the states."""
        seen = self.driven[0]
        return np.asarray(seen.T @ self.plant.cost @ seen)

    def cost_of_rounding(self, readings: Array, states: Array, command: float) -> float:
        """Return what errors of these variances in the controller add to the H2 cost at most.

        Parameters
        ----------
        readings, states : ndarray, shapes (sensors,), (controller's states,)
            Variances of what is added to the readings, and to the states in a sample.
        command : float
            That of what is added to the command.
        """
        white = white_cost(self, readings, states, command)
        return white + standing_cost(self, states)

    @property
    def _controller(self) -> tuple[Array, Array, Array, Array]:
        return self.controller.matrices

    @cached_property
    def _noise(self) -> Array:
        """Covariance that a sample adds to the states."""
        p, (_, Bk, _, Dk) = self.plant, self._controller
        entering = np.vstack([p.B @ Dk, Bk])
        noise = entering @ p.sensor_noise @ entering.T
        noise[: len(p.A), : len(p.A)] += p.noise
        return noise

    @cached_property
    def driven(self) -> tuple[Array, Array]:
        """From the states, and from v_k, to [x_k; u_k]."""
        p, (Ak, _, Ck, Dk) = self.plant, self._controller
        n = len(p.A)
        states = np.block([[np.eye(n), np.zeros((n, len(Ak)))], [Dk @ p.C, Ck]])
        return states, np.vstack([np.zeros((n, len(p.C))), Dk])


def sampled_plant(plant: GeneralisedPlant, sample_time: float, delay: float = 0.0) -> SampledPlant:
    """Return a plant sampled exactly, with a zero-order hold and a delay of its input.

    Parameters
    ----------
    plant : GeneralisedPlant
        Its disturbance and its sensor noise must be independent.
    sample_time : float
        T in s.
    delay : float
        In s, from a sample to the input computed from it; any fraction of T, up to 10 T.
        The plant's own dead time is added, exactly.

    Returns
    -------
    SampledPlant

    Raises
    ------
    InputError
        For impossible times, noise that both disturbs and is measured, or what passes
        without delay from a disturbance to an output or from the input to a sensor.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> sc.sampled_plant(plant, sample_time=0.01, delay=0.005).sample_time
    0.01
    """
    check_plant(plant, "sampled_plant")
    T = check_positive(sample_time, "sample_time")
    delay, plant = delay + plant.dead_time, plant.exact
    whole, part = split_delay(T, delay)
    if np.any(plant.B1 @ plant.D21.T):
        raise InputError(
            "a disturbance enters a sensor too, and white noise has no value at an instant",
            where="sample_time",
            remedy="give the sensors noise of their own",
        )
    if np.any(plant.D11) or np.any(plant.D22):
        raise InputError(
            "a disturbance reaches z, or the input a sensor, without delay (D11 or D22)",
            where="sample_time",
            remedy="put a lag between them: what a sample of it is, is not defined",
        )
    n = len(plant.A)
    waiting = whole + (part > 0)
    before, after = (_held(plant, h) for h in (part, T - part))
    # Rows of [x_k; u_{k−1}; …; u_{k−p}; u_k] that give the inputs of the two parts.
    inputs = np.eye(n + waiting + 1)[n:]
    new, old = inputs[whole - 1], inputs[waiting - 1]
    start = np.vstack([np.eye(n, n + waiting + 1), old])
    middle = np.vstack([(before.transition @ start)[:n], new])
    A = np.zeros((n + waiting, n + waiting + 1))
    A[:n] = (after.transition @ middle)[:n]
    if waiting:
        A[n] = inputs[-1]
        A[n + 1 :] = inputs[: waiting - 1]
    noise = np.zeros((n + waiting, n + waiting))
    across = after.transition[:n, :n]
    noise[:n, :n] = across @ before.noise @ across.T + after.noise
    carried = float(np.sum(after.cost[:n, :n] * before.noise))
    return SampledPlant(
        plant,
        T,
        float(delay),
        A[:, :-1],
        A[:, -1:],
        np.hstack([plant.C2, np.zeros((len(plant.C2), waiting))]),
        noise,
        plant.D21 @ plant.D21.T / T,
        start.T @ before.cost @ start + middle.T @ after.cost @ middle,
        before.noise_cost + carried + after.noise_cost,
    )


def _held(plant: GeneralisedPlant, h: float) -> Held:
    """Return a plant's motion over a time; the same plant is asked for it again and again."""
    matrices = (plant.A, plant.B2, plant.B1, np.hstack([plant.C1, plant.D12]))
    shapes = tuple(matrix.shape for matrix in matrices)
    return _held_again(b"".join(matrix.tobytes() for matrix in matrices), shapes, h)


@lru_cache(maxsize=64)  # those of a ladder of truths
def _held_again(numbers: bytes, shapes: tuple[tuple[int, ...], ...], h: float) -> Held:
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    parts = np.split(np.frombuffer(numbers), ends[:-1])
    A, B, B1, F = (part.reshape(shape) for part, shape in zip(parts, shapes, strict=True))
    found = held(A, B, B1, F, h)
    for field in fields(found):
        if isinstance(value := getattr(found, field.name), np.ndarray):
            value.flags.writeable = False
    return found


def split_delay(sample_time: float, delay: float) -> tuple[int, float]:
    """Return a delay as whole samples and the time that is left, less than a sample.

    Parameters
    ----------
    sample_time, delay : float
        In s.

    Returns
    -------
    tuple of int and float
        Whole samples, and the rest in s.

    Raises
    ------
    InputError
        For a delay that is negative or longer than ten samples.

    Examples
    --------
    >>> from slewctl.plant import split_delay
    >>> split_delay(0.5, 1.25)
    (2, 0.25)
    """
    samples = check_nonnegative(delay, "delay") / sample_time
    if samples > MOST_DELAY:
        raise InputError(
            f"{delay:g} s is more than {MOST_DELAY} sample times of {sample_time:g} s",
            where="delay",
            remedy="sample more slowly, or give the delay in seconds",
        )
    if abs(samples - round(samples)) <= _WHOLE:
        return round(samples), 0.0
    return math.floor(samples), delay - math.floor(samples) * sample_time


def continuous_equivalent(poles: ComplexArray, sample_time: float) -> ComplexArray:
    """Return s = ln(z)/T of poles in the z-plane, those at z = 0 left out.

    s decays, and oscillates at the instants, as z does.  A frequency above half the
    sampling rate appears below it.  A pole at z = 0 is gone after a sample and has no s.

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
    sample_time : float
        T in s.

    Returns
    -------
    ndarray of complex
        In rad/s.

    Examples
    --------
    >>> import numpy as np
    >>> from slewctl.plant import continuous_equivalent
    >>> continuous_equivalent(np.exp([-0.1, -0.2]).astype(complex), 0.1).real.round(6).tolist()
    [-1.0, -2.0]
    """
    kept = poles[np.abs(poles) > np.finfo(float).eps]
    return np.log(kept.astype(complex)) / sample_time
