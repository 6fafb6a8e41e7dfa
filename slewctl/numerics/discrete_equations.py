"""Matrix equations of sampled control, solved by doubling and checked."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, solve_triangular

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.numerics.matrix_equations import (
    LEFT,
    MOST_STEPS,
    NEAR,
    STILL,
    RiccatiSolution,
    in_better_scale,
    norm_or_one,
)

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
    X, power, eps = (Q + Q.T) / 2, A, np.finfo(float).eps
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows never converges
        for _ in range(_MOST_DOUBLINGS):
            step = power @ X @ power.T
            X, power = X + (step + step.T) / 2, power @ power
            # Of each state: beside a loud one the sum of a quiet one may only have begun.
            if np.all(np.abs(step.diagonal()) <= eps * np.abs(X.diagonal())):
                if np.isfinite(X).all() and np.isfinite(power).all():
                    return X
                break
    raise AccuracyError(
        "a sampled motion hardly decays: what it adds up to is beyond working precision",
        where="lyapunov",
        remedy="give modes some damping; the poles say which of them lasts",
    )


def solve_discrete_riccati(
    A: Array,
    B: Array,
    Q: Array,
    R: Array,
    S: Array | None = None,
    *,
    refine: bool = True,
    near: Array | None = None,
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
    refine : bool
        Whether to go on until only rounding is left: without, a residual of up to 1e-7 may
        remain.
    near : ndarray, shape (m, n), optional
        A gain that may be near to the optimal one, with which to begin unless refined.

    Returns
    -------
    RiccatiSolution
        ``gain`` is (R + BᵀXB)⁻¹(BᵀXA + Sᵀ); the residual is relative to the largest term.

    Raises
    ------
    AccuracyError
        If there is no stabilising solution to working precision.
    """
    root = np.asarray(np.linalg.cholesky(R), dtype=float)
    priced = solve_triangular(root, B.T, lower=True).T  # B R^(−T/2)
    cross = np.zeros_like(B) if S is None else solve_triangular(root, S.T, lower=True).T
    return in_better_scale(
        lambda scale: _solve(A, priced, Q, cross, root, scale, refine, near), A, priced, Q
    )


def _solve(
    A: Array,
    B: Array,
    Q: Array,
    S: Array,
    root: Array,
    scale: Array,
    refine: bool,
    near: Array | None,
) -> RiccatiSolution:
    """Return the solution in states of another scale; B and S with R^(−T/2), R by its root."""
    outer = np.outer(scale, scale)
    An, Bn = A / scale[:, None] * scale, B / scale[:, None]
    Qn, Sn = Q * outer, S * scale[:, None]
    found = None
    if near is not None and not refine:
        found = _from_gain(An, Bn, Qn, Sn, root.T @ (near * scale))
    if found is None:
        gain = _first_gain(An - Bn @ Sn.T, Bn, Qn - Sn @ Sn.T) + Sn.T
        for _ in range(MOST_STEPS if refine else 1):
            before = gain
            X, gain = _newton_step(An, Bn, Qn, Sn, gain)
            moved, size = (np.linalg.norm(each, axis=1) for each in (gain - before, gain))
            if np.all(moved <= STILL * size):
                break
    else:
        X, gain = found
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


def _from_gain(A: Array, B: Array, Q: Array, S: Array, gain: Array) -> tuple[Array, Array] | None:
    """Return the solution and its gain from one near to it; None if that is not so near."""
    residual = NEAR
    while residual > LEFT:
        try:
            X, better = _newton_step(A, B, Q, S, gain)
        except AccuracyError:
            return None
        moved = better - gain
        # What the solution leaves of its equation.
        defect = moved.T @ (moved + B.T @ X @ B @ moved)
        left = float(np.linalg.norm(defect) / np.linalg.norm(Q + gain.T @ gain))
        if not left < residual:
            return None
        gain, residual = better, left
    return X, gain


def _first_gain(A: Array, B: Array, Q: Array) -> Array:
    """Return the gain (I + BᵀXB)⁻¹BᵀXA by doubling, with X in units that make Q and BBᵀ alike."""
    size = np.sqrt(norm_or_one(Q)) / norm_or_one(B)
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
