"""Eigenvalues and eigenvectors of a matrix with a few large entries, each in its own precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.balance import balance
from slewctl.numerics.modes import Eigensystem

# Steps of Newton's method.
_STEPS = 3
# The fast part of a matrix is so many times as fast as the rest.
_FAR = 100.0
# What would turn an eigenvector by more than this towards another leaves it alone.
_NEAR = 0.1


@dataclass(frozen=True, eq=False)
class Pairs:
    """Eigenvalues of a real matrix with right eigenvectors, columns of norm one.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Complex ones followed by their conjugates.
    right : ndarray, shape (n, n)
    condition : ndarray, shape (n,)
        Of each eigenvalue.
    """

    values: ComplexArray
    right: ComplexArray
    condition: Array

    @classmethod
    def of(cls, found: Eigensystem) -> Pairs:
        """Return the pairs of a balanced matrix as LAPACK finds them."""
        return cls(found.poles, found.right, 1 / np.abs(found.meeting))

    @classmethod
    def _with(cls, values: ComplexArray, right: ComplexArray, left: ComplexArray) -> Pairs:
        sizes = np.linalg.norm(right, axis=0)
        return cls(values, right / sizes, sizes * np.linalg.norm(left, axis=1))

    def scaled(self, scale: Array) -> Pairs:
        """Return the same in other coordinates."""
        right = self.right / scale[:, None]
        left = np.asarray(np.linalg.inv(self.right) * scale, dtype=complex)
        return self._with(self.values, right, left)

    def refined(self, A: Array) -> Pairs:
        """Return the pairs after steps of Newton's method.

        An eigenvalue solver leaves errors of the size of the largest entry of A; what is
        multiplied out row by row here has those of each row.
        """
        values, right = self.values, self.right
        for _ in range(_STEPS):
            change = np.linalg.solve(right, A @ right - right * values)
            apart = values - values[:, None]
            np.fill_diagonal(apart, 1.0)
            near = np.abs(change) >= _NEAR * np.abs(apart)
            turn = np.where(near, 0, change / np.where(near, 1, apart))
            np.fill_diagonal(turn, 0)
            # Conjugates stay so.
            upper = self.values.imag > 0
            lower = np.flatnonzero(upper) + 1
            values, right = values + np.diag(change), right + right @ turn
            values[lower], right[:, lower] = values[upper].conj(), right[:, upper].conj()
            real = self.values.imag == 0
            values[real], right[:, real] = values[real].real, right[:, real].real
            right = right / np.linalg.norm(right, axis=0)
        return self._with(values, right, np.linalg.inv(right).astype(complex))


def scale_of_the_slow(A: Array, values: ComplexArray) -> Array | None:
    """Return scales that balance a matrix but for its far faster part; None if it has none.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Balanced as a whole.
    values : ndarray, shape (n,)
        Its eigenvalues.
    """
    sizes = np.sort(np.abs(values))
    with np.errstate(divide="ignore", invalid="ignore"):
        jumps = np.where(sizes[:-1] > 0, sizes[1:] / sizes[:-1], 0)
    if not len(jumps) or jumps.max() < _FAR:
        return None
    slow, fast = sizes[jumps.argmax()], sizes[jumps.argmax() + 1]
    rows = np.linalg.norm(A, axis=1)
    slowed = np.where(rows > np.sqrt(slow * fast), slow / rows, 1.0)
    return balance(A * slowed[:, None])
