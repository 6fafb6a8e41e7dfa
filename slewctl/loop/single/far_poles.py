"""Curvature of slow poles together, seen from far: their residues may cancel all but a part.

Of a leaky integrator beside a slow friction and a slow filter each residue may be a million
times their sum, and so is a sum of sizes.  From farther than all of them they are

    Σ r/(s − σ) = Σ_j m_j s^(−j−1),    m_j = Σ r σʲ,

where the first few moments, as they are, and bounds of the others by a geometric series give
|d²/dv²| ≤ Σ_j (j + 1)(j + 2) |m_j| |s|^(−j−3).  A triangular block has the moments Y Tʲ ξ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.modal_bounds import ROUNDING
from slewctl.numerics.modal_form import Block, ModalForm

# Moments that are taken as they are, and from how many times their size on poles are far.
_MOMENTS, _FAR = 10, 16.0
# How much slower than the next ones poles together are, and how much less they must bend, so
# many times their size away, than each by itself.
_APART, _LESS, _AWAY = 8.0, 30.0, 1000.0


@dataclass(frozen=True, eq=False)
class FarPoles:
    """Some slow poles of a factor.

    Attributes
    ----------
    sigma, size : ndarray, shapes (k,), (k, p)
        The other simple poles, and sizes of their residues.
    blocks : frozenset of int
        Those that belong to it.
    growth : float
        What is left after the first moments grows by this from one to the next.
    moments : ndarray, shape (_MOMENTS + 1, p)
        Bounds of |m_j|, the last of all that follow but for their growth.
    """

    sigma: ComplexArray
    size: Array
    blocks: frozenset[int]
    growth: float
    moments: Array

    def lower(self, curve: Array, c: Array, h: Array, blocks: list[Array]) -> None:
        """Put the bounds with them together where those are less, on [c − h, c + h].

        Parameters
        ----------
        curve : ndarray, shape (m, p)
            Bounds of the curvature, changed in place.
        c, h : ndarray, shape (m,)
        blocks : list of ndarray, shape (m, p)
            What each block adds to it.
        """
        far = c - h >= _FAR * self.growth
        if not far.any():
            return
        c, h = c[far], h[far]
        aside = np.maximum(np.abs(c[:, None] - self.sigma.imag) - h[:, None], 0.0)
        found = 2 * (1 + 1e-9) * np.hypot(self.sigma.real, aside) ** -3 @ self.size
        found += self.curve(c - h)
        for k, bend in enumerate(blocks):
            if k not in self.blocks:
                found += bend[far]
        curve[far] = np.minimum(curve[far], found)

    def curve(self, nearest: Array) -> Array:
        """Return the bounds, shape (m, p), where that is far."""
        j = np.arange(_MOMENTS + 1)
        powers = nearest[:, None] ** -(j + 3.0) * ((j + 1) * (j + 2))
        # (J + i + 1)(J + i + 2) is no more than (i + 1)(i + 2)/2 times that of i = 0.
        powers[:, -1] /= (1 - self.growth / nearest) ** 3
        return np.asarray(powers @ self.moments)


# T, Y and ξ of a block, shapes (k, k), (p, k) and (k,).
Triangle: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray]


def far_poles(
    sigma: ComplexArray, residue: ComplexArray, form: ModalForm, blocks: Mapping[int, Block]
) -> list[FarPoles]:
    """Return the groups of slow poles that cancel most of each other.

    Parameters
    ----------
    sigma, residue : ndarray, shapes (n,), (n, p)
        Simple poles.
    form : ModalForm
    blocks : mapping of int to Block
        Those that may belong to a group, by their numbers; of a continuous form.
    """
    triangles = {k: _triangle(block, form) for k, block in blocks.items()}
    own = {k: float(np.abs(T).sum(axis=1).max()) for k, (T, _, _) in triangles.items()}
    steps = np.sort([*np.abs(sigma), *own.values()])
    found = []
    for end, after in zip(steps, np.append(steps, np.inf)[1:], strict=True):
        if not (end and after > _APART * end):
            continue
        slow, inside = np.abs(sigma) <= end, frozenset(k for k, size in own.items() if size <= end)
        parts = [triangles[k] for k in inside]
        growth, moments, each = _group(sigma[slow], residue[slow], parts)
        rest = np.abs(residue[~slow])
        group, away = FarPoles(sigma[~slow], rest, inside, growth, moments), _AWAY * growth
        if np.any(_LESS * group.curve(np.array([away]))[0] < 2 * each / away**3):
            found.append(group)
    return found


def _triangle(block: Block, form: ModalForm) -> Triangle:
    T = np.triu(block.T, 1) + np.diag(form.poles[block.index])
    return T, form.shape[:, block.index], form.entry[block.index]


def _group(
    sigma: ComplexArray, residue: ComplexArray, blocks: list[Triangle]
) -> tuple[float, Array, Array]:
    """Return growth and moments of some poles, and what their sizes add up to."""
    size = len(sigma) + sum(len(T) for T, _, _ in blocks)
    T = np.zeros((size, size), complex)
    T[range(len(sigma)), range(len(sigma))] = sigma
    Y, w = np.zeros((residue.shape[1], size), complex), np.ones(size, complex)
    Y[:, : len(sigma)] = residue.T
    start = len(sigma)
    for own, shape, entry in blocks:
        here = slice(start, start + len(own))
        T[here, here], Y[:, here], w[here] = own, shape, entry
        start += len(own)
    most, absolute = np.abs(w), np.abs(T)
    moments, majorants = [], []
    for _ in range(_MOMENTS):
        moments.append(np.abs(Y @ w))
        majorants.append(np.abs(Y) @ most)
        w, most = T @ w, absolute @ most
    rounding = ROUNDING * size * (1 + np.arange(_MOMENTS))[:, None]
    bounds = np.array(moments) + rounding * np.array(majorants)
    # |T| x ≤ growth x for x = most, and so for all that follow (Collatz and Wielandt).
    grown = absolute @ most
    growth = float(np.max(np.divide(grown, most, out=np.zeros(size), where=grown > 0)))
    return growth, np.vstack([bounds, np.abs(Y) @ most]) * (1 + 1e-9), majorants[0]
