"""Normalised coprime factors of a plant from two Riccati equations, and when two of them wind.

What the ν-gap of plants with several inputs and several outputs is computed from.
"""

from __future__ import annotations

import warnings

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError
from slewctl.loop.realisation import Realisation
from slewctl.numerics.matrix_equations import solve_riccati, stability_threshold

_RESIDUAL = 1e-8  # of a Riccati equation, relative: a gap is good to about its root, 1e-4


def right_graph(P: Realisation) -> Realisation:
    """Return [N; M], stable with N~N + M~M = I and P = NM⁻¹ (Zhou et al., theorem 13.37)."""
    m = P.D.shape[1]
    R = np.eye(m) + P.D.T @ P.D
    root = np.linalg.cholesky(np.linalg.inv(R))
    F = _feedback(P, R)
    return Realisation(
        P.A + P.B @ F,
        P.B @ root,
        np.vstack([P.C + P.D @ F, F]),
        np.vstack([P.D @ root, root]),
    )


_NO_FACTORS = InputError(
    "the plant has no normalised coprime factors to working precision",
    where="nu_gap",
    remedy="leave out modes on the axis that the input does not reach or no output sees",
)


def left_graph(P: Realisation) -> Realisation:
    """Return [M̃ −Ñ], stable with P = M̃⁻¹Ñ and zero on the graph of P."""
    p = P.D.shape[0]
    dual = Realisation(P.A.T, P.C.T, P.B.T, P.D.T)
    R = np.eye(p) + P.D @ P.D.T
    root = np.linalg.cholesky(np.linalg.inv(R)).T
    H = _feedback(dual, R).T
    return Realisation(
        P.A + H @ P.C,
        np.hstack([H, -(P.B + H @ P.D)]),
        root @ P.C,
        np.hstack([root, -root @ P.D]),
    )


def _feedback(P: Realisation, R: Array) -> Array:
    """Return F = −R⁻¹(BᵀX + DᵀC) with the stabilising X of the normalised factor."""
    if not P.states:
        return np.zeros((len(R), 0))
    cross = np.linalg.solve(R, P.D.T @ P.C)
    A = P.A - P.B @ cross
    Q = P.C.T @ np.linalg.solve(np.eye(len(P.D)) + P.D @ P.D.T, P.C)
    try:
        with warnings.catch_warnings():
            # Poles almost on the axis, in bad units, are met by a perturbation; the residual
            # that is checked below says whether it did harm.
            warnings.simplefilter("ignore", RuntimeWarning)
            found = solve_riccati(A, P.B, Q, R)
    except AccuracyError as error:
        raise _NO_FACTORS from error
    closed = A - P.B @ found.gain
    if np.linalg.eigvals(closed).real.max() > -stability_threshold(closed):
        raise _NO_FACTORS  # a mode that is not moved off the axis but by rounding
    if not found.residual <= _RESIDUAL:
        raise AccuracyError(
            f"the Riccati equation of the coprime factors is solved to {found.residual:.0e} only",
            where="nu_gap",
            remedy="give the plant in modal coordinates, or in better units",
        )
    return -found.gain - cross


def winding(second: Realisation, first: Realisation) -> bool:
    """Whether det G₂~G₁ winds zero times around the origin (see `nu_gap`).

    G₂~G₁ has as many poles in the right half plane as G₂ has states, so that it must have as
    many zeros there.
    """
    mirrored = Realisation(-second.A.T, -second.C.T, second.B.T, second.D.T)
    product = mirrored.after(first)
    if np.linalg.cond(product.D) > 1e12:
        return False
    if not product.states:
        return True
    zeros = np.linalg.eigvals(product.A - product.B @ np.linalg.solve(product.D, product.C))
    return int(np.sum(zeros.real > 0)) == second.states
