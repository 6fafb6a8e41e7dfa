"""Matrix equations of control, solved in balanced coordinates and checked.

Flexible plants mix displacements of 1e-6 m with rates of 1 rad/s and frequencies over
four decades.  Each routine therefore scales the states first, and returns beside
its result how well an independent computation confirms it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.linalg import (
    LinAlgError,
    schur,
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_triangular,
)
from scipy.linalg.lapack import dtrsyl

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.numerics.balance import balance, balance_realisation
from slewctl.numerics.ordered_schur import ordered_schur


@dataclass(frozen=True, eq=False)
class RiccatiSolution:
    """The stabilising solution of AᵀX + XA − XBR⁻¹BᵀX + Q = 0 and its gain.

    Attributes
    ----------
    X : ndarray, shape (n, n)
    gain : ndarray, shape (m, n)
        R⁻¹BᵀX.
    residual : float
        Norm of the equation's left side over that of its largest term, balanced.
    """

    X: Array
    gain: Array
    residual: float


def solve_riccati(
    A: Array, B: Array, Q: Array, R: Array, *, refine: bool = True, near: Array | None = None
) -> RiccatiSolution:
    """Return the stabilising solution of the continuous-time Riccati equation.

    Parameters
    ----------
    A, B, Q, R : ndarray, shapes (n, n), (n, m), (n, n), (m, m)
    refine : bool
        Whether to go on until only rounding is left: without, a residual of up to 1e-7 may
        remain, and nobody has looked whether the solution stabilises.
    near : ndarray, shape (m, n), optional
        A gain that may be near to the optimal one, with which to begin unless refined.

    Raises
    ------
    AccuracyError
        If there is no stabilising solution to working precision.
    """
    root = np.asarray(np.linalg.cholesky(R), dtype=float)
    priced = solve_triangular(root, B.T, lower=True).T  # B R^(−T/2)
    return in_better_scale(
        lambda scale: _solve(A, priced, Q, root, scale, refine, near), A, priced, Q
    )


def in_better_scale(
    solve: Callable[[Array], RiccatiSolution], A: Array, B: Array, Q: Array
) -> RiccatiSolution:
    """Return what is solved in scales of states that prices set, or where A's own are better.

    They are where prices differ from A by many decades.

    Parameters
    ----------
    solve : callable
        From scales.
    A, B, Q : ndarray, shapes (n, n), (n, m), (n, n)
    """
    try:
        found = solve(balance_priced(A, B, Q))
    except AccuracyError:
        return solve(balance(A))
    if found.residual > _DOUBTFUL:
        with suppress(AccuracyError):
            found = min(found, solve(balance(A)), key=lambda each: each.residual)
    return found


def balance_priced(A: Array, B: Array, Q: Array) -> Array:
    """Return state scales for which A, B and the roots of Q are of comparable size.

    A alone says nothing of an angle's unit beside its rate's, or of a lag's beside what it
    drives: couplings that go one way only.

    Parameters
    ----------
    A, B, Q : ndarray, shapes (n, n), (n, m), (n, n)
    """
    return balance_realisation(A, B, np.diag(np.sqrt(np.maximum(np.diag(Q), 0.0))))


def _solve(
    A: Array, B: Array, Q: Array, root: Array, scale: Array, refine: bool, near: Array | None
) -> RiccatiSolution:
    """Return the solution in states of another scale; B with R^(−T/2), of which R is the root."""
    outer = np.outer(scale, scale)
    As, Bs, Qs = A / scale[:, None] * scale, B / scale[:, None], Q * outer
    # Time in units of 1/‖A‖ and X in units that make Q and BBᵀ equally large: the solver's
    # tests for symplecticity are absolute, and would refuse an arm measured in millimetres.
    largest = 2 if refine else None  # one that takes a tenth of the time does for a first look
    rate = norm_or_one(As, largest)
    size = np.sqrt(norm_or_one(Qs, largest)) / norm_or_one(Bs, largest)
    An, Bn, Qn = As / rate, Bs * np.sqrt(size / rate), Qs / (size * rate)
    found = None
    if near is not None and not refine:
        found = _from_gain(An, Bn, Qn, root.T @ (near * scale) / np.sqrt(size * rate))
    X, residual = found or _solved(An, Bn, Qn, refine)
    gain = solve_triangular(root.T, Bs.T @ (size * X)) / scale
    return RiccatiSolution(size * X / outer, gain, residual)


def solve_lyapunov(A: Array, Q: Array) -> Array:
    """Return the solution of AX + XAᵀ = Q, whose accuracy the caller looks after.

    Parameters
    ----------
    A, Q : ndarray, shape (n, n)
    """
    with warnings.catch_warnings():
        # "An eigenvalue pair whose sum is near zero": so it is beside one that is far away.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(solve_continuous_lyapunov(A, Q), dtype=float)


# With a larger one than a solution without refinement may leave, other scales are tried.
_DOUBTFUL = 1e-6
# With a residual so small a solution is as good as rounding lets it be.
_SOLVED = 1e-13
# From a gain that leaves more than this other ways are shorter; with this little it is found.
NEAR, LEFT = 1e-2, 1e-9
# Newton steps at most, and the relative change of a gain after which none is needed.
MOST_STEPS, STILL = 6, 1e-8


def _solved(A: Array, B: Array, Q: Array, refine: bool = True) -> tuple[Array, float]:
    """Return the stabilising solution with R = I and its relative residual.

    From the Schur form of the Hamiltonian (Laub, IEEE Trans. Automatic Control 24, 1979),
    and only where that fails from the pencil of scipy, which takes five times as long.
    """
    if (quick := _of_hamiltonian(A, B, Q)) is not None:
        if not refine:
            return quick, _residual(A, B, Q, quick)
        found = _refined(A, B, Q, quick)
        if found[1] <= _SOLVED and _stabilises(A, B, found[0]):
            return found
    return _refined(A, B, Q, _stabilising(A, B, Q))


def _of_hamiltonian(A: Array, B: Array, Q: Array) -> Array | None:
    """Return the solution spanned by the Hamiltonian's stable subspace, if it has one."""
    n = len(A)
    try:
        _, U, stable = ordered_schur(
            np.block([[A, -B @ B.T], [-Q, -A.T]]), lambda poles: poles.real < 0
        )
        X = np.linalg.solve(U[:n, :n].T, U[n:, :n].T) if stable == n else None
    except LinAlgError:
        return None
    return None if X is None or not np.isfinite(X).all() else (X + X.T) / 2


