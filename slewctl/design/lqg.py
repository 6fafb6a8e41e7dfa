"""LQG: the H2-optimal output feedback, from two Riccati equations."""

from __future__ import annotations

import control
import numpy as np

from slewctl._types import Array
from slewctl.design.lqr import kalman, lqr
from slewctl.design.result import Check, Controller, finished
from slewctl.linalg import RiccatiSolution, h2_cost
from slewctl.plant import GeneralisedPlant


def lqg(plant: GeneralisedPlant) -> Controller:
    """Return the controller that minimises the H2 norm from w to z.

    Parameters
    ----------
    plant : GeneralisedPlant
        Made from the model that the designer has, never from the truth.

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
    """
    regulator, observer = lqr(plant), kalman(plant)
    K, Kf = regulator.gain, observer.gain.T
    system = observer_feedback(plant, K, Kf, "lqg")
    return finished(
        plant,
        system,
        "lqg",
        {"state_feedback": K, "observer": Kf},
        checks=_checks(plant, regulator, observer, system),
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


def _checks(
    plant: GeneralisedPlant,
    regulator: RiccatiSolution,
    observer: RiccatiSolution,
    system: control.StateSpace,
) -> tuple[Check, ...]:
    expected = optimal_cost(plant, regulator, observer)
    closed = plant.close(system)
    achieved = h2_cost(*(np.asarray(getattr(closed, name)) for name in "ABC")).value
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
