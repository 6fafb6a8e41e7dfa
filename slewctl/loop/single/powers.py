"""Blocks whose poles are one, as the rigid body's are: sums of powers, without substitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.enclosed import Terms
from slewctl.numerics.modal_form import Block, ModalForm

T = TypeVar("T", Array, ComplexArray)


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

    def values(self, s: ComplexArray) -> ComplexArray:
        """Return the functions at points s, shape (m, p)."""
        return np.asarray(_powers(self.a + self.b / s, self.order)[:, 1:] @ self.moments)

    def enclosed(self, s: ComplexArray, q: Array) -> tuple[ComplexArray, ComplexArray, Array]:
        """Return value, slope and curvature along the axis, given 1/distances from zero.

        u′ = −b/s², |u″| ≤ 2|b| q³, and so |(uʲ)″| ≤ j(j−1) |u|ʲ⁻² |b|² q⁴ + 2j |u|ʲ⁻¹ |b| q³.
        """
        part = self.b / s
        u = _powers(self.a + part, self.order)
        j = np.arange(1, self.order + 1)
        value = u[:, 1:] @ self.moments
        slope = (-1j * part / s)[:, None] * (u[:, :-1] @ (j[:, None] * self.moments))
        size, b = np.abs(self.moments), abs(self.b)
        r = _powers(abs(self.a) + b * q, self.order)
        q3 = (2 * b * q**3)[:, None]
        curve = q3 * (r[:, :-1] @ (j[:, None] * size))
        if self.order > 1:
            bent = (j * (j - 1))[1:, None] * size[1:]
            curve = curve + (q3 * (0.5 * b * q)[:, None]) * (r[:, :-2] @ bent)
        return value, slope, (1 + 1e-12) * curve


def majorant_powers(block: Block, vector: Array) -> Array:
    """Return |T|ʲ⁻¹ times a vector with positive entries, j = 1 … k, shape (k, k)."""
    T, found = np.abs(np.triu(block.T, 1)), [vector]
    for _ in range(len(vector) - 1):
        found.append(T @ found[-1])
    return np.array(found)


def _powers(u: T, most: int) -> T:
    """Return 1, u, … u^most, shape (m, most + 1)."""
    found: T = np.ones((len(u), most + 1), dtype=u.dtype)
    for j in range(most):
        found[:, j + 1] = found[:, j] * u
    return found
