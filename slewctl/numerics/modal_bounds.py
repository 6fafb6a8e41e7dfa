"""What modal coordinates leave out, bounded entry by entry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray, IntArray
from slewctl.numerics.long_complex import LONG_ROUNDING, LongComplex, LongComplexSum
from slewctl.numerics.modal_basis import Modes

# Of one complex operation; a sum of n products has n times as much at most (Higham, "Accuracy
# and Stability of Numerical Algorithms", 2nd ed., sections 3.1 and 3.6).
ROUNDING = 4 * float(np.finfo(float).eps)
# Residuals of matrices no larger than this are taken in long numbers: nothing is missing in
# those of a rigid body, whose poles at zero any rounding would move.
_SMALL = 2


@dataclass(frozen=True, eq=False)
class Stack:
    """Matrices of some components: A, what rounding took from it, B and C."""

    A: Array
    lost: Array
    B: Array
    C: Array


@dataclass(frozen=True, eq=False)
class BoundedModes:
    """Modes of a stack of components with all that a `ModalForm` says of them.

    Attributes
    ----------
    J, entry, shape : LongComplex
        Of shapes (count, n, n), (count, n) and (count, p, n).
    blocks : tuple of ndarray of int
    entry_error, shape_error, spread, weight : ndarray
    long : bool
        Whether the errors are those of long numbers, and not of double precision.
    """

    J: LongComplex
    blocks: tuple[IntArray, ...]
    entry: LongComplex
    entry_error: Array
    shape: LongComplex
    shape_error: Array
    spread: Array
    weight: Array
    long: bool

    @property
    def worst(self) -> float:
        """The largest error of (C, A, b) at the size of a pole, relative to its value."""
        poles = np.diagonal(self.J.hi, axis1=-2, axis2=-1)[0]
        sizes = np.unique(np.abs(poles)[np.abs(poles) > 0])
        # What it works with may be slower or faster than all of its own poles.
        points = 1j * np.concatenate([sizes[:1] * 1e-6, sizes[:1] * 1e-3, sizes, sizes[-1:] * 1e3])
        with np.errstate(divide="ignore", invalid="ignore"):
            near = 1 / np.abs(points[:, None] - poles)
            entry, shape = np.abs(self.entry.hi[0]), np.abs(self.shape.hi[0])
            residue = self.shape.hi[0] * self.entry.hi[0]
            out = near @ (shape * self.spread[0]).T
            through = (near @ (self.weight[0] * entry))[:, None]
            seen = (residue / (points[:, None] - poles)[:, None, :]).sum(axis=2)
            lost = self.shape_error[0] * entry + shape * self.entry_error[0]
            lost += (LONG_ROUNDING if self.long else ROUNDING) * np.abs(residue)
            there = (out * through + near @ lost.T) / np.abs(seen)
        return float(np.nan_to_num(there, nan=0.0).max(initial=0.0))


def bounded(stack: Stack, modes: Modes) -> BoundedModes:
    """Return modes with their bounds in double precision."""
    V, W, correct = np.abs(modes.V), np.abs(modes.W), Corrected(modes.V, modes.W)
    count = (stack.A.shape[-1] + 2) * ROUNDING
    if stack.A.shape[-1] <= _SMALL:
        total = LongComplexSum(stack.A.shape)
        total.add_matrix_product(stack.A.astype(complex), modes.V)
        total.add_matrix_product(modes.V, -modes.J)
        missing = np.abs(total.value) * (1 + ROUNDING) + total.error
    else:
        missing = np.abs(stack.A @ modes.V - modes.V @ modes.J)
        missing += count * (np.abs(stack.A) @ V + V @ np.abs(modes.J))
    missing += np.abs(stack.lost) @ V
    f, g = rank_one(correct(W @ missing))
    x = modes.W @ stack.B
    missing = np.abs(stack.B - modes.V @ x) + count * (V @ np.abs(x) + np.abs(stack.B))
    return BoundedModes(
        LongComplex(modes.J),
        modes.blocks,
        LongComplex(x[..., 0]),
        correct(W @ missing)[..., 0],
        LongComplex(stack.C @ modes.V),
        count * (np.abs(stack.C) @ V),
        f,
        g,
        False,
    )


def rank_one(F: Array) -> tuple[Array, Array]:
    """Return f and g with F ≤ f gᵀ, entry by entry."""
    f = F.max(axis=-1)
    part = np.divide(F, f[..., None], out=np.zeros_like(F), where=f[..., None] > 0)
    return f, part.max(axis=-2)


class Corrected:
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
