"""One loop broken at one point, and the closed loop it becomes with a factor in it."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.balance import balance_system
from slewctl.numerics.bilinear import Equivalent, equivalent
from slewctl.numerics.frequency_response import (
    FrequencyResponse,
    axis_points,
    landmarks,
    sample_time,
)
from slewctl.numerics.linear_system import LinearSystem


class BrokenLoop:
    """A return ratio L = (A, B, C, D) under negative feedback, 1 + f·L = 0 with a factor f.

    The state of a sampled loop is advanced by A + I: A is kept as δ = z − 1 wants it.

    Parameters
    ----------
    loop : LinearSystem
        One input and one output, continuous or sampled.
    """

    def __init__(self, loop: LinearSystem) -> None:
        self.system = loop
        self.step = sample_time(loop)
        scale = balance_system(*(np.asarray(getattr(loop, name)) for name in "ABC"))
        A = np.asarray(loop.A, dtype=float) / scale[:, None] * scale
        self.A = A - np.eye(len(A)) if self.step else A
        self.B = np.asarray(loop.B, dtype=float) / scale[:, None]
        self.C = np.asarray(loop.C, dtype=float) * scale
        self.D = float(loop.D[0, 0])

    @cached_property
    def response(self) -> FrequencyResponse:
        """L at many frequencies together."""
        return FrequencyResponse(self.system)

    @cached_property
    def equivalent(self) -> Equivalent:
        """The loop with its critical circle on the imaginary axis."""
        return equivalent(self.system)

    @cached_property
    def poles(self) -> ComplexArray:
        """Closed-loop poles, in s or in δ = z − 1."""
        return self.closed_poles(1.0)

    @cached_property
    def known(self) -> Array:
        """Frequencies in rad/s, not zero, of open- and closed-loop poles."""
        found = np.concatenate([self.response.landmarks, landmarks(self.poles, self.step)])
        found = np.unique(found[np.isfinite(found)])
        return found[found > 1e-9 * found[-1]] if len(found) else found

    @property
    def last(self) -> float:
        """L at infinite frequency, or at half the sampling frequency.

        Infinite, of unknown sign, where a sampled loop has a pole at z = −1: it is real there,
        but of a pole within rounding of −1 nothing but the size is known.
        """
        if not self.step:
            return self.D
        value = complex(self.response(np.array([self.response.nyquist]))[0])
        lost = abs(value) >= 1 and abs(value.imag) > 1e-6 * abs(value)
        return np.inf if lost else float(value.real)

    def closed(self, factor: complex) -> ComplexArray | Array:
        """Return the state matrix of the loop closed with f·L."""
        if complex(factor).imag:
            fed = factor / (1 + factor * self.D) * (self.B @ self.C)
            return np.asarray(self.A - fed, dtype=complex)
        real = complex(factor).real
        return self.A - real / (1 + real * self.D) * (self.B @ self.C)

    def closed_poles(self, factor: complex) -> ComplexArray:
        """Return the poles of the loop closed with f·L, in s or in δ = z − 1."""
        return np.linalg.eigvals(self.closed(factor)).astype(complex)

    def growth(self, poles: ComplexArray) -> Array:
        """Return Re s, or (|z|² − 1)/2 from δ = z − 1: negative where a pole is stable."""
        return poles.real + (np.abs(poles) ** 2 / 2 if self.step else 0.0)

    def unstable(self, factor: complex) -> tuple[int, int]:
        """Return how many poles of the loop closed with f·L are unstable: at least, at most.

        What lies nearer to the limit than rounding, n·ε·‖A‖, may be either.
        """
        matrix = self.closed(factor)
        growth = self.growth(np.linalg.eigvals(matrix).astype(complex))
        # Of what was subtracted, and not of the difference; of z = 1 + δ where that is given.
        fed = matrix - self.A
        size = float(np.linalg.norm(self.A, 2) + np.linalg.norm(fed, 2)) if len(matrix) else 0.0
        rounding = len(matrix) * np.finfo(float).eps * (size + (1.0 if self.step else 0.0))
        return int(np.sum(growth > rounding)), int(np.sum(growth > -rounding))

    @property
    def stable_if_reversed(self) -> bool:
        """Whether the loop is stable with the opposite sign of the feedback, 1 − L."""
        return abs(1 - self.D) > 4 * float(np.finfo(float).eps) and not self.unstable(-1.0)[1]

    def points(self, omega: Array) -> ComplexArray:
        """Return s = jω, or δ = e^(jωT) − 1, for each ω in rad/s."""
        return axis_points(omega, self.step)

    def solved(self, omega: float) -> tuple[complex, float]:
        """Return L at ω by solving with A itself, and how far rounding of its entries moves it.

        The Schur form of `response` is exact for a matrix that differs from A by ε‖A‖, which
        beside fast lags is much for a slow, lightly damped mode.  A solve with one step of
        refinement is exact for one of which every entry differs by a few of its own ε.
        """
        point = complex(self.points(np.array([omega]))[0])
        matrix = point * np.eye(len(self.A)) - self.A
        try:
            x, y = (_refined(*pair) for pair in ((matrix, self.B[:, 0]), (matrix.T, self.C[0])))
        except np.linalg.LinAlgError:
            return complex(np.inf), np.inf
        moved = np.abs(y) @ np.abs(matrix) @ np.abs(x)
        rounding = len(matrix) * np.finfo(float).eps * moved
        return complex(self.C[0] @ x) + self.D, float(rounding)

    def steepest(self, omega: float, factor: complex) -> complex:
        """Return how the pole at jω moves with log f, in s or in δ: −L/L'."""
        point = self.points(np.array([omega]))
        with np.errstate(all="ignore"):
            return complex((-self.response.at(point) / self.response.slope(point))[0])


def _refined(matrix: ComplexArray, right: Array) -> ComplexArray:
    """Return the solution of a linear system after one step of refinement."""
    x = np.linalg.solve(matrix, right.astype(complex))
    return np.asarray(x + np.linalg.solve(matrix, right - matrix @ x))
