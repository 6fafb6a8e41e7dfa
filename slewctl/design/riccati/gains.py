"""`lqr`, `kalman`, `dlqr`, `dlqe` of a plant, a system or matrices, as python-control has them.

Each result has names, and unpacks as python-control's tuples do: gain, solution, poles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from slewctl._show import Described
from slewctl._types import Array, ComplexArray
from slewctl.design.breakdown import guarded
from slewctl.design.riccati.lqr_kalman import Plain, optimal_feedback, optimal_filter
from slewctl.errors import InputError, shown
from slewctl.numerics.given_system import read_matrix
from slewctl.numerics.linear_system import clock_unknown, linear
from slewctl.numerics.matrix_equations import RiccatiSolution
from slewctl.plant import GeneralisedPlant

_CONTINUOUS = {"dlqr": "lqr", "dlqe": "kalman"}


@dataclass(frozen=True, eq=False, repr=False)
class QuadraticGain(Described):
    """A feedback or filter gain, the solution of its Riccati equation, and what it makes.

    Unpacks as in python-control: ``K, S, E = lqr(…)``, ``L, P, E = kalman(…)``.

    Attributes
    ----------
    gain : ndarray
        K, shape (inputs, n), of u = −Kx; or L, shape (n, outputs), of x̂' = … + L(y − ŷ).
    solution : ndarray, shape (n, n)
        S, with xᵀSx the cost to go; or P, the covariance of the estimation error.
    poles : ndarray of complex
        Of A − BK, or of A − LC: in rad/s, or in the z-plane.
    residual : float
        Of the Riccati equation, relative to its largest term.
    """

    gain: Array
    solution: Array
    poles: ComplexArray
    residual: float

    @property
    def X(self) -> Array:
        """The solution, under the letter of the Riccati equation."""
        return self.solution

    def __iter__(self) -> Iterator[Any]:
        return iter((self.gain, self.solution, self.poles))

    def __str__(self) -> str:
        rows, columns = self.gain.shape
        slowest = self.poles[np.argmin(np.abs(self.poles))] if len(self.poles) else 0
        return (
            f"gain of {rows} by {columns}, |gain| {np.linalg.norm(self.gain):.4g}, slowest pole "
            f"{slowest:.4g}, Riccati residual {self.residual:.0e}"
        )


@guarded
def lqr(plant: Any, *weights: Any, Q: Any = None, R: Any = None, N: Any = None) -> QuadraticGain:
    """Return the state feedback u = −Kx that minimises ∫ xᵀQx + uᵀRu + 2xᵀNu, or that of zᵀz.

    Called as ``lqr(plant)``, ``lqr(plant, Q=Q, R=R)``, ``lqr(sys, Q, R[, N])`` or
    ``lqr(A, B, Q, R[, N])``.  Of a sampled system the sum over its samples.

    Parameters
    ----------
    plant : GeneralisedPlant, control.StateSpace, or ndarray A
        A generalised plant has its own weights, those of z; D₁₂ᵀC₁ need not be zero.
    *weights
        B after A; then Q, R and N, by position or by name.
    Q : array_like, shape (n, n)
        Weight of the states, symmetric and positive semidefinite.
    R : array_like, shape (m, m)
        Weight of the inputs, positive definite.
    N : array_like, shape (n, m), optional
        Cross term; [[Q, N], [Nᵀ, R]] must be positive semidefinite.

    Returns
    -------
    QuadraticGain
        ``K, S, E = lqr(…)``; K has shape (m, n), in the plant's coordinates.

    Raises
    ------
    DesignError
        If a mode on the edge of stability is not penalised, one that is not stable by itself
        not reached by the input, or the input is free.
    InputError
        If a weight is missing, of the wrong shape, not symmetric or not positive (semi)definite.

    Examples
    --------
    >>> import slewctl as sc
    >>> K, S, E = sc.lqr([[0, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 0]], [[1]])
    >>> K.round(6)
    array([[1.      , 1.414214]])
    """
    if isinstance(plant, GeneralisedPlant):
        _nothing(weights, "lqr", "Q and R")
        return _feedback(plant, optimal_feedback(plant, Q=Q, R=R, N=N))
    A, B, _, step, rest = _system(plant, weights, "lqr", "B")
    Q, R, N = _named(rest, (Q, R, N), ("Q", "R", "N"), "lqr")
    return _feedback(plain := Plain(A, B, None, step), optimal_feedback(plain, Q=Q, R=R, N=N))


@guarded
def kalman(plant: Any, *given: Any, W: Any = None, V: Any = None) -> QuadraticGain:
    """Return the stationary Kalman filter x̂' = A x̂ + B u + L (y − C x̂ − D u).

    Called as ``kalman(plant)``, ``kalman(plant, W=W, V=V)``, ``kalman(sys, QN, RN)`` (noise
    QN at the inputs of `sys`) or ``kalman(A, G, C, QN, RN)``.  Of a sampled system the
    predictor x̂⁺ = A x̂ + …, as `control.dlqe` has it.

    Parameters
    ----------
    plant : GeneralisedPlant, control.StateSpace, or ndarray A
        A generalised plant has its own noise, that of w; B₁D₂₁ᵀ need not be zero.
    *given
        G and C after A; then QN and RN.
    W : array_like, shape (n, n), optional
        Of a generalised plant, spectral density of white noise on x': G·QN·Gᵀ.
    V : array_like, shape (sensors, sensors), optional
        Of a generalised plant, that of the sensors' noise, positive definite.  With W or V
        given the two are independent.

    Returns
    -------
    QuadraticGain
        ``L, P, E = kalman(…)``; L has shape (n, outputs).

    Raises
    ------
    DesignError
        If a mode that is not stable by itself is not seen by the sensors, one on the edge of
        stability not excited, or a measurement has no noise.
    InputError
        As `lqr`.

    Examples
    --------
    >>> import slewctl as sc
    >>> L, P, E = sc.kalman([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[1]], [[1]])
    >>> L.round(6).T
    array([[1.414214, 1.      ]])
    """
    if isinstance(plant, GeneralisedPlant):
        _nothing(given, "kalman", "W and V")
        return _filter(plant, optimal_filter(plant, W=W, V=V))
    A, G, C, step, rest = _system(plant, given, "kalman", "G", "C")
    if W is not None or V is not None:
        raise InputError(
            "W and V belong to a generalised plant", where="kalman", remedy="give QN and RN"
        )
    QN, RN = _named(rest, (None, None), ("QN", "RN"), "kalman")
    noise = read_matrix(QN, "QN")
    if noise.shape != (G.shape[1], G.shape[1]):
        raise InputError(
            f"the noise has shape {noise.shape}",
            where="QN",
            remedy=f"give a matrix of {G.shape[1]} by {G.shape[1]}, one row for each column of G",
        )
    plain = Plain(A, G, C, step)
    return _filter(plain, optimal_filter(plain, W=G @ noise @ G.T, V=RN))


def dlqr(plant: Any, *weights: Any, Q: Any = None, R: Any = None, N: Any = None) -> QuadraticGain:
    """Return `lqr` of matrices that are of discrete time: ``K, S, E = dlqr(A, B, Q, R[, N])``.

    Parameters
    ----------
    plant, *weights, Q, R, N
        As for `lqr`; a plant or system is sampled.

    Returns
    -------
    QuadraticGain
        E in the z-plane.

    Raises
    ------
    InputError, DesignError
        As `lqr`, and for a continuous system.

    Examples
    --------
    >>> import slewctl as sc
    >>> K, S, E = sc.dlqr([[1, 1], [0, 1]], [[0.5], [1]], [[1, 0], [0, 0]], [[1]])
    >>> bool(abs(E).max() < 1)
    True
    """
    return lqr(_discrete(plant, "dlqr"), *weights, Q=Q, R=R, N=N)


def dlqe(plant: Any, *given: Any) -> QuadraticGain:
    """Return `kalman` of matrices of discrete time: ``L, P, E = dlqe(A, G, C, QN, RN)``.

    Parameters
    ----------
    plant, *given
        As for `kalman`; a plant or system is sampled.

    Returns
    -------
    QuadraticGain
        E in the z-plane.

    Raises
    ------
    InputError, DesignError
        As `kalman`, and for a continuous system.

    Examples
    --------
    >>> import slewctl as sc
    >>> L, P, E = sc.dlqe([[1, 1], [0, 1]], [[0.5], [1]], [[1, 0]], [[1]], [[1]])
    >>> bool(abs(E).max() < 1)
    True
    """
    return kalman(_discrete(plant, "dlqe"), *given)


@dataclass(frozen=True)
class _OfDiscreteTime:
    """A state matrix that belongs to a difference equation."""

    A: object


def _discrete(plant: object, where: str) -> object:
    system = linear(plant)
    if system is None and not isinstance(plant, GeneralisedPlant):
        return _OfDiscreteTime(plant)
    step = plant.sample_time if isinstance(plant, GeneralisedPlant) else system and system.dt
    if not step:
        raise InputError(
            "the system is continuous",
            where=where,
            remedy=f"use {_CONTINUOUS[where]}, or sample it",
        )
    return plant


def _system(
    first: Any, rest: tuple[Any, ...], where: str, *names: str
) -> tuple[Array, Array, Array | None, float, tuple[Any, ...]]:
    """Return A, B (or G), C, the sample time and what follows them."""
    if clock_unknown(first):
        raise InputError("its sample time is not known", where=where, remedy="give dt in seconds")
    if (system := linear(first)) is not None:
        return system.A, system.B, system.C, system.sample_time, rest
    step = 0.0
    if isinstance(first, _OfDiscreteTime):
        first, step = first.A, 1.0
    if not isinstance(first, np.ndarray | Sequence | Real) or isinstance(first, str):
        raise InputError(
            f"{shown(first)} is not a GeneralisedPlant, a system or a matrix",
            where=where,
            remedy="make a plant with slewctl.generalised_plant(model, objective)",
        )
    if len(rest) < len(names):
        raise InputError(
            f"{names[len(rest)]} is missing after {', '.join(('A', *names[: len(rest)]))}",
            where=where,
            remedy="give a plant, a system, or matrices in the order of python-control",
        )
    A = read_matrix(first, "A")
    n = len(A)
    found = [read_matrix(matrix, name) for matrix, name in zip(rest, names, strict=False)]
    shapes = {"A": (n, n), "B": (n, -1), "G": (n, -1), "C": (-1, n)}
    for matrix, name in zip([A, *found], ["A", *names], strict=True):
        wanted = shapes[name]
        if any(size not in (-1, given) for size, given in zip(wanted, matrix.shape, strict=True)):
            raise InputError(
                f"{name} has shape {matrix.shape}",
                where=where,
                remedy=f"A has {n} rows: let its columns, the rows of B and G, and the columns "
                "of C be as many",
            )
    return A, found[0], found[1] if len(found) > 1 else None, step, rest[len(names) :]


def _nothing(given: tuple[Any, ...], where: str, names: str) -> None:
    if given:
        raise InputError(
            "a generalised plant has its own weights",
            where=where,
            remedy=f"give others by name, {names}, or a system in its place",
        )


def _named(
    rest: tuple[Any, ...], given: tuple[Any, ...], names: tuple[str, ...], where: str
) -> tuple[Any, ...]:
    """Return weights given by position or by name, once each; all but N are needed."""
    if len(rest) > len(names):
        raise InputError(
            f"{len(rest)} weights", where=where, remedy=f"give {', '.join(names)} in this order"
        )
    found = list(given)
    for i, value in enumerate(rest):
        if found[i] is not None:
            raise InputError(f"{names[i]} is given twice", where=where, remedy="give it once")
        found[i] = value
    for name, value in zip(names, found, strict=True):
        if value is None and name != "N":
            raise InputError(
                f"{name} is missing", where=where, remedy="only a generalised plant has weights"
            )
    return tuple(found)


def _feedback(plant: GeneralisedPlant | Plain, found: RiccatiSolution) -> QuadraticGain:
    poles = np.linalg.eigvals(plant.A - plant.B2 @ found.gain).astype(complex)
    return QuadraticGain(found.gain, found.X, poles, found.residual)


def _filter(plant: GeneralisedPlant | Plain, found: RiccatiSolution) -> QuadraticGain:
    gain = found.gain.T
    poles = np.linalg.eigvals(plant.A - gain @ plant.C2).astype(complex)
    return QuadraticGain(gain, found.X, poles, found.residual)
