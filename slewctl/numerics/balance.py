"""State coordinates in which small and large numbers are of one size."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dgebal, zgebal

from slewctl._types import Array, ComplexArray


def balance(A: Array | ComplexArray) -> Array:
    """Return state scales s (powers of two) for which diag(1/s) A diag(s) is balanced."""
    complete = np.asarray_chkfinite(A)
    if not complete.size:
        return np.ones(0)
    # scipy.linalg.matrix_balance, which wraps this, takes longer than it on small matrices.
    gebal = zgebal if np.iscomplexobj(complete) else dgebal
    return np.asarray(gebal(complete, scale=1, permute=0)[3], dtype=float)


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
    whole[:-1, -1] = _norms(B)
    whole[-1, :-1] = _norms(C.T)
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
    b, c = _norms(B), _norms(C.T)
    through = float(np.prod(_norms(np.vstack([b, c])) ** 0.5))
    if not through:
        return inner
    unit = (np.linalg.norm(A) or 1.0) / through
    return inner * balance_system(A, unit * B, unit * C)


def _norms(rows: Array | ComplexArray) -> Array:
    """Return the norms of rows, whose squares need not be numbers."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    unit = np.ldexp(1.0, np.frexp(largest)[1])  # no digit changes
    return np.asarray(np.linalg.norm(rows / unit[:, None], axis=1) * unit)
