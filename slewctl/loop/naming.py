"""Names of the modes near which a margin is reached."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray

# A pole that is damped less than this rings, and is called a mode.
_RINGS = 0.3


@dataclass(frozen=True)
class Modes:
    """The modes by which frequencies are named.

    Attributes
    ----------
    hertz : tuple of float
        Natural frequencies of the flexible modes in Hz, increasing.
    rigid : bool
        Whether there is a rigid-body mode below them.
    """

    hertz: tuple[float, ...]
    rigid: bool = False

    def nearest(self, hertz: float | None, step: float = 0.0) -> str:
        """Return the name of the mode nearest to a frequency in Hz.

        With a sample time `step` in s a mode above half the sampling frequency is looked for
        where the samples show it.
        """
        if hertz is None or not (self.hertz or self.rigid):
            return ""
        known = np.array([0.0, *self.hertz]) if self.rigid else np.array(self.hertz)
        seen = np.abs(known - np.round(known * step) / step) if step else known
        k = int(np.argmin(np.abs(seen - hertz)))
        if self.rigid and k == 0:
            return "rigid body"
        alias = f", seen at {seen[k]:.4g} Hz" if abs(seen[k] - known[k]) > 1e-9 * known[k] else ""
        return f"mode {k if self.rigid else k + 1} ({known[k]:.4g} Hz{alias})"


def modes_of(poles: ComplexArray, step: float = 0.0) -> Modes:
    """Return the lightly damped poles as modes, and whether there are poles at the origin.

    Parameters
    ----------
    poles : ndarray of complex
        In s, or in δ = z − 1 with sample time `step` in s.
    """
    s = np.asarray(poles, dtype=complex)
    if step:
        s = s[np.abs(1 + s) > 1e-12]  # a pole at z = 0 is a delay
        s = np.log(1 + s) / step
    size = np.abs(s)
    # A double pole at the origin is computed to the square root of rounding.
    origin = size <= 1e-6 * size.max(initial=0.0)
    ringing = ~origin & (s.imag > 0) & (np.abs(s.real) < _RINGS * size)
    hertz: Array = np.sort(size[ringing]) / (2 * np.pi)
    return Modes(tuple(float(f) for f in hertz), bool(origin.any()))
