"""The squared H2 norm of a stable system, from both Gramians, and how well they agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.numerics.balance import balance_realisation, balance_system
from slewctl.numerics.discrete_equations import solve_discrete_lyapunov
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import solve_lyapunov
from slewctl.numerics.modes import eigensystem


@dataclass(frozen=True)
class H2Cost:
    """The squared H2 norm of a stable system, and how far two ways to it disagree.

    Attributes
    ----------
    value : float
        tr C P Cᵀ with the controllability Gramian P.
    discrepancy : float
        Relative difference to tr BᵀWB with the observability Gramian W, or of `cost_of_loop`
        that and what else may be missing.
    """

    value: float
    discrepancy: float


def system_cost(system: LinearSystem) -> H2Cost:
    """Return ‖G‖₂² of a stable system, continuous or sampled.

    From poles and residues where there are many and they miss nothing; see `cost_of_loop`.
    Infinite where white noise passes straight to an output of a continuous one.
    """
    A, B, C, D = system.matrices
    if system.sample_time:
        return discrete_h2_cost(A, B, C, D) if len(A) else H2Cost(float(np.sum(D**2)), 0.0)
    if np.any(D):
        return H2Cost(np.inf, 0.0)
    if len(A) >= _MANY and (found := _modal_cost(A, B, C)) and found.discrepancy <= _SURE:
        return found
    return h2_cost(A, B, C) if len(A) else H2Cost(0.0, 0.0)


def h2_cost(A: Array, B: Array, C: Array) -> H2Cost:
    """Return ‖C(sI − A)⁻¹B‖₂² of a stable system from both Gramians.

    Where they do not agree, states of odd units may be the reason, and those are scaled by
    another rule as well: the value on which the Gramians agree better is returned.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
        A must be stable; the caller decides stability first.
    """
    found: list[H2Cost] = []
    for rule in (balance_system, balance_realisation):
        scale = rule(A, B, C)
        found.append(_h2_cost(A / scale[:, None] * scale, B / scale[:, None], C * scale))
        if found[-1].discrepancy <= _AGREED:
            return found[-1]
    best = min(found, key=lambda cost: cost.discrepancy)
    return _refined_cost(A, B, C, best) if best.discrepancy > _DOUBTFUL else best


def cost_of_loop(A: Array, B: Array, C: Array) -> H2Cost:
    """Return ‖C(sI − A)⁻¹B‖₂² of a stable system from its poles and residues, or as `h2_cost`.

    With poles λᵢ and residues cᵢbᵢᵀ it is −Σ (c̄ᵢᵀcⱼ)(bⱼᵀb̄ᵢ)/(λ̄ᵢ + λⱼ), in a half of the time
    from forty modes on.  What it misses is tr W R, to first order: R = AP + PAᵀ + BBᵀ is what
    the Gramian P leaves of its equation, W the other Gramian.  Where that, rounding and the
    difference of both Gramians are more than 1e-9 of the cost, as where two poles nearly meet,
    Lyapunov equations are solved.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
        A must be stable; the caller decides stability first.
    """
    found = _modal_cost(A, B, C)
    return found if found and found.discrepancy <= _MISSED else h2_cost(A, B, C)


def _modal_cost(A: Array, B: Array, C: Array) -> H2Cost | None:
    """Return the cost with what it misses, and rounding, as its discrepancy."""
    found, scale = eigensystem(A), balance_realisation(A, B, C)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    poles, V = found.poles, found.columns / scale[:, None]
    try:
        inverse = np.linalg.inv(V)  # of poles that nearly meet better than left eigenvectors
    except np.linalg.LinAlgError:
        return None
    b, c, sums = inverse @ B, C @ V, poles[:, None] + poles.conj()
    shares = b @ b.conj().T / sums
    P = -(V @ shares @ V.conj().T).real
    W = -(inverse.conj().T @ (c.conj().T @ c / sums.conj()) @ inverse).real
    half = A @ P
    missed = float(np.sum(W * (half + half.T + B @ B.T)))
    # Of the residual, a sum of n products; and of the poles' shares, each of which carries a few
    # roundings of its own and which cancel where two poles nearly meet.
    eps = np.finfo(float).eps
    rounding = 2 * len(A) * eps * float(np.sum(np.abs(W) * (np.abs(A) @ np.abs(P))))
    rounding += 4 * eps * float(np.sum((np.abs(c) @ np.abs(shares)) * np.abs(c)))
    first = _cost(B, C, P, W)
    size = max(abs(first.value), float(np.finfo(float).tiny))
    return H2Cost(first.value, float(first.discrepancy + (abs(missed) + rounding) / size))


# From so many states on poles and residues cost less than Lyapunov equations.
_MANY = 40
# What they may miss of a cost that optima are told by.
_SURE = 1e-10
# What poles and residues may miss of a cost.
_MISSED = 1e-9
# Gramians that agree so well are as exact as these numbers get.
_AGREED = 1e-12
# Those that agree no better are worth a refinement, which takes ten times as long.
_DOUBTFUL = 1e-11
_REFINEMENTS = 4  # each gains as many digits as the equation was solved to


def _h2_cost(A: Array, B: Array, C: Array) -> H2Cost:
    P = solve_lyapunov(A, -B @ B.T)
    W = solve_lyapunov(A.T, -C.T @ C)
    return _cost(B, C, P, W)


def _cost(B: Array, C: Array, P: Array, W: Array) -> H2Cost:
    """Return the cost that both Gramians give."""
    value, other = float(np.trace(C @ P @ C.T)), float(np.trace(B.T @ W @ B))
    return H2Cost(value, abs(other - value) / max(abs(value), np.finfo(float).tiny))


def _refined_cost(A: Array, B: Array, C: Array, best: H2Cost) -> H2Cost:
    """Return the cost from Gramians refined until they agree, or `best` if none agree better.

    What the Schur form's rounding leaves of a Lyapunov equation is computed with the longest
    numbers that the machine has, and solved for once more.
    """
    scale = balance_realisation(A, B, C)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    P: Array = np.zeros(A.shape)
    W: Array = np.zeros(A.shape)
    for _ in range(_REFINEMENTS):
        P = _closer(A, B, P)
        W = _closer(A.T, C.T, W)
        best = min(best, _cost(B, C, P, W), key=lambda cost: cost.discrepancy)
        if best.discrepancy <= _AGREED:
            break
    return best


def _closer(A: Array, B: Array, P: Array) -> Array:
    """Return a better solution of AP + PAᵀ + BBᵀ = 0."""
    long = np.longdouble
    half = A.astype(long) @ P.astype(long)
    left = np.asarray(half + half.T + B.astype(long) @ B.T.astype(long), dtype=float)
    step = solve_lyapunov(A, -left)
    return np.asarray(P + (step + step.T) / 2, dtype=float)


def discrete_h2_cost(A: Array, B: Array, C: Array, D: Array) -> H2Cost:
    """Return ‖C(zI − A)⁻¹B + D‖₂² of a stable sampled system from both Gramians.

    Parameters
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        A must be stable; the caller decides stability first.
    """
    scale = balance_realisation(A, B, C)
    As, Bs, Cs = A / scale[:, None] * scale, B / scale[:, None], C * scale
    at_once = float(np.sum(D**2))
    value = float(np.sum((Cs @ solve_discrete_lyapunov(As, Bs @ Bs.T)) * Cs)) + at_once
    dual = float(np.sum((Bs.T @ solve_discrete_lyapunov(As.T, Cs.T @ Cs)) * Bs.T)) + at_once
    return H2Cost(value, abs(dual - value) / max(abs(value), np.finfo(float).tiny))
