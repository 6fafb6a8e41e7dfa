"""Balanced coordinates of a flexible system, from Gramians in closed form."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError
from slewctl.plant.separation import Separated

# Gramians whose equations are left with more than this, relative, are not believed.
_RESIDUAL = 1e-9
# A damping ratio below this is rounding.
_UNDAMPED = 1e-14


def damped(system: Separated) -> bool:
    """Return whether every flexible mode is damped, so that there are Gramians."""
    return bool(np.all(system.poles.real < -_UNDAMPED * np.abs(system.poles)))


def refuse_undamped(system: Separated) -> None:
    """Refuse a system with an undamped mode."""
    if not damped(system):
        bare = system.poles[system.poles.real >= -_UNDAMPED * np.abs(system.poles)]
        raise InputError(
            f"the mode at {np.abs(bare).min() / (2 * np.pi):.4g} Hz is undamped and has no Gramian",
            where="balanced_truncation",
            remedy="give the arm some damping, or use modal_truncation",
        )


def balanced(system: Separated) -> tuple[Array, Array, Array, float]:
    """Return Hankel singular values, T and T⁻¹ of the balanced coordinates, and the residual.

    Columns of T and rows of T⁻¹ are in order of the values; those of value zero are zero.
    """
    P, W = system.gramians()
    real = system.real()
    residual = max(_lyapunov_residual(real.A, real.B, P), _lyapunov_residual(real.A.T, real.C.T, W))
    if not residual <= _RESIDUAL:
        raise AccuracyError(
            f"the Gramians leave a residual of {residual:.1e}",
            where="balanced_truncation",
            remedy="use modal coordinates, or change the damping slightly",
        )
    reached, seen = _root(P), _root(W)
    U, values, Vt = np.linalg.svd(seen.T @ reached)
    with np.errstate(divide="ignore"):
        weights = np.where(values > 0, 1 / np.sqrt(values), 0.0)
    return values, reached @ Vt.T * weights, (seen @ U * weights).T, residual


def _lyapunov_residual(A: Array, B: Array, P: Array) -> float:
    """Return ‖AP + PAᵀ + BBᵀ‖ over the norm of its largest term."""
    half = A @ P
    source = B @ B.T
    largest = max(float(np.linalg.norm(half)), float(np.linalg.norm(source)))
    return float(np.linalg.norm(half + half.T + source)) / largest if largest else 0.0


def _root(P: Array) -> Array:
    """Return L with LLᵀ = P, from the matrix scaled to a unit diagonal.

    The Gramians of lightly damped modes are graded but nearly diagonal; so scaled they are
    well conditioned, and a mode that counts little is still known to its own accuracy.
    """
    scale = np.sqrt(np.maximum(np.diag(P), 0.0))
    inverse = np.where(scale > 0, 1 / np.where(scale > 0, scale, 1.0), 0.0)
    values, vectors = eigh(P * np.outer(inverse, inverse))
    return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
