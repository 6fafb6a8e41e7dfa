"""Matrix equations of control, solved in balanced coordinates and checked.

Flexible plants mix displacements of 1e-6 m with rates of 1 rad/s and frequencies over
four decades.  Each routine therefore balances the state matrix first, and returns beside
its result how well an independent computation confirms it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import (
    LinAlgError,
    matrix_balance,
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_triangular,
)

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError


def balance(A: Array) -> Array:
    """Return state scales s (powers of two) for which diag(1/s) A diag(s) is balanced."""
    _, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return np.asarray(scale, dtype=float)


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


def solve_riccati(A: Array, B: Array, Q: Array, R: Array) -> RiccatiSolution:
    """Return the stabilising solution of the continuous-time Riccati equation.

    Parameters
    ----------
    A, B, Q, R : ndarray, shapes (n, n), (n, m), (n, n), (m, m)

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
    rate = _nonzero(As)
    size = np.sqrt(_nonzero(Qs)) / _nonzero(Bs)
    An, Bn, Qn = As / rate, Bs * np.sqrt(size / rate), Qs / (size * rate)
    X = _stabilising(An, Bn, Qn)
    # One Newton step: the eigenvectors of a lightly damped plant leave a residual of up to
    # 1e-7 behind, a Lyapunov equation with the closed loop removes it.
    step = solve_continuous_lyapunov((An - Bn @ Bn.T @ X).T, -_riccati_defect(An, Bn, Qn, X)[0])
    X = X + (step + step.T) / 2
    defect, largest = _riccati_defect(An, Bn, Qn, X)
    gain = solve_triangular(root.T, Bs.T @ (size * X)) / scale
    return RiccatiSolution(size * X / outer, gain, float(np.linalg.norm(defect) / largest))


def _nonzero(matrix: Array) -> float:
    """Return the norm of a matrix, or one where there is nothing to scale by."""
    return float(np.linalg.norm(matrix, 2)) or 1.0


def _stabilising(A: Array, B: Array, Q: Array) -> Array:
    """Return the solution of AᵀX + XA − XBBᵀX + Q = 0 that makes A − BBᵀX stable."""
    refusal = AccuracyError(
        "the Riccati equation has no stabilising solution to working precision",
        where="riccati",
        remedy="check that every undamped mode is penalised and reached by noise, and that "
        "limits and noises are of sensible size against each other",
    )
    try:
        X = np.asarray(solve_continuous_are(A, B, Q, np.eye(B.shape[1])), dtype=float)
    except (LinAlgError, ValueError) as error:
        raise refusal from error
    if not np.linalg.eigvals(A - B @ B.T @ X).real.max() < 0:
        raise refusal
    return X


def _riccati_defect(A: Array, B: Array, Q: Array, X: Array) -> tuple[Array, float]:
    """Return the equation's left side with R = I, and the norm of its largest term."""
    half = B.T @ X
    terms = (A.T @ X + X @ A, half.T @ half, Q)
    largest = max(float(np.linalg.norm(term)) for term in terms)
    return terms[0] - terms[1] + terms[2], largest


@dataclass(frozen=True)
class H2Cost:
    """The squared H2 norm of a stable system, and how far two ways to it disagree.

    Attributes
    ----------
    value : float
        tr C P Cᵀ with the controllability Gramian P.
    discrepancy : float
        Relative difference to tr BᵀWB with the observability Gramian W.
    """

    value: float
    discrepancy: float


def h2_cost(A: Array, B: Array, C: Array) -> H2Cost:
    """Return ‖C(sI − A)⁻¹B‖₂² of a stable system from both Gramians.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
        A must be stable; the caller decides stability first.
    """
    scale = balance(A)
    As, Bs, Cs = A / scale[:, None] * scale, B / scale[:, None], C * scale
    P = solve_continuous_lyapunov(As, -Bs @ Bs.T)
    W = solve_continuous_lyapunov(As.T, -Cs.T @ Cs)
    value = float(np.trace(Cs @ P @ Cs.T))
    other = float(np.trace(Bs.T @ W @ Bs))
    return H2Cost(value, abs(other - value) / max(abs(value), np.finfo(float).tiny))


def stability_threshold(A: Array) -> float:
    """Return how far left of the axis a computed eigenvalue must lie to count as stable.

    Eigenvalues of a balanced matrix carry an error of about ε‖A‖; nothing closer to the
    axis than that can be called stable.
    """
    scale = balance(A)
    return float(len(A) * np.finfo(float).eps * np.linalg.norm(A / scale[:, None] * scale, 2))


def unobservable_modes(A: Array, C: Array) -> ComplexArray:
    """Return the eigenvalues of A, not stable, that C does not see (Popov–Belevitch–Hautus).

    Parameters
    ----------
    A, C : ndarray, shapes (n, n), (p, n)

    Returns
    -------
    ndarray of complex
        With non-negative imaginary part.  Empty when (A, C) is detectable.
    """
    scale = balance(A)
    As, Cs = A / scale[:, None] * scale, C * scale
    Cs = Cs / max(np.linalg.norm(Cs, 2), np.finfo(float).tiny)
    eigenvalues = np.linalg.eigvals(As)
    size = max(np.linalg.norm(As, 2), np.finfo(float).tiny)
    suspects = eigenvalues[(eigenvalues.real > -1e-9 * size) & (eigenvalues.imag >= 0)]
    hidden = [
        value
        for value in suspects
        if np.linalg.svd(
            np.vstack([(As - value * np.eye(len(As))) / size, Cs]),
            compute_uv=False,
        )[-1]
        < 1e-11
    ]
    return np.array(hidden, dtype=complex)
