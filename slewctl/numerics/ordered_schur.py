"""A Schur form whose first columns span the invariant subspace of chosen eigenvalues."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from scipy.linalg import LinAlgError, schur
from scipy.linalg.lapack import dtrsen, ztrsen

from slewctl._types import Array, BoolArray, ComplexArray

Choice = Callable[[ComplexArray], BoolArray]
Matrix = TypeVar("Matrix", Array, ComplexArray)


def ordered_schur(A: Array, choice: Choice) -> tuple[Array, Array, int]:
    """Return T and Z of A = Z T Zᵀ with the chosen eigenvalues first, and how many they are.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Real.
    choice : callable
        Takes the eigenvalues, shape (n,), and returns which of them come first; of a complex
        pair both do if one does.

    Returns
    -------
    T, Z : ndarray, shape (n, n)
        Quasi-triangular, and orthogonal: Z[:, :k] spans the invariant subspace.
    k : int

    Raises
    ------
    scipy.linalg.LinAlgError
        If the eigenvalues are too close to be exchanged, or rounding made others of them.

    Notes
    -----
    Bai and Demmel, Linear Algebra and its Applications 186 (1993), by LAPACK's `dtrsen`.  The
    eigenvalues are chosen between two calls of LAPACK and not, as by `scipy.linalg.schur`, by
    a function that LAPACK calls: an interruption of the program passes no Fortran on its way.

    Examples
    --------
    >>> import numpy as np
    >>> T, Z, k = ordered_schur(np.diag([2.0, -1.0]), lambda poles: poles.real < 0)
    >>> k, T[:k, :k].tolist()
    (1, [[-1.0]])
    """
    T, Z = schur(A, output="real")
    return _ordered(T, Z, choice, dtrsen)


def ordered_complex_schur(
    A: Array | ComplexArray, choice: Choice
) -> tuple[ComplexArray, ComplexArray, int]:
    """Return the same in complex arithmetic, T triangular: each eigenvalue by itself."""
    T, Z = schur(A, output="complex")
    return _ordered(T, Z, choice, ztrsen)


def nearest_of(values: ComplexArray, chosen: Iterable[int]) -> Choice:
    """Return the choice of those eigenvalues that are next to a chosen one of known values.

    Parameters
    ----------
    values : ndarray of complex, shape (n,)
        All eigenvalues, as another computation found them.
    chosen : iterable of int
        Indices into `values`.
    """
    member = np.zeros(len(values), dtype=bool)
    member[list(chosen)] = True

    def nearest(poles: ComplexArray) -> BoolArray:
        return np.asarray(member[np.argmin(np.abs(poles[:, None] - values), axis=1)])

    return nearest


def _ordered(
    T: Matrix, Z: Matrix, choice: Choice, exchange: Callable[..., Any]
) -> tuple[Matrix, Matrix, int]:
    if not len(T):
        return T, Z, 0
    chosen = _whole(T, choice(_eigenvalues(T)))
    count = int(chosen.sum())
    if chosen[:count].all():
        return T, Z, count
    T, Z, *_, info = exchange(chosen, T, Z, job="N")
    if info or not _whole(T, choice(_eigenvalues(T)))[:count].all():
        raise LinAlgError("eigenvalues too close to be exchanged")
    return T, Z, count


def _eigenvalues(T: Array | ComplexArray) -> ComplexArray:
    """Return the eigenvalues of a Schur form; LAPACK leaves equal diagonals in its 2×2 blocks."""
    values = np.diagonal(T).astype(complex)
    (first,) = np.nonzero(np.diagonal(T, -1))
    imaginary = np.sqrt(np.abs(T[first, first + 1])) * np.sqrt(np.abs(T[first + 1, first]))
    values[first] += 1j * imaginary
    values[first + 1] -= 1j * imaginary
    return values


def _whole(T: Array | ComplexArray, chosen: BoolArray) -> BoolArray:
    """Return the choice with both eigenvalues of every 2×2 block of which one is chosen."""
    (first,) = np.nonzero(np.diagonal(T, -1))
    whole = np.array(chosen, dtype=bool)
    whole[first] |= whole[first + 1]
    whole[first + 1] |= whole[first]
    return whole
