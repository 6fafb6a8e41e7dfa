"""What modal coordinates leave out, bounded entry by entry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.numerics.long_complex import LONG_ROUNDING, LongComplex, LongComplexSum
from slewctl.numerics.modal_basis import AT_END, Modes, integrated
from slewctl.numerics.sliced_products import add_complex_product, add_product

# Of one complex operation; a sum of n products has n times as much at most (Higham, "Accuracy
# and Stability of Numerical Algorithms", 2nd ed., sections 3.1 and 3.6).
ROUNDING = 4 * float(np.finfo(float).eps)
# Of one rounding of a complex number.
_ULP = float(np.finfo(float).eps)
# The eigenvectors of matrices no larger than this are right as they are.
_SMALL = 2
# Eigenvectors are mended where that changes them by less than this: else their poles are too
# near to each other for a first-order step.
_MENDED = 1e-4


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
    """Return modes with their bounds in double precision.

    What rounding has taken from an eigenvector of a fast pole in the direction of a slow one
    is mended first, so that a slow pole is known as well as its own size allows.
    """
    small = stack.A.shape[-1] <= _SMALL
    if not small and not modes.blocks:
        modes = _mended(stack.A, modes)
    below = _below(modes)
    found, bound = _residual(stack.A, modes.V, modes.J)
    W, correct = np.abs(modes.W), Corrected(modes.V, modes.W)
    missing = np.abs(found) * (1 + ROUNDING) + bound + np.abs(stack.lost) @ np.abs(modes.V)
    f, g = rank_one(correct(W @ missing))
    x = modes.W @ stack.B
    if not small:
        x = x + modes.W @ _rest(stack.B, modes.V, x)[0]
    if below.any():
        x = np.where(below[..., None], np.roll(x, 1, axis=-2).conj(), x)
    rest, bound = _rest(stack.B, modes.V, x)
    Y, shape_error = _seen(stack.C, modes.V)
    Y = np.where(below[..., None, :], np.roll(Y, 1, axis=-1).conj(), Y)
    return BoundedModes(
        LongComplex(modes.J),
        modes.blocks,
        LongComplex(x[..., 0]),
        correct(W @ (np.abs(rest) * (1 + ROUNDING) + bound))[..., 0],
        LongComplex(Y),
        shape_error,
        f,
        g,
        False,
    )


def _mended(A: Array, modes: Modes) -> Modes:
    """Return modes after one step of Newton's method from the exact residual."""
    if modes.integral is not None:
        kept = modes.kept
        others = _mended(A[:, kept[:, None], kept], modes.others)
        return integrated(A[0], others, modes.integral)
    J = modes.J
    F = modes.W @ _residual(A, modes.V, J)[0]
    values = np.diagonal(J, axis1=-2, axis2=-1)
    apart = values[..., None, :] - values[..., :, None]
    step = np.divide(F, apart, out=np.zeros_like(F), where=apart != 0)
    if not np.abs(step).max(initial=0.0) < _MENDED:
        return modes
    below = _below(modes)
    V, there = modes.V + modes.V @ step, (values == 0) | (values == AT_END)
    moved = np.where(there, values, values + np.diagonal(F, axis1=-2, axis2=-1))
    V = np.where(below[..., None, :], np.roll(V, 1, axis=-1).conj(), V)
    moved = np.where(below, np.roll(moved, 1, axis=-1).conj(), moved)
    J = np.where(np.eye(A.shape[-1], dtype=bool), moved[..., None, :], 0)
    return Modes(V, np.asarray(np.linalg.inv(V), dtype=complex), J, modes.blocks)


def _below(modes: Modes) -> BoolArray:
    """Return which modes are conjugates of the one before, to the last digit."""
    values = np.diagonal(modes.J, axis1=-2, axis2=-1)
    found = (values.imag < 0) & (values == np.roll(values, 1, axis=-1).conj())
    for block in modes.blocks:
        found[..., block] = False
    return np.asarray(found)


def _residual(A: Array, V: ComplexArray, J: ComplexArray) -> tuple[ComplexArray, Array]:
    """Return A V − V J and a bound of what is missing in it."""
    total = LongComplexSum(V.shape)
    missing = add_product(total, A, V) + add_complex_product(total, V, -J)
    return total.value, total.error + missing


def _rest(B: Array, V: ComplexArray, x: ComplexArray) -> tuple[ComplexArray, Array]:
    """Return B − V x and a bound of what is missing in it."""
    total = LongComplexSum(B.shape)
    total.real.add(B)
    missing = add_complex_product(total, V, -x)
    return total.value, total.error + missing


def _seen(C: Array, V: ComplexArray) -> tuple[ComplexArray, Array]:
    """Return C V, rounded once where that is worth it, and a bound of its error."""
    total = LongComplexSum((*C.shape[:-1], V.shape[-1]))
    missing = add_product(total, C, V)
    Y = total.value
    return Y, total.error + missing + _ULP * np.abs(Y)


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
