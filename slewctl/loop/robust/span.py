"""Functions on intervals of the axis, and what becomes of them by sums, products and squares.

As `slewctl.loop.single.enclosed`, without errors: those of lines are told apart, as distances.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray


@dataclass(frozen=True, eq=False)
class Span:
    """f ∈ value + slope δ ± curve δ²/2 for |δ| ≤ h.

    Attributes
    ----------
    h : ndarray, shape (m,) or (m, 1)
    value, slope : ndarray, shape (m,) or (m, p), complex or real
    curve : ndarray, of the same shape
        A bound of |f″|.
    """

    h: Array
    value: ComplexArray
    slope: ComplexArray
    curve: Array

    @cached_property
    def away(self) -> Array:
        """How far f may be from its value in the middle."""
        return np.abs(self.slope) * self.h + 0.5 * self.h * self.h * self.curve

    @cached_property
    def most(self) -> Array:
        """The largest |f|."""
        return np.asarray(np.abs(self.value) + self.away)

    @cached_property
    def steepest(self) -> Array:
        """The largest |f′|."""
        return np.asarray(np.abs(self.slope) + self.h * self.curve)

    def __add__(self, other: Span) -> Span:
        return Span(self.h, self.value + other.value, self.slope + other.slope,
                    self.curve + other.curve)  # fmt: skip

    def __sub__(self, other: Span) -> Span:
        return Span(self.h, self.value - other.value, self.slope - other.slope,
                    self.curve + other.curve)  # fmt: skip

    def __mul__(self, other: Span) -> Span:
        return Span(
            self.h,
            self.value * other.value,
            self.slope * other.value + self.value * other.slope,
            self.curve * other.most + 2 * self.steepest * other.steepest + self.most * other.curve,
        )

    def __getitem__(self, columns: IntArray) -> Span:
        """Return some of several functions."""
        return Span(self.h, self.value[:, columns], self.slope[:, columns], self.curve[:, columns])

    @property
    def column(self) -> Span:
        """One function, of shape (m,), as the only one of several."""
        return Span(self.h[:, None], self.value[:, None], self.slope[:, None], self.curve[:, None])

    @property
    def sizes(self) -> Span:
        """Σ |f|² of several functions, shape (m,)."""
        slope = 2 * (self.value.conj() * self.slope).real
        curve = 2 * (self.steepest**2 + self.most * self.curve)
        return Span(self.h[:, 0], (np.abs(self.value) ** 2).sum(1), slope.sum(1), curve.sum(1))

    @property
    def total(self) -> Span:
        """Σ f of several functions, shape (m,)."""
        return Span(self.h[:, 0], self.value.sum(1), self.slope.sum(1), self.curve.sum(1))


def chosen(here: BoolArray, one: Span, other: Span) -> Span:
    """Return one function on some intervals, another on all others."""
    pick = here[:, None] if one.value.ndim == 2 else here
    return Span(
        other.h,
        np.where(pick, one.value, other.value),
        np.where(pick, one.slope, other.slope),
        np.where(pick, one.curve, other.curve),
    )


def power(c: Array, h: Array, k: int) -> Span:
    """Return sᵏ at s = jv on the intervals [c − h, c + h], shape (m,)."""
    s = np.asarray(1j * c, dtype=complex)
    if not k:
        return Span(h, np.ones_like(s), np.zeros_like(s), np.zeros_like(c))
    bend = k * (k - 1) * (c + h) ** max(k - 2, 0)
    return Span(h, s**k, 1j * k * s ** (k - 1), bend)


def polynomial(c: Array, h: Array, coefficients: ComplexArray) -> Span:
    """Return Σ aᵢ sⁱ at s = jv, shape (m, p), from aᵢ, shape (k, p)."""
    s, far = np.asarray(1j * c, dtype=complex)[:, None], (c + h)[:, None]
    shape = (len(c), coefficients.shape[1])
    value, slope, curve = np.zeros(shape, complex), np.zeros(shape, complex), np.zeros(shape)
    for i, a in enumerate(coefficients):
        value = value + a * s**i
        if i:
            slope = slope + 1j * i * a * s ** (i - 1)
        if i > 1:
            curve = curve + i * (i - 1) * np.abs(a) * far ** (i - 2)
    return Span(h[:, None], value, slope, curve)
