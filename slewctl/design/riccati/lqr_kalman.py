"""Linear-quadratic state feedback and its dual, the Kalman filter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design.breakdown import check_finite, guarded
from slewctl.design.result import Check
from slewctl.errors import DesignError, InputError
from slewctl.numerics.matrix_equations import (
    H2Cost,
    Regulator,
    RiccatiSolution,
    full_column_rank,
    solve_discrete_riccati,
)
from slewctl.numerics.observability import unobservable_modes
from slewctl.plant import GeneralisedPlant, check_plant, continuous_equivalent


@guarded
def lqr(
    plant: GeneralisedPlant, *, Q: Array | None = None, R: Array | None = None
) -> RiccatiSolution:
    """Return the state feedback u = −Kx that minimises the integral of zᵀz, or of xᵀQx + uᵀRu.

    Of a sampled plant the sum over its samples.

    Parameters
    ----------
    plant : GeneralisedPlant
        Continuous or sampled; D₁₂ᵀC₁ need not be zero.
    Q : array_like, shape (n, n), optional
        Weight of the plant's states, symmetric and positive semidefinite, as in
        `control.lqr`; by default that of z.
    R : array_like, shape (1, 1), optional
        Weight of the actuator, positive.  With Q or R given there is no cross term.

    Returns
    -------
    RiccatiSolution
        ``gain`` is K, shape (1, n), in the plant's coordinates.

    Raises
    ------
    DesignError
        If a mode on the edge of stability is not penalised, one that is not stable by itself
        not reached by the actuator, or the actuator is free.
    InputError
        If a weight is of the wrong shape, not symmetric or not positive (semi)definite.
    """
    check_plant(plant, "design", sampled=True)
    n = len(plant.A)
    C, D = plant.C1, plant.D12
    if Q is not None or R is not None:
        states = C if Q is None else _factor(Q, n, "Q")
        control = D if R is None else np.linalg.cholesky(_definite(R, 1, "R")).T
        C = np.vstack([states, np.zeros((len(control), n))])
        D = np.vstack([np.zeros((len(states), 1)), control])
    _check_regulator(plant, C, D, "limits" if Q is None else "Q")
    return _solved(plant, plant.A, plant.B2, C, D)


@guarded
def kalman(
    plant: GeneralisedPlant, *, W: Array | None = None, V: Array | None = None
) -> RiccatiSolution:
    """Return the stationary Kalman filter x̂' = A x̂ + B₂u + K_f (y − C₂ x̂ − D₂₂u).

    Of a sampled plant the predictor x̂⁺ = A x̂ + …, as `control.dlqe` has it.

    Parameters
    ----------
    plant : GeneralisedPlant
        Continuous or sampled; B₁D₂₁ᵀ need not be zero.
    W : array_like, shape (n, n), optional
        Spectral density of white noise on x', symmetric and positive semidefinite: G·QN·Gᵀ
        of `control.lqe`; by default that of w.
    V : array_like, shape (sensors, sensors), optional
        Spectral density of the sensors' noise, positive definite.  With W or V given the two
        are independent.

    Returns
    -------
    RiccatiSolution
        The dual solution: ``gain`` is K_fᵀ, shape (sensors, n).

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not seen by the sensors, one on the edge of
        stability not excited, or a measurement has no noise.
    InputError
        As `lqr`, for W and V.
    """
    check_plant(plant, "design", sampled=True)
    n, sensors = len(plant.A), len(plant.sensors)
    C, D = plant.B1.T, plant.D21.T
    if W is not None or V is not None:
        states = C if W is None else _factor(W, n, "W")
        noise = D if V is None else np.linalg.cholesky(_definite(V, sensors, "V")).T
        C = np.vstack([states, np.zeros((len(noise), n))])
        D = np.vstack([np.zeros((len(states), sensors)), noise])
    _check_filter(plant, C, D)
    return _solved(plant, plant.A.T, plant.C2.T, C, D)


def _solved(plant: GeneralisedPlant, A: Array, B: Array, C: Array, D: Array) -> RiccatiSolution:
    """Return the feedback that minimises |Cx + Du|² on the plant's clock."""
    if plant.sample_time:
        found = solve_discrete_riccati(A, B, C.T @ C, D.T @ D, C.T @ D)
    else:
        found = Regulator.of(A, B, C, D).solve()
    check_finite(found.gain)
    return found


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


