"""Plants without an arm: every matrix of w, u → z, y filled, continuous or sampled."""

from __future__ import annotations

import control
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from slewctl import GeneralisedPlant

Array = NDArray[np.float64]


def made(
    A: Array, B: Array, C: Array, D: Array, dt: float = 0.0, sensors: int = 1
) -> GeneralisedPlant:
    """Return a plant whose last input is the actuator u, whose last outputs are the sensors."""
    w, z = np.shape(B)[1] - 1, len(C) - sensors
    names = tuple(f"y{i}" for i in range(sensors))
    system = control.StateSpace(
        A, B, C, D, dt, inputs=[*(f"w{i}" for i in range(w)), "u"],
        outputs=[*(f"z{i}" for i in range(z)), *names],
    )  # fmt: skip
    return GeneralisedPlant(system, names)


def random_plant(
    seed: int, *, sampled: bool = False, states: int = 3, sensors: int = 1
) -> GeneralisedPlant:
    """Return a plant with correlated noise, a priced product of states and input, and D22.

    A sampled one has D11 too.  Its poles lie on both sides of the edge of stability.
    """
    rng = np.random.default_rng(seed)
    w, z = sensors + 2, 3
    A = rng.normal(size=(states, states))
    B = rng.normal(size=(states, w + 1))
    C = rng.normal(size=(z + sensors, states))
    D = rng.normal(size=(z + sensors, w + 1))
    if not sampled:
        D[:z, :w] = 0.0
    D[z:, -1] *= 0.3
    return made(A, B, C, D, 0.1 if sampled else 0.0, sensors)


seeds = st.integers(0, 10**6)


def loop_cost(plant: GeneralisedPlant, K: control.StateSpace) -> float:
    """Return the squared H2 norm of python-control's own LFT by SciPy's Lyapunov equation."""
    loop = plant.system.lft(control.StateSpace(K.A, K.B, K.C, K.D, K.dt), 1, len(plant.sensors))
    A, B, C, D = (np.asarray(getattr(loop, name)) for name in "ABCD")
    poles = np.linalg.eigvals(A)
    if plant.sample_time:
        if np.abs(poles).max() >= 1:
            return np.inf
        P = solve_discrete_lyapunov(A, B @ B.T)
        return float(np.trace(C @ P @ C.T) + np.sum(D**2))
    if poles.real.max() >= 0 or np.abs(D).max() > 1e-12:
        return np.inf
    return float(np.trace(C @ solve_continuous_lyapunov(A, -B @ B.T) @ C.T))
