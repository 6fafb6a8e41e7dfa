"""State feedback by matrix inequalities as textbooks print them, in coordinates as they come.

They are here to be compared with: nothing is scaled, nothing is recomputed, and the solver
runs with its own settings.  To design, use `slewctl.design.h2_state_feedback`.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array

if TYPE_CHECKING:
    import cvxpy

# The status of a run that ended without a point.
FAILED = "failed"


@dataclass(frozen=True, eq=False)
class TextbookRun:
    """What the solver said and the gain K, shape (1, n), of its point; None without a point."""

    status: str
    gain: Array | None


def covariance_form(A: Array, B1: Array, B2: Array, C1: Array, D12: Array) -> TextbookRun:
    """Return K = LP⁻¹ of the inequalities in the state's covariance P and in L = KP.

    Minimise tr W subject to AP + PAᵀ − B₂L − LᵀB₂ᵀ + B₁B₁ᵀ ⪯ 0 and
    [[W, C₁P − D₁₂L], [·, P]] ⪰ 0 (Boyd, El Ghaoui, Feron and Balakrishnan, Linear Matrix
    Inequalities in System and Control Theory, SIAM 1994, section 7.2).

    Parameters
    ----------
    A, B1, B2, C1, D12 : ndarray
        The plant from disturbance and control to performance.
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    n, m, outputs, noises = len(A), B2.shape[1], len(C1), B1.shape[1]
    P = cp.Variable((n, n), symmetric=True)
    L = cp.Variable((m, n))
    W = cp.Variable((outputs, outputs), symmetric=True)
    moved, shown = A @ P - B2 @ L, C1 @ P - D12 @ L
    lyapunov = cp.bmat([[-(moved + moved.T), B1], [B1.T, np.eye(noises)]])
    performance = cp.bmat([[W, shown], [shown.T, P]])
    status = _status(cp.Problem(cp.Minimize(cp.trace(W)), [lyapunov >> 0, performance >> 0]))
    if status == FAILED or P.value is None:
        return TextbookRun(status, None)
    try:
        return TextbookRun(status, np.linalg.solve(P.value.T, np.asarray(L.value).T).T)
    except np.linalg.LinAlgError:
        return TextbookRun(FAILED, None)


def riccati_form(A: Array, B2: Array, C1: Array, D12: Array) -> TextbookRun:
    """Return K = R⁻¹B₂ᵀX of the largest X with [[AᵀX + XA + Q, XB₂], [B₂ᵀX, R]] ⪰ 0.

    Q = C₁ᵀC₁ and R = D₁₂ᵀD₁₂ (Willems, IEEE Trans. Automatic Control 16, 1971).

    Parameters
    ----------
    A, B2, C1, D12 : ndarray
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    X = cp.Variable((len(A), len(A)), symmetric=True)
    R, corner = D12.T @ D12, X @ B2
    matrix = cp.bmat([[A.T @ X + X @ A + C1.T @ C1, corner], [corner.T, R]])
    status = _status(cp.Problem(cp.Maximize(cp.trace(X)), [matrix >> 0]))
    if status == FAILED or X.value is None:
        return TextbookRun(status, None)
    return TextbookRun(status, np.linalg.solve(R, B2.T @ X.value))


def _status(problem: cvxpy.Problem) -> str:
    """Solve a problem as it stands and return what the solver says of it."""
    import cvxpy as cp  # see above

    try:
        with warnings.catch_warnings():
            # "Solution may be inaccurate": the comparison is about just that.
            warnings.simplefilter("ignore", UserWarning)
            problem.solve(solver=cp.CLARABEL)
    except cp.error.SolverError:
        return FAILED
    return str(problem.status)
