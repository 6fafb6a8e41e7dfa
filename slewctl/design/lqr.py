"""Linear-quadratic state feedback and its dual, the Kalman filter."""

from __future__ import annotations

import numpy as np

from slewctl._types import ComplexArray
from slewctl.errors import DesignError
from slewctl.linalg import RiccatiSolution, solve_riccati, unobservable_modes
from slewctl.plant import GeneralisedPlant


def lqr(plant: GeneralisedPlant) -> RiccatiSolution:
    """Return the state feedback u = −Kx that minimises the integral of zᵀz.

    Parameters
    ----------
    plant : GeneralisedPlant

    Returns
    -------
    RiccatiSolution
        ``gain`` is K, shape (1, n), in the plant's coordinates.

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not penalised or not reached by the torque.
    """
    A, B = plant.A, plant.B2
    _refuse(
        unobservable_modes(A, plant.C1),
        "is not penalised",
        "limits",
        "add a limit that moves with it, such as limits.tip or limits.theta",
    )
    _refuse(unobservable_modes(A.T, B.T), "is not reached by the torque", "torque", "leave it out")
    return solve_riccati(A, B, plant.C1.T @ plant.C1, plant.D12.T @ plant.D12)


def kalman(plant: GeneralisedPlant) -> RiccatiSolution:
    """Return the stationary Kalman filter x̂' = A x̂ + B u + K_f (y − C₂ x̂).

    Parameters
    ----------
    plant : GeneralisedPlant

    Returns
    -------
    RiccatiSolution
        The dual solution: ``gain`` is K_fᵀ, shape (sensors, n).

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not seen by the sensors.
    """
    A, C = plant.A, plant.C2
    _refuse(
        unobservable_modes(A, C),
        "is not seen by any sensor",
        "noise",
        "add a sensor such as noise.theta",
    )
    return solve_riccati(A.T, C.T, plant.B1 @ plant.B1.T, plant.D21 @ plant.D21.T)


def _refuse(modes: ComplexArray, what: str, where: str, remedy: str) -> None:
    if len(modes):
        frequency = np.abs(modes).min() / (2 * np.pi)
        mode = "the rigid-body rotation" if frequency < 1e-6 else f"the mode at {frequency:.4g} Hz"
        raise DesignError(f"{mode} {what}", where=where, remedy=remedy)
