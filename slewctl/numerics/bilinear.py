"""A system on the imaginary axis: itself, or what a sampled one becomes in z = (1 + s)/(1 − s).

Level sets and real-axis crossings are eigenvalues on the imaginary axis.  The bilinear map
carries the unit circle there, ω = 2 arctan(v)/T for s = jv, so that one set of eigenvalue
problems serves both.  A pole at z = −1 would go to infinity; the circle is then turned
first, z = e^(jθ)(1 + s)/(1 − s), at the price of complex matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.balance import balance_system
from slewctl.numerics.frequency_response import sample_time
from slewctl.numerics.linear_system import LinearSystem

Matrix = Array | ComplexArray
# A pole nearer to −1 than this is turned away from it.
_NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class Equivalent:
    """A balanced continuous system with the same values on the axis.

    Attributes
    ----------
    A, B, C, D : ndarray
        Complex where the circle was turned.
    sample_time : float
        Zero where the system was continuous.
    turn : float
        θ in rad.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    sample_time: float
    turn: float = 0.0

    def omega(self, v: Array) -> Array:
        """Return the frequency in rad/s, not negative, that lies at s = jv."""
        v = np.asarray(v, dtype=float)
        if not self.sample_time:
            return np.abs(v)
        angle = self.turn + 2 * np.arctan(v)
        return np.asarray(np.abs(np.angle(np.exp(1j * angle))) / self.sample_time)

    def near_axis(self, values: ComplexArray, tolerance: float = 2e-2) -> Array:
        """Return the frequencies of eigenvalues near the axis, relative to their size.

        A loose test costs evaluations; a tight one would lose close pairs and flat peaks.
        """
        near = values[np.abs(values.real) <= tolerance * np.abs(values)]
        return self.omega(near.imag)


def equivalent(system: LinearSystem) -> Equivalent:
    """Return the continuous system whose axis is the axis or unit circle of `system`."""
    A, B, C, D = (np.asarray(getattr(system, name), dtype=float) for name in "ABCD")
    step = sample_time(system)
    if not step or not len(A):
        return Equivalent(*_balanced(A, B, C), D, step)
    poles = np.linalg.eigvals(A)
    turn = 0.0
    if np.abs(poles + 1).min() < _NEAR:
        angles = np.linspace(0.1, np.pi, 32)
        distance = np.abs(poles[:, None] + np.exp(1j * angles)).min(axis=0)
        turn = float(angles[np.argmax(distance)])
    back = np.exp(-1j * turn) if turn else 1.0
    eye = np.eye(len(A))
    inverse = np.linalg.inv(back * A + eye)
    return Equivalent(
        *_balanced(
            inverse @ (back * A - eye), np.sqrt(2) * back * inverse @ B, np.sqrt(2) * C @ inverse
        ),
        D - back * C @ inverse @ B,
        step,
        turn,
    )


def _balanced(A: Matrix, B: Matrix, C: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Balance A by powers of two, and let B and C enter with equal size."""
    if not len(A):
        return A, B, C
    scale: Any = balance_system(A, B, C)  # real beside matrices that may be complex
    b, c = B / scale[:, None], C * scale
    ratio = np.sqrt(np.linalg.norm(c) / np.linalg.norm(b)) if b.any() and c.any() else 1.0
    return np.asarray(A / scale[:, None] * scale), np.asarray(b * ratio), np.asarray(c / ratio)