def check_assumptions(plant: GeneralisedPlant, where: str = "design") -> None:
    """Refuse a continuous plant that has no H2 optimum, or that `lqr` or `kalman` refuses."""
    check_plant(plant, where)
    check_finite_cost(plant)
    _check_regulator(plant, plant.C1, plant.D12, "limits")
    _check_filter(plant, plant.B1.T, plant.D21.T)


def check_finite_cost(plant: GeneralisedPlant) -> None:
    """Refuse a continuous plant with white noise passing straight to z: D₁₁ not zero."""
    passed = np.argwhere(plant.D11)
    if not plant.sample_time and len(passed):
        z, w = (int(i) for i in passed[0])
        raise DesignError(
            f"{plant.linear.input_labels[w]} reaches {plant.linear.output_labels[z]} without "
            "delay: white noise gives it an infinite variance",
            where="D11",
            remedy="put a lag between them, or leave that output out of z",
        )


def _check_regulator(plant: GeneralisedPlant, C: Array, D: Array, where: str) -> None:
    if not full_column_rank(D):
        raise DesignError(
            f"the {plant.actuator} has no penalty",
            where=where,
            remedy=f"add limits.{plant.actuator}" if plant.objective else "give z a row of it",
        )
    kept = Regulator.of(plant.A, plant.B2, C, D)
    _refuse(
        plant,
        _hidden(plant, kept.A, kept.C, only_on_the_edge=True),
        "is not penalised",
        where,
        "give it a weight"
        if where == "Q"
        else "add a limit that moves with it, such as limits.tip or limits.theta"
        if plant.objective
        else "give z a row that moves with it",
    )
    _refuse(
        plant,
        _hidden(plant, plant.A.T, plant.B2.T),
        f"is not reached by the {plant.actuator}",
        plant.actuator,
        "leave it out",
    )


def _check_filter(plant: GeneralisedPlant, C: Array, D: Array) -> None:
    if not full_column_rank(D):
        raise DesignError(
            "a measurement has no noise of its own",
            where="noise",
            remedy="give every sensor a noise density > 0",
        )
    _refuse(
        plant,
        _hidden(plant, plant.A, plant.C2),
        "is not seen by any sensor",
        "noise",
        "add a sensor of the angle itself, such as noise.theta"
        if plant.objective
        else "add a sensor that sees it",
    )
    excited = Regulator.of(plant.A.T, plant.C2.T, C, D)
    _refuse(
        plant,
        _hidden(plant, excited.A, excited.C, only_on_the_edge=True),
        "is not excited by any disturbance",
        "noise",
        "damp it, or give it a disturbance of its own",
    )


def _hidden(
    plant: GeneralisedPlant, A: Array, C: Array, *, only_on_the_edge: bool = False
) -> ComplexArray:
    sampled = plant.sample_time > 0
    found = unobservable_modes(A, C, sampled=sampled, only_on_the_edge=only_on_the_edge)
    return continuous_equivalent(found, plant.sample_time) if sampled else found


def _refuse(
    plant: GeneralisedPlant, modes: ComplexArray, what: str, where: str, remedy: str
) -> None:
    if len(modes):
        slowest = complex(modes[np.argmin(np.abs(modes))])
        raise DesignError(f"{_named(plant, slowest)} {what}", where=where, remedy=remedy)


def _named(plant: GeneralisedPlant, pole: complex) -> str:
    """Return a pole in rad/s in the words of the plant at hand."""
    if abs(pole) <= 1e-9 * np.abs(np.linalg.eigvals(plant.A)).max() and plant.model is not None:
        return "the rigid-body rotation"
    if pole.imag:
        return f"the mode at {abs(pole) / (2 * np.pi):.4g} Hz"
    return f"the pole at {pole.real:.4g} rad/s"


def optimum_checks(
    regulator: RiccatiSolution, observer: RiccatiSolution, optimum: float
) -> Callable[[H2Cost], tuple[Check, ...]]:
    """Return the checks of an LQG controller, given the cost that it was found to achieve."""

    def checks(achieved: H2Cost) -> tuple[Check, ...]:
        return (
            Check("Riccati residual, control", regulator.residual, 1e-10),
            Check("Riccati residual, filter", observer.residual, 1e-10),
            Check("cost, Lyapunov against Riccati", abs(achieved.value / optimum - 1), 1e-9),
        )

    return checks
