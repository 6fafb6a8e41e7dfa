"""Blocks whose poles are one, as the rigid body's are: sums of powers, without substitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.enclosed import Terms
from slewctl.numerics.modal_form import Block, ModalForm

Number = TypeVar("Number", np.float64, np.complex128)


@dataclass(frozen=True, eq=False)
class AtZero:
    """A block at the origin: Y (s − T)⁻¹ ξ = Σ_j m_j uʲ with u = a + b/s, j = 1 … k.

    Attributes
    ----------
    moments : ndarray of complex, shape (k, p)
        m_j = Y Tʲ⁻¹ ξ.
    a, b : complex
    """

    moments: ComplexArray
    a: complex
    b: complex

    @classmethod
    def of(cls, block: Block, form: ModalForm, terms: Terms) -> AtZero:
        """Return a nilpotent block of a form."""
        index, vector = block.index, form.entry[block.index]
        moments = []
        for _ in index:
            moments.append(form.shape[:, index] @ vector)
            vector = block.T @ vector
        return cls(np.array(moments), complex(terms.a[index[0]]), complex(terms.b[index[0]]))

    @property
    def order(self) -> int:
        """k."""
        return len(self.moments)

    @property
    def inverse_powers(self) -> ComplexArray:
        """Coefficients of s⁻ᵉ, e = 0 … k, shape (k + 1, p)."""
        found = np.zeros((self.order + 1, self.moments.shape[1]), complex)
        term = np.ones(1, complex)
        for moment in self.moments:
            term = np.polynomial.polynomial.polymul(term, [self.a, self.b])
            found[: len(term)] += term[:, None] * moment
        return found

    def values(self, s: ComplexArray) -> ComplexArray:
        """Return the functions at points s, shape (m, p)."""
        u = powers_of(self.a + self.b / s, self.order)
        return np.asarray(u[:, 1:] @ self.moments)

    def slopes(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the functions and their derivatives along the axis."""
        part = self.b / s
        u = powers_of(self.a + part, self.order)
        j = np.arange(1, self.order + 1)
        value = u[:, 1:] @ self.moments
        return value, (-1j * part / s)[:, None] * (u[:, :-1] @ (j[:, None] * self.moments))

    def enclosed(self, s: ComplexArray, q: Array) -> tuple[ComplexArray, ComplexArray, Array]:
        """Return value, slope and curvature along the axis, given 1/distances from zero.

        u′ = −b/s², |u″| ≤ 2|b| q³, and so |(uʲ)″| ≤ j(j−1) |u|ʲ⁻² |b|² q⁴ + 2j |u|ʲ⁻¹ |b| q³.
        """
        value, slope = self.slopes(s)
        j = np.arange(1, self.order + 1)
        size, b = np.abs(self.moments), abs(self.b)
        r = powers_of(abs(self.a) + b * q, self.order)
        q3 = (2 * b * q**3)[:, None]
        curve = q3 * (r[:, :-1] @ (j[:, None] * size))
        if self.order > 1:
            bent = (j * (j - 1))[1:, None] * size[1:]
            curve = curve + (q3 * (0.5 * b * q)[:, None]) * (r[:, :-2] @ bent)
        return value, slope, (1 + 1e-12) * curve


def powers_of(x: NDArray[Number], order: int) -> NDArray[Number]:
    """Return xʲ, j = 0 … order, shape (m, order + 1): `numpy.vander`, of a few columns."""
    found = np.empty((len(x), order + 1), x.dtype)
    found[:, 0] = 1
    for j in range(order):
        np.multiply(found[:, j], x, out=found[:, j + 1])
    return found


def majorant_powers(block: Block, vector: Array) -> Array:
    """Return |T|ʲ⁻¹ times a vector with positive entries, j = 1 … k, shape (k, k)."""
    T, found = np.abs(np.triu(block.T, 1)), [vector]
    for _ in range(len(vector) - 1):
        found.append(T @ found[-1])
    return np.array(found)
