"""Steps of ż = A z + N(t, z): exact without N, of fourth order with it.

The scheme is the exponential Runge–Kutta method of Cox and Matthews (J. Comput. Phys. 176,
2002): what is linear, however stiff, is exact, and N is met at the beginning, twice in the
middle and at the end of a step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.numerics.balance import balance

# Of the method: z, and the number of the time: 0 at the start, 1 in the middle, 2 at the end.
Remainder = Callable[[Array, int], Array]
# Lengths of steps that differ by less than this part of the longest are one.
_ALIKE = 1e-9


class ExponentialSteps:
    """The maps over steps of a few lengths, each made once.

    Parameters
    ----------
    A : ndarray, shape (N, N)
        What is held over a step is among the states, with rows of zeros.
    longest : float
        The longest step in s.
    """

    def __init__(self, A: Array, longest: float) -> None:
        self._scale = balance(A)
        self._A = A / self._scale[:, None] * self._scale
        self._unit = _ALIKE * longest
        self._maps: dict[int, Array] = {}
        self._weights: dict[int, tuple[Array, ...]] = {}

    def map(self, h: float) -> Array:
        """Return e^(Ah)."""
        key = round(h / self._unit)
        if key not in self._maps:
            self._maps[key] = self._back(expm(self._A * h))
        return self._maps[key]

    def step(self, z: Array, h: float, remainder: Remainder) -> Array:
        """Return z after a time h."""
        key = round(h / self._unit)
        if key not in self._weights:
            self._weights[key] = self._made(h)
        half, into, whole = self._weights[key]
        start = remainder(z, 0)
        drift = half @ z
        a = drift + into @ start
        at_a = remainder(a, 1)
        at_b = remainder(drift + into @ at_a, 1)
        at_c = remainder(half @ a + into @ (2 * at_b - start), 2)
        return np.asarray(whole @ np.concatenate([z, start, at_a + at_b, at_c]))

    def _made(self, h: float) -> tuple[Array, ...]:
        _, one = self._integrals(h / 2, 1)
        _, *phi = self._integrals(h, 3)
        first = h * (phi[0] - 3 * phi[1] + 4 * phi[2])
        middle, last = h * (2 * phi[1] - 4 * phi[2]), h * (4 * phi[2] - phi[1])
        weights = [self._back(weight) for weight in (first, middle, last)]
        whole = np.hstack([self.map(h), *weights])
        return self.map(h / 2), self._back(h / 2 * one), whole

    def _integrals(self, h: float, count: int) -> list[Array]:
        """Return φ₀ … φ_count of Ah, the first row of blocks of one exponential."""
        n = len(self._A)
        whole = np.zeros(((count + 1) * n, (count + 1) * n))
        whole[:n, :n] = self._A * h
        whole[: count * n, n:] += np.eye(count * n)
        return np.split(expm(whole)[:n], count + 1, axis=1)

    def _back(self, matrix: Array) -> Array:
        return matrix * self._scale[:, None] / self._scale
