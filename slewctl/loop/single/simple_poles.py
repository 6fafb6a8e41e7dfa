"""Sums Σ r/(s − σ) over simple poles on the axis s = jv, conjugate pairs in real arithmetic.

Of 1/(jv − σ) = a + jb with a = −Re σ d, b = (Im σ − v) d and d = 1/|jv − σ|², the square is
2a² − d + 2jab: value and slope of all pairs are two products of real matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray, IntArray

# Numbers in one of the matrices of a pass: all of them stay in the cache.
_PASS = 12_000
# Pairs with less damping than this: to the lower pole it is as far as along the axis, nearly.
_LIGHT = 0.25
# Curvatures, 2|r| q³, are summed upward.
_UP = 2 + 1e-9


@dataclass(frozen=True, eq=False)
class Distances:
    """1/distance of poles from intervals, shape (n, m): of pairs both, and of those alone."""

    upper: Array
    lower: Array
    lone: Array


class SimplePoles:
    """Simple poles with their residues.

    Parameters
    ----------
    sigma : ndarray of complex, shape (n,)
    residue : ndarray of complex, shape (n, p)
    curving : ndarray, shape (n, k)
        Sizes of residues, of each kind of curvature that is wanted.

    Attributes
    ----------
    upper, lower, lone : ndarray of int
        The poles of pairs, whose residues are conjugates too, and the others.
    """

    def __init__(self, sigma: ComplexArray, residue: ComplexArray, curving: Array) -> None:
        self.upper, self.lower = _pairs(sigma, residue)
        alone = np.ones(len(sigma), dtype=bool)
        alone[self.upper] = alone[self.lower] = False
        self.lone = np.flatnonzero(alone)
        self.outputs = residue.shape[1]
        pair = sigma[self.upper, None]
        self.x, self.w, self.x2 = -pair.real, pair.imag.copy(), pair.real**2
        self.curving = _UP * np.maximum(curving[self.upper], curving[self.lower]).T
        self.lone_sigma, self.lone_residue = sigma[self.lone], residue[self.lone]
        self.lone_curving = _UP * curving[self.lone].T
        r, i = residue[self.upper].real.T, residue[self.upper].imag.T
        self.of_value = _beside([r, -i, r, i], [i, r, -i, r])
        of_real = [2 * i, 2 * r, -i, -2 * i, 2 * r, i]
        self.of_slope = _beside(of_real, [-2 * r, 2 * i, r, -2 * r, -2 * i, r])

    def values(self, v: Array) -> ComplexArray:
        """Return the sums at s = jv, shape (m, p)."""
        found = np.empty((2 * self.outputs, len(v)))
        for part in self._passes(len(v)):
            np.matmul(self.of_value, _rows(self._parts(v[part])[0]), out=found[:, part])
        sums = self._complex(found)
        return sums + self._of_lone(v) @ self.lone_residue if len(self.lone) else sums

    def slopes(self, v: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return the sums and their derivatives by v, shape (m, p)."""
        values, slopes = np.empty((2, 2 * self.outputs, len(v)))
        for part in self._passes(len(v)):
            parts, sizes = self._parts(v[part])
            squares = np.empty((2, 3, *sizes.shape[1:]))
            np.multiply(parts[:, 0], parts[:, 0], out=squares[:, 0])
            np.multiply(parts[:, 0], parts[:, 1], out=squares[:, 1])
            squares[:, 2] = sizes
            np.matmul(self.of_value, _rows(parts), out=values[:, part])
            np.matmul(self.of_slope, _rows(squares), out=slopes[:, part])
        value, slope = self._complex(values), self._complex(slopes)
        if len(self.lone):
            u = self._of_lone(v)
            value += u @ self.lone_residue
            slope -= 1j * ((u * u) @ self.lone_residue)
        return value, slope

    def enclosed(self, c: Array, h: Array) -> tuple[ComplexArray, ComplexArray, Array, Distances]:
        """Return sums and derivatives at c, curvatures on intervals [c − h, c + h], distances."""
        m, n = len(c), len(self.w)
        value, slope = self.slopes(c)
        curve, first = np.empty((len(self.curving), m)), c - h
        upper, lower = np.empty((2, n, m))
        for part in self._passes(m):
            q = np.abs(c[part] - self.w)
            q -= h[part]
            np.maximum(q, 0.0, out=q)
            q *= q
            q += self.x2
            np.divide(1.0, np.sqrt(q, out=q), out=q)
            far = first[part] + self.w
            np.divide(1.0, far, out=far)
            upper[:, part], lower[:, part] = q, far
            cubes = q * q
            cubes *= q
            far = far * far * far
            cubes += far
            np.matmul(self.curving, cubes, out=curve[:, part])
        lone = np.zeros((0, m))
        if len(self.lone):
            sigma = self.lone_sigma[:, None]
            aside = np.maximum(np.abs(c - sigma.imag) - h, 0.0)
            lone = 1 / np.sqrt(sigma.real**2 + aside * aside)
            curve += self.lone_curving @ (lone * lone * lone)
        return value, slope, curve.T, Distances(upper, lower, lone)

    def in_order(self, near: Distances) -> Array:
        """Return 1/distances in the order in which the poles were given, shape (m, n)."""
        found = np.empty((len(self.upper) * 2 + len(self.lone), near.lone.shape[1]))
        found[self.upper], found[self.lower] = near.upper, near.lower
        found[self.lone] = near.lone
        return found.T

    def _passes(self, m: int) -> list[slice]:
        columns = max(1, _PASS // max(len(self.w), 1))
        return [slice(start, start + columns) for start in range(0, m, columns)]

    def _parts(self, v: Array) -> tuple[Array, Array]:
        """Return a and b, shape (2, 2, N, m), and d of the upper and of the lower poles."""
        parts = np.empty((2, 2, len(self.w), len(v)))
        y, d = parts[:, 1], np.empty((2, len(self.w), len(v)))
        np.subtract(self.w, v, out=y[0])
        np.subtract(-self.w, v, out=y[1])
        np.multiply(y, y, out=d)
        d += self.x2
        np.divide(1.0, d, out=d)
        np.multiply(d, self.x, out=parts[:, 0])
        y *= d
        return parts, d

    def _complex(self, both: Array) -> ComplexArray:
        found = np.empty((self.outputs, both.shape[1]), dtype=complex)
        found.real, found.imag = both[: self.outputs], both[self.outputs :]
        return found.T

    def _of_lone(self, v: Array) -> ComplexArray:
        """Return 1/(jv − σ) of the poles that stand alone."""
        real, y = -self.lone_sigma.real, self.lone_sigma.imag - v[:, None]
        d = 1 / (real * real + y * y)
        u = np.empty(d.shape, dtype=complex)
        u.real, u.imag = real * d, y * d
        return u


def _beside(of_real: list[Array], of_imag: list[Array]) -> Array:
    """Return the weights of real and imaginary parts, one below the other."""
    return np.concatenate([np.concatenate(row, axis=1) for row in (of_real, of_imag)])


def _rows(parts: Array) -> Array:
    """Return all but the last axis as one."""
    return parts.reshape(-1, parts.shape[-1]) if parts.size else parts.reshape(0, parts.shape[-1])


def _pairs(sigma: ComplexArray, residue: ComplexArray) -> tuple[IntArray, IntArray]:
    """Return the poles above the axis whose conjugates, with conjugate residues, are there."""
    above, below = np.flatnonzero(sigma.imag > 0), np.flatnonzero(sigma.imag < 0)
    above = above[np.lexsort((sigma[above].imag, sigma[above].real))]
    below = below[np.lexsort((-sigma[below].imag, sigma[below].real))]
    if len(above) != len(below):
        return above[:0], below[:0]
    alike = sigma[above] == sigma[below].conj()
    alike &= (residue[above] == residue[below].conj()).all(axis=1)
    alike &= np.abs(sigma[above].real) < _LIGHT * sigma[above].imag
    return above[alike], below[alike]
