"""Linear-quadratic state feedback and its dual, the Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias, cast

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design.breakdown import check_finite
from slewctl.design.result import Check
from slewctl.errors import DesignError, InputError
from slewctl.numerics.discrete_equations import solve_discrete_riccati
from slewctl.numerics.h2_norm import H2Cost
from slewctl.numerics.matrix_equations import Regulator, RiccatiSolution, full_column_rank
from slewctl.numerics.modes import at_origin
from slewctl.numerics.observability import unobservable_modes, unreachable_modes
from slewctl.plant import GeneralisedPlant, check_plant, continuous_equivalent


@dataclass(frozen=True, eq=False)
class Plain:
    """Matrices without names, objective or arm, where a generalised plant could stand.

    Attributes
    ----------
    A, B2 : ndarray, shapes (n, n) and (n, m)
    seen : ndarray or None
    sample_time : float
    """

    A: Array
    B2: Array
    seen: Array | None
    sample_time: float
    actuator: str = "input"
    objective: None = None
    model: None = None

    @property
    def C2(self) -> Array:
        """States to measurements; none where nothing is measured."""
        return np.zeros((0, len(self.A))) if self.seen is None else self.seen


AnyPlant: TypeAlias = GeneralisedPlant | Plain


def optimal_feedback(
    plant: AnyPlant, *, Q: object = None, R: object = None, N: object = None
) -> RiccatiSolution:
    """Return what `slewctl.lqr` returns, as a solution of the Riccati equation.

    Parameters
    ----------
    plant : GeneralisedPlant or Plain
        The former has weights of its own.
    Q, R, N : array_like, optional
        With Q or R given there is no cross term but N.
    """
    n, m = plant.B2.shape
    if Q is None and R is None:
        if N is not None:
            raise InputError("a cross term alone", where="N", remedy="give Q and R too")
        plant = _generalised(plant)
        C, D, where = plant.C1, plant.D12, "limits"
    else:
        if isinstance(plant, GeneralisedPlant):
            check_plant(plant, "design", sampled=True)
        whole = plant.D12 if isinstance(plant, GeneralisedPlant) else np.zeros((0, m))
        root = np.asarray(whole if R is None else np.linalg.cholesky(_definite(R, m, "R")).T)
        cross = np.zeros((len(root), n)) if N is None else _cross(N, root, n)
        if Q is None:
            states = _generalised(plant).C1
        else:
            states = _factor(_symmetric(Q, n, "Q") - cross.T @ cross, n, "Q")
        C = np.vstack([states, cross])
        D = np.vstack([np.zeros((len(states), m)), root])
        where = "limits" if Q is None else "Q"
    return weighted_feedback(plant, C, D, where)


def weighted_feedback(plant: AnyPlant, C: Array, D: Array, where: str) -> RiccatiSolution:
    """Return the feedback that minimises |Cx + Du|²; `where` has the weights, for messages."""
    _check_regulator(plant, C, D, where)
    return _solved(plant, plant.A, plant.B2, C, D)


def weighted_filter(plant: AnyPlant, C: Array, D: Array) -> RiccatiSolution:
    """Return the dual: the filter for noise Cᵀw on x' and Dᵀw on the measurements."""
    _check_filter(plant, C, D)
    return _solved(plant, plant.A.T, plant.C2.T, C, D)


def optimal_filter(plant: AnyPlant, *, W: object = None, V: object = None) -> RiccatiSolution:
    """Return the dual of what `slewctl.kalman` returns: ``gain`` is Lᵀ.

    Parameters
    ----------
    plant : GeneralisedPlant or Plain
    W, V : array_like, optional
        Spectral densities of noise on x' and on the sensors, independent.
    """
    n, sensors = len(plant.A), len(plant.C2)
    if W is None and V is None:
        plant = _generalised(plant)
        C, D = plant.B1.T, plant.D21.T
    else:
        states = _generalised(plant).B1.T if W is None else _factor(W, n, "W")
        noise = (
            _generalised(plant).D21.T
            if V is None
            else np.linalg.cholesky(_definite(V, sensors, "V")).T
        )
        C = np.vstack([states, np.zeros((len(noise), n))])
        D = np.vstack([np.zeros((len(states), sensors)), noise])
    return weighted_filter(plant, C, D)


def _generalised(plant: object) -> GeneralisedPlant:
    """Return a plant that has weights and noise of its own; refuse anything else."""
    check_plant(plant, "design", sampled=True)
    return cast("GeneralisedPlant", plant)


def _cross(N: object, root: Array, n: int) -> Array:
    """Return R^(−T/2) Nᵀ, the part of the states' weight that goes with the inputs."""
    remedy = f"give a matrix of {n} by {len(root)} finite numbers"
    try:
        matrix = np.atleast_2d(np.asarray(N, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError("the cross term is no matrix", where="N", remedy=remedy) from error
    if matrix.shape != (n, len(root)) or not np.isfinite(matrix).all():
        raise InputError(f"the cross term has shape {matrix.shape}", where="N", remedy=remedy)
    return np.asarray(np.linalg.solve(root.T, matrix.T))


def _solved(plant: AnyPlant, A: Array, B: Array, C: Array, D: Array) -> RiccatiSolution:
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


def _check_regulator(plant: AnyPlant, C: Array, D: Array, where: str) -> None:
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
        _on_clock(plant, unreachable_modes(plant.A, plant.B2, sampled=plant.sample_time > 0)),
        f"is not reached by the {plant.actuator}",
        plant.actuator,
        "leave it out",
    )


def _check_filter(plant: AnyPlant, C: Array, D: Array) -> None:
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
        _on_clock(
            plant,
            unreachable_modes(
                excited.A.T, excited.C.T, sampled=plant.sample_time > 0, only_on_the_edge=True
            ),
        ),
        "is not excited by any disturbance",
        "noise",
        "damp it, or give it a disturbance of its own",
    )


def _hidden(plant: AnyPlant, A: Array, C: Array, *, only_on_the_edge: bool = False) -> ComplexArray:
    sampled = plant.sample_time > 0
    found = unobservable_modes(A, C, sampled=sampled, only_on_the_edge=only_on_the_edge)
    return _on_clock(plant, found)


def _on_clock(plant: AnyPlant, poles: ComplexArray) -> ComplexArray:
    """Return poles of a plant in rad/s."""
    return continuous_equivalent(poles, plant.sample_time) if plant.sample_time else poles


def _refuse(plant: AnyPlant, modes: ComplexArray, what: str, where: str, remedy: str) -> None:
    if len(modes):
        slowest = complex(modes[np.argmin(np.abs(modes))])
        raise DesignError(f"{_named(plant, slowest)} {what}", where=where, remedy=remedy)


def _named(plant: AnyPlant, pole: complex) -> str:
    """Return a pole in rad/s in the words of the plant at hand."""
    own = np.array([pole])
    if plant.model is not None and at_origin(own, float(np.linalg.norm(plant.A, 2))).all():
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
