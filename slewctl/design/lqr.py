"""Linear-quadratic state feedback and its dual, the Kalman filter."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import DesignError, InputError
from slewctl.linalg import RiccatiSolution, solve_riccati, unobservable_modes
from slewctl.plant import GeneralisedPlant, check_plant


def lqr(
    plant: GeneralisedPlant, *, Q: Array | None = None, R: Array | None = None
) -> RiccatiSolution:
    """Return the state feedback u = −Kx that minimises the integral of zᵀz, or of xᵀQx + uᵀRu.

    Parameters
    ----------
    plant : GeneralisedPlant
    Q : array_like, shape (n, n), optional
        Weight of the plant's states, symmetric and positive semidefinite, as in
        `control.lqr`; by default that of the objective's limits.
    R : array_like, shape (1, 1), optional
        Weight of the actuator, positive.

    Returns
    -------
    RiccatiSolution
        ``gain`` is K, shape (1, n), in the plant's coordinates.

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not penalised or not reached by the torque.
    InputError
        If a weight is of the wrong shape, not symmetric or not positive (semi)definite.
    """
    check_plant(plant, "design")
    n = len(plant.A)
    weighted = plant.C1 if Q is None else _factor(Q, n, "Q")
    price = plant.D12.T @ plant.D12 if R is None else _definite(R, 1, "R")
    _check_regulator(plant, weighted, "limits" if Q is None else "Q")
    return solve_riccati(plant.A, plant.B2, weighted.T @ weighted, price)


def kalman(
    plant: GeneralisedPlant, *, W: Array | None = None, V: Array | None = None
) -> RiccatiSolution:
    """Return the stationary Kalman filter x̂' = A x̂ + B u + K_f (y − C₂ x̂).

    Parameters
    ----------
    plant : GeneralisedPlant
    W : array_like, shape (n, n), optional
        Spectral density of white noise on x', symmetric and positive semidefinite: G·QN·Gᵀ
        of `control.lqe`; by default that of the objective's torque noise.
    V : array_like, shape (sensors, sensors), optional
        Spectral density of the sensors' noise, positive definite.

    Returns
    -------
    RiccatiSolution
        The dual solution: ``gain`` is K_fᵀ, shape (sensors, n).

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not seen by the sensors.
    InputError
        As `lqr`, for W and V.
    """
    check_plant(plant, "design")
    entering = plant.B1 if W is None else _factor(W, len(plant.A), "W").T
    noise = plant.D21 @ plant.D21.T if V is None else _definite(V, len(plant.sensors), "V")
    _check_filter(plant)
    return solve_riccati(plant.A.T, plant.C2.T, entering @ entering.T, noise)


def _symmetric(value: object, size: int, name: str) -> Array:
    """Return a weight as a symmetric matrix; refuse what is none."""
    remedy = f"give a symmetric matrix of {size} by {size} finite numbers"
    try:
        matrix = np.atleast_2d(np.asarray(value, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError("the weight is no matrix", where=name, remedy=remedy) from error
    if matrix.shape != (size, size):
        raise InputError(f"the weight has shape {matrix.shape}", where=name, remedy=remedy)
    if not np.isfinite(matrix).all():
        raise InputError("the weight is not finite", where=name, remedy=remedy)
    if np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max():
        raise InputError("the weight is not symmetric", where=name, remedy=remedy)
    return (matrix + matrix.T) / 2


def _scaled_eigenvalues(matrix: Array) -> tuple[Array, Array, Array]:
    """Return scale, eigenvalues and vectors with matrix = diag(scale)·VΛVᵀ·diag(scale).

    The scale makes the diagonal one: states are measured in units of very different size.
    """
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0] = 1.0
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    return scale, values, vectors


def _factor(value: object, size: int, name: str) -> Array:
    """Return F with FᵀF = value; refuse what is not positive semidefinite."""
    scale, values, vectors = _scaled_eigenvalues(_symmetric(value, size, name))
    if values[0] < -1e-12 * max(values[-1], 0.0) or values[-1] < 0:
        raise InputError(
            "the weight is not positive semidefinite",
            where=name,
            remedy="give one whose eigenvalues are not negative",
        )
    kept = values > 0
    if not kept.any():
        return np.zeros((1, size))
    return np.sqrt(values[kept])[:, None] * vectors.T[kept] * scale


def _definite(value: object, size: int, name: str) -> Array:
    """Return a weight; refuse what is not positive definite."""
    matrix = _symmetric(value, size, name)
    if not _scaled_eigenvalues(matrix)[1][0] > np.finfo(float).eps:
        raise InputError(
            "the weight is not positive definite",
            where=name,
            remedy="give one whose eigenvalues are positive",
        )
    return matrix


def check_assumptions(plant: GeneralisedPlant) -> None:
    """Raise `DesignError` where `lqr` or `kalman` would."""
    check_plant(plant, "design")
    _check_regulator(plant, plant.C1, "limits")
    _check_filter(plant)


def _check_regulator(plant: GeneralisedPlant, weighted: Array, where: str) -> None:
    _refuse(
        plant.A,
        unobservable_modes(plant.A, weighted),
        "is not penalised",
        where,
        "add a limit that moves with it, such as limits.tip or limits.theta"
        if where == "limits"
        else "give it a weight",
    )
    _refuse(
        plant.A,
        unobservable_modes(plant.A.T, plant.B2.T),
        "is not reached by the torque",
        "torque",
        "leave it out",
    )


def _check_filter(plant: GeneralisedPlant) -> None:
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
