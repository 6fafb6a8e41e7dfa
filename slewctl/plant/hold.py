"""Exact integrals of a linear system over a time in which its inputs are held.

The matrix exponential and its integrals are taken over a step so short that their series end
soon, and then doubled.  Every doubling adds positive semidefinite matrices, so that stiff
modes do no harm: the usual single exponential over the whole time (C. F. Van Loan, IEEE
Trans. Automatic Control 23, 1978) holds e^(−Aᵀh), which overflows for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.numerics.balance import balance

# ‖A‖h of the first step at most, so that k of the terms leave 1/k! of the first.
_SHORT, _TERMS = 0.5, 19


@dataclass(frozen=True, eq=False)
class Held:
    """What happens in a time h in which the input u is held and white noise enters by B₁.

    With the held input as a further state, ξ = [x; u], and z = Fξ:

    Attributes
    ----------
    transition : ndarray, shape (n + m, n + m)
        From ξ(0) to ξ(h).
    cost : ndarray, shape (n + m, n + m)
        ∫ zᵀz dt = ξ(0)ᵀ · cost · ξ(0) without noise.
    noise : ndarray, shape (n, n)
        Covariance that the noise adds to x(h).
    noise_cost : float
        Mean of ∫ zᵀz dt for ξ(0) = 0: what the noise of the same time costs.
    """

    transition: Array
    cost: Array
    noise: Array
    noise_cost: float


def held(A: Array, B: Array, B1: Array, F: Array, h: float) -> Held:
    """Return the exact integrals over a time `h`; see `Held`.

    Parameters
    ----------
    A, B, B1, F : ndarray, shapes (n, n), (n, m), (n, w), (p, n + m)
    h : float
        Not negative.
    """
    n, m = B.shape
    size = n + m
    whole = np.zeros((size, size))
    whole[:n, :n], whole[:n, n:] = A, B
    scale = np.concatenate([balance(A), np.ones(m)])
    scale[n:] = _input_scale(B / scale[:n, None])
    whole = whole / scale[:, None] * scale
    size_of_step = float(np.linalg.norm(whole, 2)) * h / _SHORT
    doublings = math.ceil(math.log2(size_of_step)) if size_of_step > 1 else 0
    weight = (F * scale).T @ (F * scale)
    entering = np.zeros((size, B1.shape[1]))
    entering[:n] = B1 / scale[:n, None]
    step = h / 2**doublings
    phi = expm(whole * step)
    phi[n:] = np.eye(m, size, n)  # a held input stays what it is, to the last digit
    cost, summed = _integrals(whole, weight, step)
    noise = _integrals(whole.T, entering @ entering.T, step)[0]
    for _ in range(doublings):
        # M(2h) = M + ΦᵀMΦ, and its own integral: N(2h) = N + h M + ΦᵀNΦ.
        summed = summed + step * cost + phi.T @ summed @ phi
        cost = cost + phi.T @ cost @ phi
        noise = noise + phi @ noise @ phi.T
        phi, step = phi @ phi, 2 * step
    outer = np.outer(scale, scale)
    return Held(
        phi * scale[:, None] / scale,
        _symmetric(cost) / outer,
        (_symmetric(noise) * outer)[:n, :n],
        float(np.trace(entering.T @ summed @ entering)),
    )


def _integrals(A: Array, Q: Array, h: float) -> tuple[Array, Array]:
    """Return M = ∫₀ʰ e^(Aᵀt)Q e^(At) dt and ∫₀ʰ M(s) ds for a short step, as Taylor has them.

    With Lᵏ(Q), the kth derivative of what is integrated, the terms are Lᵏ(Q)hᵏ⁺¹/(k + 1)! and
    those times h/(k + 2): smaller each by more than half.
    """
    term = h * Q
    once, twice = term, 0.5 * h * term
    for k in range(2, _TERMS):
        half = term @ A
        term = (half + half.T) * (h / k)
        once, twice = once + term, twice + term * (h / (k + 1))
    return once, twice


def _input_scale(B: Array) -> float:
    """Return the power of two by which inputs are measured so that B is of norm one."""
    size = float(np.linalg.norm(B, 2))
    return float(2.0 ** -np.round(np.log2(size))) if size > 0 else 1.0


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2
