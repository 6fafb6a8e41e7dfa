"""Products of matrices with half as many digits again, from products in double precision.

A matrix is cut into slices of so few digits that products of the first slices are exact (K.
Ozaki, T. Ogita, S. Oishi and S. M. Rump, Numerical Algorithms 59, 2012): a residual costs a
few products of the machine's own, where sums of single exact products cost n³ steps.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.long_complex import LongComplexSum

_EPS = float(np.finfo(float).eps)


def add_product(total: LongComplexSum, A: Array, V: ComplexArray) -> Array:
    """Add A V, A being real, and return a bound of what is missing in that.

    Parameters
    ----------
    total : LongComplexSum
        Of the product's shape (…, m, k).
    A : ndarray, shape (…, m, n)
    V : ndarray of complex, shape (…, n, k)
    """
    k = V.shape[-1]
    both = np.concatenate([V.real, V.imag], axis=-1)
    products, missing = _products(A, both)
    for product in products:
        total.real.add(product[..., :k])
        total.imag.add(product[..., k:])
    return np.asarray(missing[..., :k] + missing[..., k:])


def add_complex_product(total: LongComplexSum, A: ComplexArray, V: ComplexArray) -> Array:
    """Add A V and return a bound of what is missing in that."""
    m = A.shape[-2]
    side = np.concatenate([A.real, -A.imag], axis=-1)
    other = np.concatenate([A.imag, A.real], axis=-1)
    under = np.concatenate([V.real, V.imag], axis=-2)
    products, missing = _products(np.concatenate([side, other], axis=-2), under)
    for product in products:
        total.real.add(product[..., :m, :])
        total.imag.add(product[..., m:, :])
    return np.asarray(missing[..., :m, :] + missing[..., m:, :])


def _products(A: Array, B: Array) -> tuple[list[Array], Array]:
    """Return products whose sum is A B, and a bound of the rounding of the smaller ones.

    With 2β + log₂ n ≤ 53 the products of slices of β digits, and all their partial sums, are
    multiples of one unit below 2⁵³ of it.
    """
    n = A.shape[-1]
    digits = (53 - int(np.ceil(np.log2(max(n, 2))))) // 2
    A1, A2, A3 = _slices(A, digits, axis=-1)
    B1, B2, B3 = _slices(B, digits, axis=-2)
    rough = A1 @ B3 + (A2 @ (B2 + B3) + A3 @ B)
    # Its terms are 5/4 of 2^(−2β) times powers of two next to the largest entries at most, and
    # rounded n + 2 times.
    most = np.abs(A).max(axis=-1, keepdims=True, initial=0.0)
    most = most * np.abs(B).max(axis=-2, keepdims=True, initial=0.0)
    # Nothing is missing in a sum of zeros, such as a pole at the origin needs.
    most = np.where((A != 0).astype(float) @ (B != 0) > 0, most, 0.0)
    return [A1 @ B1, A1 @ B2, A2 @ B1, rough], 3 * n * (n + 2) * _EPS * 4.0**-digits * most


def _slices(A: Array, digits: int, axis: int) -> tuple[Array, Array, Array]:
    """Return A as the exact sum of three, the first two of so many digits of its row's largest."""
    largest = np.abs(A).max(axis=axis, keepdims=True, initial=0.0)
    unit = np.ldexp(1.0, np.frexp(largest)[1] - digits)
    first = np.rint(A / unit) * unit
    rest = A - first
    unit = np.ldexp(unit, -digits)
    second = np.rint(rest / unit) * unit
    return first, second, rest - second
