"""LQG: the H2-optimal output feedback, from two Riccati equations."""

from __future__ import annotations

from time import perf_counter

import control
import numpy as np

from slewctl._types import Array
from slewctl.design.discrete import sampled_lqg
from slewctl.design.integral import integral_lqg
from slewctl.design.lqr import kalman, lqr
from slewctl.design.reference import Reference, at_rest
from slewctl.design.result import Check, Controller, closed_cost, finished
from slewctl.errors import InputError, check_nonnegative, check_positive
from slewctl.linalg import RiccatiSolution
from slewctl.plant import GeneralisedPlant, check_plant

ASSUMPTIONS = (
    "u = −K(x̂ − x_ref), x̂ from a stationary Kalman filter on the sensors, driven by u",
    "white torque noise and white sensor noise of the objective's densities, independent",
)


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
        Made from the model that the designer has, never from the truth.
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
    """
    check_plant(plant, "design")
    if integral_limit is not None:
        check_positive(integral_limit, "integral_limit")
    if sample_time is not None:
        return sampled_lqg(plant, sample_time, delay, integral_limit)
    if check_nonnegative(delay, "delay") > 0:
        raise InputError(
            "a computational delay without a sample time",
            where="delay",
            remedy="give sample_time too, or leave the delay out",
        )
    if integral_limit is not None:
        return integral_lqg(plant, integral_limit)
    return _plain_lqg(plant)


def _plain_lqg(plant: GeneralisedPlant) -> Controller:
    start = perf_counter()
    regulator, observer = lqr(plant), kalman(plant)
    solved = perf_counter()
    K, Kf = regulator.gain, observer.gain.T
    system = observer_feedback(plant, K, Kf, "lqg")
    reference = observer_reference(plant, K)
    built = perf_counter()
    return finished(
        plant,
        system,
        "lqg",
        {"state_feedback": K, "observer": Kf},
        checks=_checks(plant, regulator, observer, system),
        assumptions=ASSUMPTIONS,
        seconds={"solve": solved - start, "build": built - solved},
        reference=reference,
    )


def observer_feedback(
    plant: GeneralisedPlant, K: Array, Kf: Array, name: str
) -> control.StateSpace:
    """Return u = −K x̂ with the observer x̂' = A x̂ + B₂ u + K_f (y − C₂ x̂), named.

    Parameters
    ----------
    plant : GeneralisedPlant
    K, Kf : ndarray, shapes (1, n) and (n, sensors)
    name : str
    """
    return control.StateSpace(
        plant.A - plant.B2 @ K - Kf @ plant.C2,
        Kf,
        -K,
        np.zeros((1, len(plant.sensors))),
        inputs=list(plant.sensors),
        outputs=[plant.actuator],
        states=[f"{state}_estimate" for state in plant.system.state_labels],
        name=name,
    )


def observer_reference(plant: GeneralisedPlant, K: Array) -> Reference | None:
    """Return how the reference angle enters `observer_feedback`: by commanding the state.

    u = −K(x̂ − N_x θ_ref) + N_u θ_ref, and the observer is driven by this u.  None if the
    plant does not say where its angle is (see `at_rest`).
    """
    rest = at_rest(plant)
    if rest is None:
        return None
    entry = K @ rest[0] + rest[1]
    return Reference(plant.B2 @ entry, entry)


def _checks(
    plant: GeneralisedPlant,
    regulator: RiccatiSolution,
    observer: RiccatiSolution,
    system: control.StateSpace,
) -> tuple[Check, ...]:
    expected = optimal_cost(plant, regulator, observer)
    achieved = closed_cost(plant, system).value
    return (
        Check("Riccati residual, control", regulator.residual, 1e-10),
        Check("Riccati residual, filter", observer.residual, 1e-10),
        Check("cost, Lyapunov against Riccati", abs(achieved / expected - 1), 1e-9),
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
