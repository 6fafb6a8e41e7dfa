"""LQG with integral action: the measured hub angle is integrated and fed back too.

The plant is augmented by σ' = θ + its sensor's noise, which the controller knows exactly,
since it integrates the measurement itself.  Separation therefore holds: the state feedback
of the augmented plant acts on [x̂; σ], with the same Kalman filter as without σ, and is
optimal for the mean of zᵀz + (σ / limit)².
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.design.reference import Reference, at_rest
from slewctl.design.result import Check, Controller, finished
from slewctl.design.riccati.lqr_kalman import check_assumptions, optimal_filter
from slewctl.design.sampled_estimate import INTEGRAL_STATE
from slewctl.errors import DesignError, InputError
from slewctl.numerics.h2_norm import h2_cost
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import Regulator, RiccatiSolution
from slewctl.numerics.observability import pole_rounding
from slewctl.plant import GeneralisedPlant


def angle_sensor(plant: GeneralisedPlant) -> int:
    """Return the place of the angle among the sensors; refuse a plant that has none.

    ``theta``, or else ``theta_motor``: at rest an elastic joint is not twisted.
    """
    for name in ("theta", "theta_motor"):
        if name in plant.sensors:
            return plant.sensors.index(name)
    raise InputError(
        "the hub angle is not measured, so its error cannot be integrated",
        where="integral_limit",
        remedy="add the sensor noise.theta, or leave the integral out",
    )


def integral_lqg(plant: GeneralisedPlant, limit: float) -> Controller:
    """Return the LQG controller with integral action; see `slewctl.lqg`."""
    angle = angle_sensor(plant)
    check_assumptions(plant)
    start = perf_counter()
    regulator = _regulator(plant, angle, limit)
    slowest = slowest_motion(*_augmented(plant, angle), regulator.gain)
    observer = optimal_filter(plant)
    solved = perf_counter()
    n = len(plant.A)
    K, Ki, Kf = regulator.gain[:, :n], regulator.gain[:, n:], observer.gain.T
    system = _system(plant, K, Ki, Kf, angle)
    reference = _reference(plant, K, Kf)
    built = perf_counter()
    expected = _expected(plant, regulator, observer, angle)
    achieved = _achieved(plant, system, limit)
    return finished(
        plant,
        system,
        "lqg",
        {"state_feedback": K, "integral": Ki, "observer": Kf},
        checks=(
            Check("Riccati residual, control", regulator.residual, 1e-10),
            Check("Riccati residual, filter", observer.residual, 1e-10),
            Check("cost with integral, Lyapunov against Riccati", abs(achieved / expected - 1),
                  1e-9),
        ),
        assumptions=(
            "u = −K(x̂ − x_ref) − K_i σ, σ the integral of the measured theta − theta_ref",
            "x̂ from a stationary Kalman filter on the sensors, driven by u",
            "w is white noise of unit density",
            f"optimal for the mean of z² + (σ / {limit:g} rad·s)²",
            slowest,
        ),
        seconds={"solve": solved - start, "build": built - solved},
        reference=reference,
    )  # fmt: skip


def slowest_motion(A: Array, B: Array, gain: Array, sample_time: float = 0.0) -> str:
    """Return what the integral's feedback comes to, in words; refuse one that does nothing.

    Parameters
    ----------
    A, B, gain : ndarray
        Of the plant with its integral, and the state feedback.
    sample_time : float
        In s, of a sampled one.
    """
    poles, rounding = pole_rounding(A - B @ gain)
    if sample_time:
        slowest = -float(np.log(np.abs(poles) + rounding).max()) / sample_time
    else:
        slowest = -float((poles.real + rounding).max())
    if not slowest > 0:
        raise DesignError(
            "so large a limit leaves an integral that does nothing to working precision",
            where="integral_limit",
            remedy="lower it, or leave the integral out",
        )
    return f"the regulator's slowest motion has a time constant of {1 / slowest:.3g} s"


def _augmented(plant: GeneralisedPlant, angle: int) -> tuple[Array, Array]:
    """Return A and B of the plant with σ' = its measured angle."""
    n = len(plant.A)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[n, :n] = plant.A, plant.C2[angle]
    return A, np.vstack([plant.B2, plant.D22[angle : angle + 1]])


def _regulator(plant: GeneralisedPlant, angle: int, limit: float) -> RiccatiSolution:
    C = block_diag(plant.C1, np.array([[1 / limit]]))
    D = np.vstack([plant.D12, [[0.0]]])
    return Regulator.of(*_augmented(plant, angle), C, D).solve()


def _system(plant: GeneralisedPlant, K: Array, Ki: Array, Kf: Array, angle: int) -> LinearSystem:
    n, sensors = len(plant.A), list(plant.sensors)
    A = np.zeros((n + 1, n + 1))
    driven = plant.B2 - Kf @ plant.D22
    A[:n] = np.hstack([plant.A - Kf @ plant.C2 - driven @ K, -driven @ Ki])
    return LinearSystem(
        A,
        np.vstack([Kf, np.eye(len(sensors))[angle]]),
        -np.hstack([K, Ki]),
        np.zeros((1, len(sensors))),
        inputs=sensors,
        outputs=[plant.actuator],
        states=[*(f"{s}_estimate" for s in plant.linear.state_labels), INTEGRAL_STATE],
        name="lqg",
    )


def _reference(plant: GeneralisedPlant, K: Array, Kf: Array) -> Reference | None:
    rest = at_rest(plant)
    if rest is None:
        return None
    entry = K @ rest[0] + rest[1]
    return Reference(np.vstack([(plant.B2 - Kf @ plant.D22) @ entry, [[-1.0]]]), entry)


def _expected(
    plant: GeneralisedPlant, regulator: RiccatiSolution, observer: RiccatiSolution, angle: int
) -> float:
    """Return the optimal mean of zᵀz + (σ / limit)²."""
    n = len(plant.A)
    entering = np.vstack([plant.B1, plant.D21[angle]])
    estimation = plant.D12 @ regulator.gain[:, :n]
    return float(
        np.trace(entering.T @ regulator.X @ entering)
        + np.trace(estimation @ observer.X @ estimation.T)
    )


def _achieved(plant: GeneralisedPlant, system: LinearSystem, limit: float) -> float:
    """Return the mean of zᵀz + (σ / limit)² of the closed loop; σ is its last state."""
    closed = plant.close(system)
    A, B, C = (np.asarray(getattr(closed, name)) for name in "ABC")
    integral = np.zeros((1, len(A)))
    integral[0, -1] = 1 / limit
    return h2_cost(A, B, np.vstack([C, integral])).value