def _refined(A: Array, B: Array, Q: Array, X: Array) -> tuple[Array, float]:
    """Return a solution after Newton steps, and its relative residual.

    The eigenvectors of a lightly damped plant leave a residual of up to 1e-7 behind, a
    Lyapunov equation with the closed loop removes it.  One step does where it moves the gain
    of no input by more than a part in 1e8: what is left is the square of that.  Inputs whose
    prices differ by millions need a few.
    """
    for _ in range(MOST_STEPS):
        step = solve_lyapunov((A - B @ B.T @ X).T, -_riccati_defect(A, B, Q, X)[0])
        step = (step + step.T) / 2
        X = X + step
        moved, gain = (np.linalg.norm(B.T @ each, axis=1) for each in (step, X))
        if np.all(moved <= STILL * gain):
            break
    return X, _residual(A, B, Q, X)


def _from_gain(A: Array, B: Array, Q: Array, gain: Array) -> tuple[Array, float] | None:
    """Return the solution and its residual from a gain near to it; None if that is not so near.

    Kleinman, IEEE Trans. Automatic Control 13 (1968): the cost of a gain that stabilises, then
    that of the better gain which follows from it.  Each leaves the square of how far it moved.
    """
    residual = NEAR
    while residual > LEFT:
        T, Z = schur((A - B @ gain).T, output="real")
        if np.diagonal(T).max() >= 0:
            return None
        cost = Q + gain.T @ gain
        X, scale, _ = dtrsyl(T, T, -Z.T @ cost @ Z, tranb="T")
        X = Z @ (X * scale) @ Z.T
        better = B.T @ X
        left = float(np.linalg.norm(better - gain) ** 2 / np.linalg.norm(cost))
        if not left < residual:
            return None
        gain, residual = better, left
    return (X + X.T) / 2, residual


def _residual(A: Array, B: Array, Q: Array, X: Array) -> float:
    defect, largest = _riccati_defect(A, B, Q, X)
    return float(np.linalg.norm(defect) / largest) if largest else 0.0


def _stabilises(A: Array, B: Array, X: Array) -> bool:
    return bool(np.linalg.eigvals(A - B @ B.T @ X).real.max() < 0)


