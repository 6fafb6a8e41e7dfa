"""L at many frequencies from the poles of the closed loop, and from what each contributes."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.frequency_response import axis_points
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modes import eigensystem


class Closed(Protocol):
    """A loop that is opened and closed; `Loop` is one."""

    @property
    def opened(self) -> LinearSystem: ...
    @property
    def linear(self) -> LinearSystem: ...


class ClosedResponse:
    """L = −H/(1 + H) with H = S − 1 = −C(s − A)⁻¹B, A the closed loop's.

    Its eigenvectors tell the cost too, so that this costs nothing more; where poles nearly meet
    digits are lost, and `off` tells how many.

    Parameters
    ----------
    loop : Closed
        L has no feedthrough.
    """

    def __init__(self, loop: Closed) -> None:
        self.opened, self.step = loop.opened, loop.opened.sample_time
        found = eigensystem(np.asarray(loop.linear.A))
        every = np.arange(len(found.poles))
        self.poles = found.poles - (1.0 if self.step else 0.0)
        self.residues = -found.residues(self.opened.B, self.opened.C, every)[:, 0, 0]

    def __call__(self, omega: Array) -> ComplexArray:
        """Return L at frequencies in rad/s."""
        returned = (1 / (axis_points(omega, self.step)[:, None] - self.poles)) @ self.residues
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(-returned / (1 + returned))

    def off(self, omega: float) -> float:
        """Return how far 1 + L is off at a frequency, relative to itself."""
        A, B, C, _ = self.opened.matrices
        s = axis_points(np.array([omega]), self.step)[0] + (1.0 if self.step else 0.0)
        true = 1 + complex((C @ np.linalg.solve(s * np.eye(len(A)) - A, B))[0, 0])
        return abs(1 + complex(self(np.array([omega]))[0]) - true) / abs(true)
