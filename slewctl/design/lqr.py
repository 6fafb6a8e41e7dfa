"""Linear-quadratic state feedback and its dual, the Kalman filter."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import DesignError
from slewctl.linalg import RiccatiSolution, solve_riccati, unobservable_modes
from slewctl.plant import GeneralisedPlant, check_plant


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
    _check_regulator(plant)
    return solve_riccati(plant.A, plant.B2, plant.C1.T @ plant.C1, plant.D12.T @ plant.D12)


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
    _check_filter(plant)
    return solve_riccati(plant.A.T, plant.C2.T, plant.B1 @ plant.B1.T, plant.D21 @ plant.D21.T)


def check_assumptions(plant: GeneralisedPlant) -> None:
    """Raise `DesignError` where `lqr` or `kalman` would."""
    _check_regulator(plant)
    _check_filter(plant)


def _check_regulator(plant: GeneralisedPlant) -> None:
    check_plant(plant, "design")
    _refuse(
        plant.A,
        unobservable_modes(plant.A, plant.C1),
        "is not penalised",
        "limits",
        "add a limit that moves with it, such as limits.tip or limits.theta",
    )
    _refuse(
        plant.A,
        unobservable_modes(plant.A.T, plant.B2.T),
        "is not reached by the torque",
        "torque",
        "leave it out",
    )


def _check_filter(plant: GeneralisedPlant) -> None:
    check_plant(plant, "design")
    _refuse(
        plant.A,
        unobservable_modes(plant.A, plant.C2),
        "is not seen by any sensor",
        "noise",
        "add a sensor of the angle itself, such as noise.theta",
    )


def _refuse(A: Array, modes: ComplexArray, what: str, where: str, remedy: str) -> None:
    if len(modes):
        slowest = np.abs(modes).min()
        rigid = slowest <= 1e-9 * np.abs(np.linalg.eigvals(A)).max()
        mode = "the rigid-body rotation" if rigid else f"the mode at {slowest / (2 * np.pi):.4g} Hz"
        raise DesignError(f"{mode} {what}", where=where, remedy=remedy)
