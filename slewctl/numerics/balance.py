"""State coordinates in which small and large numbers are of one size."""

from __future__ import annotations

import numpy as np
from scipy.linalg import matrix_balance

from slewctl._types import Array, ComplexArray


def balance(A: Array | ComplexArray) -> Array:
    """Return state scales s (powers of two) for which diag(1/s) A diag(s) is balanced."""
    with np.errstate(invalid="ignore"):  # scipy casts scales beyond int64 to permutations
        _, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return np.asarray(scale, dtype=float)


def balance_system(
    A: Array | ComplexArray, B: Array | ComplexArray, C: Array | ComplexArray
) -> Array:
    """Return state scales s (powers of two) for which [A B; C 0] is balanced.

    Where a loop is closed through B and C they matter as much as A: a companion form has its
    small and large numbers in C, and A − BC of an A balanced alone may be 1e9 times as large
    as any pole.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
    """
    whole = np.zeros((len(A) + 1, len(A) + 1))
    whole[:-1, :-1] = np.abs(A)
    whole[:-1, -1] = np.linalg.norm(B, axis=1)
    whole[-1, :-1] = np.linalg.norm(C, axis=0)
    scale = balance(whole)
    return np.asarray(scale[:-1] / scale[-1])


def balance_realisation(A: Array, B: Array, C: Array) -> Array:
    """Return state scales s (powers of two) for which A, B and C are of comparable size.

    As `balance_system`, in units of inputs and outputs that make B and C as large as A: a
    state that A couples with no other is scaled by what reaches it and where it is seen.
    """
    n = len(A)
    if not n:
        return np.ones(0)
    inner = balance(A)
    A, B, C = A / inner[:, None] * inner, B / inner[:, None], C * inner
    b, c = np.linalg.norm(B, axis=1), np.linalg.norm(C, axis=0)
    through = np.linalg.norm(b) ** 0.5 * np.linalg.norm(c) ** 0.5
    if not through:
        return inner
    unit = (np.linalg.norm(A) or 1.0) / through
    return inner * balance_system(A, unit * B, unit * C)
