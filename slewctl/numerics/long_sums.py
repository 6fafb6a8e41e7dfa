"""Sums of products with twice the digits of double precision.

Dekker's product and Knuth's sum (T. J. Dekker, Numerische Mathematik 18, 1971): each returns
its result and, exactly, what rounding took away.  Residuals of what is right to the last
digit are nothing but such remainders.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array

# Of 53 digits 26 and 26 are left, and a sign (Dekker 1971, section 5).
_SPLIT = 2.0**27 + 1


class LongSum:
    """An array of sums, each kept as hi + lo.

    Parameters
    ----------
    shape : tuple of int

    Attributes
    ----------
    size : ndarray
        Σ |term|, from which `error` bounds what even lo has lost.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.hi, self.lo, self.size = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.terms = 0

    def add(self, values: Array) -> None:
        """Add values, exactly but for lo's own rounding."""
        total = self.hi + values
        part = total - self.hi
        self.lo += (self.hi - (total - part)) + (values - part)
        self.hi = total
        self.size += np.abs(values)
        self.terms += 1

    def add_product(self, a: Array, b: Array) -> None:
        """Add a·b, elementwise with broadcasting."""
        product = a * b
        a_high, a_low = _halves(a)
        b_high, b_low = _halves(b)
        rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
        self.add(product)
        self.lo += rest

    def add_small(self, values: Array) -> None:
        """Add values that are about as small as what rounding took away."""
        self.lo += values

    @property
    def parts(self) -> tuple[Array, Array]:
        """The sum rounded once, and what that took away."""
        total = self.hi + self.lo
        return total, self.lo - (total - self.hi)

    @property
    def value(self) -> Array:
        """The sum, rounded once."""
        return np.asarray(self.hi + self.lo)

    @property
    def error(self) -> Array:
        """Bound of the error of hi + lo before that rounding."""
        return np.asarray((self.terms + 4.0) ** 2 * np.finfo(float).eps ** 2 * self.size)


def _halves(a: Array) -> tuple[Array, Array]:
    """Return a number as the sum of two with half of its digits."""
    big = _SPLIT * a
    high = big - (big - a)
    return high, a - high
