"""Functions on intervals of the axis: value, slope, curvature, error, and their products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray


@dataclass(frozen=True, eq=False)
class Enclosed:
    """p functions on m intervals of half-width h: X ∈ value + slope δ ± (curve δ²/2 + error).

    Attributes
    ----------
    value, slope : ndarray of complex, shape (m, p)
    curve, error : ndarray, shape (m, p)
    flat : ndarray, shape (m, p)
        The curvature of sᵏ X, k the order of its pole at zero.
    """

    value: ComplexArray
    slope: ComplexArray
    curve: Array
    error: Array
    flat: Array


@dataclass(frozen=True, eq=False)
class Terms:
    """a + b/(s − σ) of single poles, or of those of a block: shape (n,)."""

    sigma: ComplexArray
    a: ComplexArray
    b: ComplexArray

    @classmethod
    def of(cls, poles: ComplexArray, sampled: bool) -> Terms:
        if not sampled:
            return cls(poles, np.zeros_like(poles), np.ones_like(poles))
        with np.errstate(divide="ignore", invalid="ignore"):  # at z = −1
            twice = 2 + poles
            return cls(poles / twice, -1 / twice, 2 / twice**2)


def product_curve(
    h: Array,
    X: tuple[ComplexArray, ComplexArray, Array],
    Y: tuple[ComplexArray, ComplexArray, Array],
) -> Array:
    """Return a bound of |(XY)″| on intervals from value, slope and curvature of X and Y."""
    X0, X1 = reach(h, *X)
    Y0, Y1 = reach(h, *Y)
    return X[2] * Y0 + 2 * X1 * Y1 + X0 * Y[2]


def reach(h: Array, value: ComplexArray, slope: ComplexArray, curve: Array) -> tuple[Array, Array]:
    """Return the largest |X| and |X′| on intervals of half-width h."""
    steep = np.abs(slope)
    return np.abs(value) + h * steep + h * h / 2 * curve, steep + h * curve


def from_segment(L: ComplexArray, slope: ComplexArray, h: Array, point: float) -> Array:
    """Return the distance of the segments L + slope δ, |δ| ≤ h, from a real point."""
    away, size = point - L, np.abs(slope) ** 2
    t = (away * slope.conj()).real / np.where(size > 0, size, 1.0)
    return np.abs(away - np.clip(t, -h, h) * slope)
