"""Axes: where a value stands on one, and which values are marked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array

# Steps between marks, as multiples of a power of ten.
_STEPS = (1.0, 2.0, 5.0, 10.0)
_MOST_MARKS = 6
# Fewer decades than these are marked at 1, 2 and 5 too.
_FEW_DECADES = 2.2

# By powers of a thousand; and between which values a mark is short without them.
_PREFIXES = {-4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}
_FEW_DIGITS = 1e-2, 1e4


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    Attributes
    ----------
    label : str
    low, high : float
        Its ends.
    kind : {"linear", "log", "symlog"}
        The last is linear between −`bend` and `bend`, and logarithmic beyond.
    bend : float
    step : float
        What the marks of a linear axis are multiples of, such as 90 of degrees; zero for
        any.
    """

    label: str
    low: float
    high: float
    kind: Literal["linear", "log", "symlog"] = "linear"
    bend: float = 0.0
    step: float = 0.0

    def bent(self, values: Array | float) -> Array:
        """Return what the axis is linear in."""
        values = np.asarray(values, dtype=float)
        if self.kind == "log":
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.asarray(np.log10(values))
        if self.kind == "symlog":
            far = np.maximum(np.abs(values) / self.bend, 1.0)
            near = np.clip(values / self.bend, -1.0, 1.0)
            return np.asarray(near + np.sign(values) * np.log10(far))
        return values

    def at(self, values: Array | float) -> Array:
        """Return where values stand: zero at the low end, one at the high."""
        low, high = self.bent(self.low), self.bent(self.high)
        return np.asarray((self.bent(values) - low) / (high - low))

    def marks(self) -> list[tuple[float, str]]:
        """Return the marked values with their text."""
        inside = [v for v in self._candidates() if -1e-9 <= self.at(v) <= 1 + 1e-9]
        return [(v, f"{v:g}".replace("-", "−")) for v in inside]

    def _candidates(self) -> list[float]:
        if self.kind == "log":
            return _decades(self.low, self.high)
        if self.kind == "symlog":
            far = _decades(self.bend, max(abs(self.low), self.high))
            return [-v for v in reversed(far)] + [0.0] + far
        step = self._step()
        first, last = np.ceil(self.low / step - 1e-9), np.floor(self.high / step + 1e-9)
        return [float(k) * step + 0.0 for k in range(int(first), int(last) + 1)]

    def _step(self) -> float:
        """Return the least of the usual steps that leaves few enough marks."""
        rough = (self.high - self.low) / _MOST_MARKS
        if self.step:
            return float(self.step * 2 ** max(np.ceil(np.log2(rough / self.step)), 0))
        power = 10.0 ** np.floor(np.log10(rough))
        return float(next(s for s in _STEPS if s * power >= rough * (1 - 1e-9)) * power)


def _decades(low: float, high: float) -> list[float]:
    """Return the powers of ten from one value to another, with more between if they are few."""
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    if np.log10(high / low) < _FEW_DECADES:
        return [m * 10.0**k for k in range(first, last + 1) for m in (1, 2, 5)]
    every = -(-(last - first) // (2 * _MOST_MARKS))
    return [10.0**k for k in range(first, last + 1) if k % every == 0]


def prefixed(values: Array, unit: str, usual: int = 0) -> tuple[float, str]:
    """Return a factor and a unit in which marks of an axis have few digits.

    Parameters
    ----------
    values : ndarray
    unit : str
        Without prefix.
    usual : int
        The power of a thousand, or of a thousandth, that is taken where it does.

    Returns
    -------
    factor : float
    unit : str
        With its prefix, such as ``mm``.
    """
    known = np.abs(values[np.isfinite(values)])
    most, power = float(known.max(initial=0.0)), usual
    if most > 0 and not _FEW_DIGITS[0] <= most / 1000.0**usual < _FEW_DIGITS[1]:
        power = int(np.clip(np.floor(np.log10(most) / 3), min(_PREFIXES), max(_PREFIXES)))
    return 1000.0**-power, f"{_PREFIXES[power]}{unit}"


def around(values: Array, margin: float = 0.05) -> tuple[float, float]:
    """Return ends of a linear axis that hold values, and a little more; never the same twice."""
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    room = margin * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room
