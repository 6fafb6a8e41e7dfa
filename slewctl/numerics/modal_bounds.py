"""What modal coordinates leave out, bounded entry by entry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.long_sums import LongComplex, LongComplexSum
from slewctl.numerics.modal_basis import Modes, outside

# Of one complex operation; a sum of n products has n times as much at most (Higham, "Accuracy
# and Stability of Numerical Algorithms", 2nd ed., sections 3.1 and 3.6).
ROUNDING = 4 * float(np.finfo(float).eps)
# Where a factor is known to less than this, relative, long numbers are tried, for matrices of
# no more than so many states, to whose cube their cost is proportional.
_PRECISE = 1e-11
_LONGEST = 64
_STEPS = 2  # each squares the error


@dataclass(frozen=True, eq=False)
class Stack:
    """Matrices of some components: A, what rounding took from it, B and C."""

    A: Array
    lost: Array
    B: Array
    C: Array


@dataclass(frozen=True, eq=False)
class BoundedModes:
    """Modes with all that a `ModalForm` says of them."""

    modes: Modes
    entry: ComplexArray
    entry_error: Array
    shape: ComplexArray
    shape_error: Array
    spread: Array
    weight: Array
    pole_error: Array

    @property
    def worst(self) -> float:
        """The largest error of (C, A, b) at the size of a pole, relative to its value."""
        poles = np.diagonal(self.modes.J, axis1=-2, axis2=-1)[0]
        sizes = np.unique(np.abs(poles)[np.abs(poles) > 0])
        # What it works with may be slower or faster than all of its own poles.
        points = 1j * np.concatenate([sizes[:1] * 1e-6, sizes[:1] * 1e-3, sizes, sizes[-1:] * 1e3])
        with np.errstate(divide="ignore", invalid="ignore"):
            near = 1 / np.abs(points[:, None] - poles)
            entry, shape = np.abs(self.entry[0]), np.abs(self.shape[0])
            out = near @ (shape * self.spread[0]).T
            through = (near @ (self.weight[0] * entry))[:, None]
            seen = (self.shape[0] * self.entry[0] / (points[:, None] - poles)[:, None, :]).sum(
                axis=2
            )
            there = out * through / np.abs(seen)
        return float(np.nan_to_num(there, nan=0.0).max(initial=0.0))


def best_modes(stack: Stack, modes: Modes) -> BoundedModes:
    """Return modes with their bounds, in long numbers where double precision is too little."""
    found = _bounded(stack, modes)
    if not 3 <= stack.A.shape[-1] <= _LONGEST or found.worst < _PRECISE:
        return found
    other = _refined(stack, modes)
    return other if other.worst < found.worst else found


def _refined(stack: Stack, modes: Modes) -> BoundedModes:
    """Return simple modes after steps of Newton's method with residuals in long numbers.

    Eigenvectors of a companion form amplify a residual of ε by the square of their condition:
    what is left here is ε² (after Ogita and Aishima, Japan J. Industrial and Applied
    Mathematics 35, 2018, for the symmetric case).
    """
    A, B, C = stack.A[0], stack.B[0], stack.C[0]
    n = len(A)
    alone = outside(n, modes.blocks)
    free = np.outer(alone, alone)
    V, J = LongComplex(modes.V[0]), LongComplex(modes.J[0])
    W = modes.W[0]
    for _ in range(_STEPS):
        F = W @ _residual(A, stack.lost[0], V, J)[0]
        values = np.diagonal(J.hi)
        apart = values[None, :] - values[:, None]
        step = np.divide(F, apart, out=np.zeros_like(F), where=(apart != 0) & free)
        J = J.plus(np.where(np.eye(n, dtype=bool) & alone, F, 0))
        V = V.plus(V.hi @ step)
    W = np.linalg.inv(V.hi)
    R, bound = _residual(A, stack.lost[0], V, J)
    correct = _Corrected(V.hi[None], W[None], V.lo[None])
    size = np.abs(W)[None]
    f, g = _rank_one(correct(size @ (np.abs(R) + bound)[None]))
    x = LongComplex(W @ B)
    for _ in range(_STEPS):
        x = x.plus(W @ _rest(B, V, x)[0])
    rest, inexact = _rest(B, V, x)
    off = correct(size @ (np.abs(rest) + inexact)[None])[0] + np.abs(x.lo)
    Y, lost = _seen(C, V)
    poles = np.where(alone, np.abs(np.diagonal(J.lo)), 0.0)
    return BoundedModes(
        Modes(V.hi[None], W[None], J.hi[None], modes.blocks),
        x.hi[None, :, 0],
        off[None, :, 0],
        Y[None],
        lost[None],
        f,
        g,
        poles[None],
    )


def _bounded(stack: Stack, modes: Modes) -> BoundedModes:
    V, W, correct = np.abs(modes.V), np.abs(modes.W), _Corrected(modes.V, modes.W)
    count = (stack.A.shape[-1] + 2) * ROUNDING
    missing = np.abs(stack.A @ modes.V - modes.V @ modes.J)
    missing += count * (np.abs(stack.A) @ V + V @ np.abs(modes.J)) + np.abs(stack.lost) @ V
    f, g = _rank_one(correct(W @ missing))
    x = modes.W @ stack.B
    missing = np.abs(stack.B - modes.V @ x) + count * (V @ np.abs(x) + np.abs(stack.B))
    return BoundedModes(
        modes,
        x[..., 0],
        correct(W @ missing)[..., 0],
        stack.C @ modes.V,
        count * (np.abs(stack.C) @ V),
        f,
        g,
        np.zeros_like(f),
    )


def _rank_one(F: Array) -> tuple[Array, Array]:
    """Return f and g with F ≤ f gᵀ, entry by entry."""
    f = F.max(axis=-1)
    part = np.divide(F, f[..., None], out=np.zeros_like(F), where=f[..., None] > 0)
    return f, part.max(axis=-2)


def _residual(A: Array, lost: Array, V: LongComplex, J: LongComplex) -> tuple[ComplexArray, Array]:
    """Return (A + lost) V − V J and a bound of what is missing in it."""
    n = len(A)
    total = LongComplexSum((n, n))
    total.add_matrix_product(A.astype(complex), V.hi)
    diagonal = np.diagonal(J.hi)
    total.add_product(V.hi, np.broadcast_to(-diagonal, (n, n)))
    beside = J.hi - np.diag(diagonal)
    for i, j in np.argwhere(beside != 0).tolist():
        column = np.zeros((n, n), complex)
        column[:, j] = -V.hi[:, i]
        total.add_product(column, np.full((n, n), beside[i, j]))
    found = total.value + (A @ V.lo + lost @ V.hi - V.lo @ J.hi - V.hi @ J.lo)
    size, low = np.abs(V.hi), np.abs(V.lo)
    minor = np.abs(A) @ low + np.abs(lost) @ size + low @ np.abs(J.hi) + size @ np.abs(J.lo)
    bound = total.error + ROUNDING * np.abs(found) + (n + 2) * ROUNDING * minor
    return found, bound + np.abs(lost) @ low + low @ np.abs(J.lo)


def _rest(b: Array, V: LongComplex, x: LongComplex) -> tuple[ComplexArray, Array]:
    """Return b − V x and a bound of what is missing in it."""
    total = LongComplexSum(b.shape)
    total.add_product(b.astype(complex), np.ones(b.shape, complex))
    total.add_matrix_product(V.hi, -x.hi)
    found = total.value - V.lo @ x.hi - V.hi @ x.lo
    minor = np.abs(V.lo) @ np.abs(x.hi) + np.abs(V.hi) @ np.abs(x.lo)
    bound = (len(b) + 2) * ROUNDING * minor + np.abs(V.lo) @ np.abs(x.lo)
    return found, bound + total.error + ROUNDING * np.abs(found)


def _seen(C: Array, V: LongComplex) -> tuple[ComplexArray, Array]:
    """Return C V, rounded once, and a bound of what is missing in it."""
    total = LongComplexSum(C.shape)
    total.add_matrix_product(C.astype(complex), V.hi)
    found = total.value + C @ V.lo
    bound = (C.shape[1] + 2) * ROUNDING * (np.abs(C) @ np.abs(V.lo))
    return found, bound + ROUNDING * np.abs(found) + total.error


class _Corrected:
    """From |W| r to a bound of |(V + low)⁻¹| r, W being the inverse of V but for rounding."""

    def __init__(self, V: ComplexArray, W: ComplexArray, low: ComplexArray | None = None) -> None:
        n = V.shape[-1]
        off = np.abs(np.eye(n) - W @ V) + (n + 2) * ROUNDING * (np.abs(W) @ np.abs(V))
        self.off = off if low is None else off + np.abs(W) @ np.abs(low)
        rows = self.off.sum(axis=-1).max(axis=-1)
        with np.errstate(divide="ignore"):
            self.more = np.where(rows < 1, rows / (1 - rows), np.inf)[:, None, None]

    def __call__(self, bound: Array) -> Array:
        first = self.off @ bound
        rest = first.max(axis=(-2, -1), keepdims=True)
        return np.asarray(bound + first + np.where(rest > 0, self.more * rest, 0.0))
