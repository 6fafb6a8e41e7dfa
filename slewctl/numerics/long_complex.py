"""Complex numbers with twice the digits of double precision."""

from __future__ import annotations

from typing import Any

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.long_sums import LongSum

# Bound of the relative error of one operation below, each a few dozen ε².
LONG_ROUNDING = 64 * float(np.finfo(float).eps) ** 2


class LongComplex:
    """An array of complex numbers, each kept as hi + lo.

    Parameters
    ----------
    hi : ndarray of complex
    lo : ndarray of complex, optional
        Zero unless given.
    """

    def __init__(self, hi: ComplexArray, lo: ComplexArray | None = None) -> None:
        self.hi = np.asarray(hi, dtype=complex)
        self.lo = np.zeros_like(self.hi) if lo is None else lo

    def __getitem__(self, index: Any) -> LongComplex:
        return LongComplex(self.hi[index], self.lo[index])

    @property
    def value(self) -> ComplexArray:
        """The numbers, rounded once."""
        return np.asarray(self.hi + self.lo)

    def plus(self, other: LongComplex | ComplexArray) -> LongComplex:
        """Return the sums with other numbers, elementwise with broadcasting."""
        other = other if isinstance(other, LongComplex) else LongComplex(other)
        total = LongComplexSum(np.broadcast_shapes(self.hi.shape, other.hi.shape))
        total.add(self)
        total.add(other)
        return total.long

    def minus(self, other: LongComplex | ComplexArray) -> LongComplex:
        """Return the differences from other numbers."""
        other = other if isinstance(other, LongComplex) else LongComplex(other)
        return self.plus(LongComplex(-other.hi, -other.lo))

    def times(self, other: LongComplex | ComplexArray) -> LongComplex:
        """Return the products with other numbers."""
        other = other if isinstance(other, LongComplex) else LongComplex(other)
        total = LongComplexSum(np.broadcast_shapes(self.hi.shape, other.hi.shape))
        total.add_product(self.hi, other.hi)
        total.add_small(self.hi * other.lo + self.lo * other.hi)
        return total.long

    def reciprocal(self) -> LongComplex:
        """Return their reciprocals, by one step of Newton's method from double precision."""
        first = np.asarray(1 / self.hi, dtype=complex)
        off = LongComplex(np.ones_like(first)).minus(self.times(first)).value
        return LongComplex(first).plus(first * off)

    def sum(self, axis: int) -> LongComplex:
        """Return sums along an axis."""
        shape = list(self.hi.shape)
        shape.pop(axis)
        total = LongComplexSum(tuple(shape))
        for k in range(self.hi.shape[axis]):
            total.add(LongComplex(np.take(self.hi, k, axis), np.take(self.lo, k, axis)))
        return total.long


class LongComplexSum:
    """An array of complex sums, each kept as hi + lo.

    Parameters
    ----------
    shape : tuple of int
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.real, self.imag = LongSum(shape), LongSum(shape)

    def add(self, values: LongComplex) -> None:
        """Add numbers."""
        self.real.add(values.hi.real)
        self.imag.add(values.hi.imag)
        self.add_small(values.lo)

    def add_small(self, values: ComplexArray) -> None:
        """Add values that are about as small as what rounding took away."""
        self.real.add_small(values.real)
        self.imag.add_small(values.imag)

    def add_product(self, a: ComplexArray, b: ComplexArray) -> None:
        """Add a·b, elementwise with broadcasting."""
        self.real.add_product(a.real, b.real)
        self.real.add_product(a.imag, -b.imag)
        self.imag.add_product(a.real, b.imag)
        self.imag.add_product(a.imag, b.real)

    def add_matrix_product(self, A: ComplexArray, B: ComplexArray) -> None:
        """Add A @ B, of stacks of matrices too."""
        for k in range(A.shape[-1]):
            self.add_product(A[..., :, k, None], B[..., k, None, :])

    @property
    def long(self) -> LongComplex:
        """The sum as hi + lo."""
        (re, re_lo), (im, im_lo) = self.real.parts, self.imag.parts
        return LongComplex(re + 1j * im, re_lo + 1j * im_lo)

    @property
    def value(self) -> ComplexArray:
        """The sum, rounded once."""
        return np.asarray(self.real.value + 1j * self.imag.value)

    @property
    def error(self) -> Array:
        """Bound of its error before that rounding."""
        return self.real.error + self.imag.error
