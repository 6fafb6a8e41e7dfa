"""Matrix equations of control, solved in balanced coordinates and checked.

Flexible plants mix displacements of 1e-6 m with rates of 1 rad/s and frequencies over
four decades.  Each routine therefore balances the state matrix first, and returns beside
its result how well an independent computation confirms it.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.linalg import (
    LinAlgError,
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_triangular,
)

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.numerics.balance import balance
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
    A: Array, B: Array, Q: Array, R: Array, *, refine: bool = True
) -> RiccatiSolution:
    """Return the stabilising solution of the continuous-time Riccati equation.

    Parameters
    ----------
    A, B, Q, R : ndarray, shapes (n, n), (n, m), (n, n), (m, m)
    refine : bool
        Whether to go on until only rounding is left: without, a residual of up to 1e-7 may
        remain, and nobody has looked whether the solution stabilises.

    Raises
    ------
    AccuracyError
        If there is no stabilising solution to working precision.
    """
    scale = balance(A)
    outer = np.outer(scale, scale)
    As, Qs = A / scale[:, None] * scale, Q * outer
    root = np.linalg.cholesky(R)
    Bs = solve_triangular(root, (B / scale[:, None]).T, lower=True).T  # B R^(−T/2)
    # Time in units of 1/‖A‖ and X in units that make Q and BBᵀ equally large: the solver's
    # tests for symplecticity are absolute, and would refuse an arm measured in millimetres.
    largest = 2 if refine else None  # one that takes a tenth of the time does for a first look
    rate = _nonzero(As, largest)
    size = np.sqrt(_nonzero(Qs, largest)) / _nonzero(Bs, largest)
    An, Bn, Qn = As / rate, Bs * np.sqrt(size / rate), Qs / (size * rate)
    X, residual = _solved(An, Bn, Qn, refine)
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


# With a residual so small a solution is as good as rounding lets it be.
_SOLVED = 1e-13
# Newton steps at most, and the relative change of a gain after which none is needed.
_MOST_STEPS, _STILL = 6, 1e-8


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
    for _ in range(_MOST_STEPS):
        step = solve_lyapunov((A - B @ B.T @ X).T, -_riccati_defect(A, B, Q, X)[0])
        step = (step + step.T) / 2
        X = X + step
        moved, gain = (np.linalg.norm(B.T @ each, axis=1) for each in (step, X))
        if np.all(moved <= _STILL * gain):
            break
    return X, _residual(A, B, Q, X)


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

    def solve(self, *, refine: bool = True) -> RiccatiSolution:
        """Return the continuous optimum u = −K x; see `solve_riccati`."""
        R = np.eye(len(self.root))
        found = solve_riccati(self.A, self.B, self.C.T @ self.C, R, refine=refine)
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


def _nonzero(matrix: Array, order: int | None = 2) -> float:
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


# Squarings that a matrix of spectral radius 1 − 1e-12 needs to vanish.
_MOST_DOUBLINGS = 46


def solve_discrete_lyapunov(A: Array, Q: Array) -> Array:
    """Return the solution of X = A X Aᵀ + Q by doubling.

    R. A. Smith, SIAM J. Applied Mathematics 16 (1968): every step squares A and adds a
    positive semidefinite matrix where Q is one, so that nothing cancels.

    Parameters
    ----------
    A, Q : ndarray, shape (n, n)
        All eigenvalues of A within the unit circle; Q symmetric.

    Raises
    ------
    AccuracyError
        If the sum does not converge: A is not stable to working precision.
    """
    X, power = (Q + Q.T) / 2, A
    for _ in range(_MOST_DOUBLINGS):
        with np.errstate(over="ignore", invalid="ignore"):
            step = power @ X @ power.T
            X, power = X + (step + step.T) / 2, power @ power
            added, size = np.linalg.norm(step), np.linalg.norm(X)
        if not np.isfinite([added, size]).all() or not np.isfinite(power).all():
            break
        if added <= np.finfo(float).eps * size:
            return X
    raise AccuracyError(
        "the sampled loop is not stable to working precision",
        where="lyapunov",
        remedy="decide its stability first",
    )


def solve_discrete_riccati(
    A: Array, B: Array, Q: Array, R: Array, S: Array | None = None
) -> RiccatiSolution:
    """Return the stabilising solution of the discrete-time Riccati equation.

    X = AᵀXA − (AᵀXB + S)(R + BᵀXB)⁻¹(BᵀXA + Sᵀ) + Q, by structure-preserving doubling (Chu,
    Fan, Lin and Wang, Int. J. Control 77, 2004) and Newton steps.

    Parameters
    ----------
    A, B, Q, R : ndarray, shapes (n, n), (n, m), (n, n), (m, m)
        R positive definite.
    S : ndarray, shape (n, m), optional
        The cost 2 xᵀSu.

    Returns
    -------
    RiccatiSolution
        ``gain`` is (R + BᵀXB)⁻¹(BᵀXA + Sᵀ); the residual is relative to the largest term.

    Raises
    ------
    AccuracyError
        If there is no stabilising solution to working precision.
    """
    scale = balance(A)
    outer = np.outer(scale, scale)
    root = np.linalg.cholesky(R)
    An, Qn = A / scale[:, None] * scale, Q * outer
    Bn = solve_triangular(root, (B / scale[:, None]).T, lower=True).T
    cross = np.zeros_like(B) if S is None else S * scale[:, None]
    Sn = solve_triangular(root, cross.T, lower=True).T
    gain = _first_gain(An - Bn @ Sn.T, Bn, Qn - Sn @ Sn.T) + Sn.T
    for _ in range(2):
        X, gain = _newton_step(An, Bn, Qn, Sn, gain)
    terms = (X, An.T @ X @ An, (An.T @ X @ Bn + Sn) @ gain, Qn)
    defect = np.linalg.norm(terms[0] - terms[1] + terms[2] - terms[3])
    largest = max(float(np.linalg.norm(term)) for term in terms)
    residual = float(defect) / largest if largest else 0.0
    return RiccatiSolution(X / outer, solve_triangular(root.T, gain) / scale, residual)


def _newton_step(A: Array, B: Array, Q: Array, S: Array, gain: Array) -> tuple[Array, Array]:
    """Return the cost matrix of the feedback −gain, and the better gain that it yields."""
    closed = A - B @ gain
    if not np.abs(np.linalg.eigvals(closed)).max() < 1:
        raise _no_solution()
    cost = Q - S @ gain - gain.T @ S.T + gain.T @ gain
    X = solve_discrete_lyapunov(closed.T, cost)
    weight = np.eye(B.shape[1]) + B.T @ X @ B
    return X, np.asarray(np.linalg.solve(weight, B.T @ X @ A + S.T))


def _first_gain(A: Array, B: Array, Q: Array) -> Array:
    """Return the gain (I + BᵀXB)⁻¹BᵀXA by doubling, with X in units that make Q and BBᵀ alike."""
    size = np.sqrt(_nonzero(Q)) / _nonzero(B)
    E, G, H = A, size * B @ B.T, Q / size
    eye = np.eye(len(A))
    for _ in range(_MOST_DOUBLINGS):
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                left = np.linalg.solve(eye + G @ H, np.hstack([E, G]))
            except LinAlgError as error:
                raise _no_solution() from error
            EG, GG = left[:, : len(A)], left[:, len(A) :]
            step = E.T @ H @ EG
            grown = E @ GG @ E.T
            E, G, H = E @ EG, G + (grown + grown.T) / 2, H + (step + step.T) / 2
            added, reached = np.linalg.norm(step), np.linalg.norm(H)
        if not all(np.isfinite(matrix).all() for matrix in (E, G, reached)):
            break
        if added <= np.finfo(float).eps * reached:
            X = size * H
            weight = np.eye(B.shape[1]) + B.T @ X @ B
            return np.asarray(np.linalg.solve(weight, B.T @ X @ A))
    raise _no_solution()


def _no_solution() -> AccuracyError:
    return AccuracyError(
        "the sampled Riccati equation has no stabilising solution to working precision",
        where="riccati",
        remedy="check that every undamped mode is penalised and reached by noise, and that no "
        "multiple of half the sampling rate falls on a mode's frequency",
    )