@dataclass(frozen=True, eq=False)
class Regulator:
    """The cost |C x + D u|² of ẋ = A x + B u (or x⁺ = …) written as |C' x|² + |v|².

    Attributes
    ----------
    A, B, C : ndarray
        Of the problem in v: A − B·gain, B·root⁻¹ and C − D·gain.
    gain, root : ndarray, shapes (m, n) and (m, m)
        v = root (u + gain·x): the preliminary feedback without which C and D are orthogonal.
    """

    A: Array
    B: Array
    C: Array
    gain: Array
    root: Array

    @classmethod
    def of(cls, A: Array, B: Array, C: Array, D: Array) -> Regulator:
        """Return the problem of a cost; D must have full column rank (`full_column_rank`)."""
        directions, root = np.linalg.qr(D)
        signs = np.where(np.diag(root) < 0, -1.0, 1.0)
        directions, root = directions * signs, root * signs[:, None]
        # What is rounding alone is nothing: C may be orthogonal to D, whose part of A would then
        # be couplings of 1e-22 that balancing takes for some; or lie along it and cost nothing.
        noise = 8 * np.finfo(float).eps * np.linalg.norm(C, axis=0)
        seen = _above(directions.T @ C, noise)
        gain = solve_triangular(root, seen)
        scaled = solve_triangular(root, B.T, trans="T").T
        kept = _above(C - directions @ seen, noise)
        return cls(A - B @ gain, scaled, kept, gain, root)

    def solve(self, *, refine: bool = True, near: Array | None = None) -> RiccatiSolution:
        """Return the continuous optimum u = −K x, from a K near to it; see `solve_riccati`."""
        R = np.eye(len(self.root))
        if near is not None:
            near = self.root @ (near - self.gain)
        found = solve_riccati(self.A, self.B, self.C.T @ self.C, R, refine=refine, near=near)
        gain = self.gain + solve_triangular(self.root, found.gain)
        return RiccatiSolution(found.X, gain, found.residual)


def _above(values: Array, noise: Array) -> Array:
    return np.where(np.abs(values) <= noise, 0.0, values)


def full_column_rank(D: Array) -> bool:
    """Return whether the columns of a matrix, each in its own unit, are independent."""
    size = np.abs(D).max(axis=0, initial=0.0)
    if not len(D) or not np.all(size > 0):
        return False
    return bool(np.linalg.svd(D / size, compute_uv=False)[-1] > 1e-9 and len(D) >= D.shape[1])


def norm_or_one(matrix: Array, order: int | None = 2) -> float:
    """Return the norm of a matrix, or one where there is nothing to scale by."""
    if not np.isfinite(matrix).all():
        raise AccuracyError(
            "the squares of weights or noises are beyond what can be computed with",
            where="riccati",
            remedy="bring limits and noises closer together, or measure in other units",
        )
    return float(np.linalg.norm(matrix, order)) or 1.0


def _stabilising(A: Array, B: Array, Q: Array) -> Array:
    """Return the solution of AᵀX + XA − XBBᵀX + Q = 0 that makes A − BBᵀX stable."""
    refusal = AccuracyError(
        "the Riccati equation has no stabilising solution to working precision",
        where="riccati",
        remedy="check that every undamped mode is penalised and reached by noise, and that "
        "limits and noises are of sensible size against each other; leave out lags millions of "
        "times as fast as the arm",
    )
    try:
        X = np.asarray(solve_continuous_are(A, B, Q, np.eye(B.shape[1])), dtype=float)
    except (LinAlgError, ValueError) as error:
        raise refusal from error
    if not _stabilises(A, B, X):
        raise refusal
    return X


def _riccati_defect(A: Array, B: Array, Q: Array, X: Array) -> tuple[Array, float]:
    """Return the equation's left side with R = I, and the norm of its largest term."""
    half = B.T @ X
    terms = (A.T @ X + X @ A, half.T @ half, Q)
    largest = max(float(np.linalg.norm(term)) for term in terms)
    return terms[0] - terms[1] + terms[2], largest


def stability_threshold(A: Array) -> float:
    """Return how far left of the axis a computed eigenvalue must lie to count as stable.

    Eigenvalues of a balanced matrix carry an error of about ε‖A‖; nothing closer to the
    axis than that can be called stable.
    """
    scale = balance(A)
    return float(len(A) * np.finfo(float).eps * np.linalg.norm(A / scale[:, None] * scale, 2))
