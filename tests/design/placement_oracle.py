"""Pole placement in many digits, by another formula than slewctl's."""

from __future__ import annotations

import mpmath
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def ackermann(A: Array, b: Array, poles: ComplexArray, digits: int = 120) -> Array:
    """Return the gain k that gives A − b kᵀ the poles: the last row of (b, Ab, …)⁻¹ q(A)."""
    with mpmath.workdps(digits):
        n = len(A)
        exact, column = mpmath.matrix(A.tolist()), mpmath.matrix(b.tolist())
        reach = mpmath.matrix(n, n)
        for j in range(n):
            reach[:, j] = column
            column = exact * column
        last = mpmath.matrix(n, 1)
        last[n - 1] = 1
        row = mpmath.lu_solve(reach.T, last).T
        for pole in poles:
            row = row * exact - mpmath.mpc(complex(pole)) * row
        return np.array([float(mpmath.re(value)) for value in row])


def characteristic(A: Array, points: ComplexArray) -> ComplexArray:
    """Return det(sI − A) at points."""
    return np.array([np.linalg.det(s * np.eye(len(A)) - A) for s in points])
