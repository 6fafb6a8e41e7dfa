"""Exact integrals of a linear system over a time in which its inputs are held.

The matrix exponential and its integrals are taken over a step so short that nothing is
lost (C. F. Van Loan, IEEE Trans. Automatic Control 23, 1978) and then doubled.  Every
doubling adds positive semidefinite matrices, so that stiff modes do no harm: the usual
single exponential over the whole time holds e^(−Aᵀh), which overflows for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.numerics.balance import balance

# ‖A‖h of the first step: the exponential of its negative is harmless there.
_SHORT = 0.5


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
    phi, cost, summed = _integrals(whole, weight, step)
    phi[n:] = np.eye(m, size, n)  # a held input stays what it is, to the last digit
    noise = _integrals(whole.T, entering @ entering.T, step)[1]
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


def _integrals(A: Array, Q: Array, h: float) -> tuple[Array, Array, Array]:
    """Return Φ = e^(Ah), M = ∫₀ʰ e^(Aᵀt)Q e^(At) dt and ∫₀ʰ M(s) ds for a short step."""
    size = len(A)
    zero, eye = np.zeros((size, size)), np.eye(size)
    # The last block column of the exponential holds e^(−Aᵀh) times each integral.
    blocks = np.block([[-A.T, eye, zero], [zero, -A.T, Q], [zero, zero, A]])
    last = expm(blocks * h)[:, 2 * size :]
    phi = last[2 * size :]
    return phi, phi.T @ last[size : 2 * size], phi.T @ last[:size]


def _input_scale(B: Array) -> float:
    """Return the power of two by which inputs are measured so that B is of norm one."""
    size = float(np.linalg.norm(B, 2))
    return float(2.0 ** -np.round(np.log2(size))) if size > 0 else 1.0


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2
