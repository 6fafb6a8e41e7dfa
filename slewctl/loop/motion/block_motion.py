"""The motion of a block of modes that are not told apart: its states at many times at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray, IntArray

# A power series of what turns by less than one radian: 1/18! is less than 2e-16.
_TERMS = 19
# Steps are counted in numerals of this base.
_BASE = 32


@dataclass(frozen=True, eq=False)
class Swinging:
    """A block of fast modes, ẋ = T x.

    Attributes
    ----------
    T : ndarray, shape (k, k)
        Upper triangular.
    states : ndarray, shape (p, k)
        At the start of each piece.
    rows : ndarray, shape (signals, k)
        Of the signals.
    """

    T: ComplexArray
    states: ComplexArray
    rows: ComplexArray

    def combined(self, shares: Array) -> Swinging:
        """Return pieces (p,) that are sums of these, each times its share, shape (p, pieces)."""
        return replace(self, states=shares @ self.states)

    @cached_property
    def decay(self) -> float:
        """The largest real part of its eigenvalues."""
        return float(np.diag(self.T).real.max())

    @cached_property
    def coupling(self) -> float:
        """Norm of the triangle above the diagonal."""
        return triangle(self.T)

    @cached_property
    def rate(self) -> float:
        """Bound of ‖Tx‖/‖x‖."""
        return float(np.linalg.norm(self.T, 2))

    @cached_property
    def _shift(self) -> complex:
        """What the eigenvalues have in common; none is to the right of it."""
        return complex(self.decay, np.diag(self.T).imag.mean())

    @cached_property
    def _rest(self) -> ComplexArray:
        """T without its shift."""
        return np.asarray(self.T - self._shift * np.eye(len(self.T)))

    @cached_property
    def drift(self) -> float:
        """Norm of T without what its eigenvalues have in common."""
        return max(float(np.linalg.norm(self._rest, 2)), np.finfo(float).tiny)

    @cached_property
    def _steps(self) -> list[ComplexArray]:
        """Numeral j of the i-th place: e^(rest·j·base^i/drift), each shape (base, k, k)."""
        return []

    def _place(self, i: int) -> ComplexArray:
        """Return the i-th of these tables."""
        while len(self._steps) <= i:
            if self._steps:
                last = self._steps[-1]
                one = last[-1] @ last[1]
            else:
                one = self._series(
                    np.eye(len(self.T), dtype=complex), np.full(len(self.T), 1 / self.drift)
                ).T
            table = np.array([np.eye(len(one)), one])
            while len(table) < _BASE:
                table = np.concatenate([table, table @ (table[-1] @ one)])
            self._steps.append(table)
        return self._steps[i]

    def _series(self, states: ComplexArray, t: Array) -> ComplexArray:
        """Return e^(rest·t) x of each state, a row, for times below 1/drift."""
        term = moved = states
        for j in range(1, _TERMS):
            term = (term @ self._rest.T) * (t / j)[:, None]
            moved = moved + term
        return moved

    def at(self, piece: IntArray, tau: Array) -> ComplexArray:
        """Return the states at times `tau` after the starts of pieces, shape (m, k).

        A time is a number of steps of 1/drift, whose numerals are looked up, and a rest.
        """
        count = np.floor(tau * self.drift)
        moved = self._series(self.states[piece], tau - count / self.drift)
        i = 0
        while np.any(count):
            count, numeral = np.divmod(count, _BASE)
            moved = np.einsum("mij,mj->mi", self._place(i)[numeral.astype(int)], moved)
            i += 1
        return np.asarray(moved * np.exp(self._shift * tau)[:, None])

    def growth(self, length: Array) -> Array:
        """Bound ‖e^(Tt)‖ for all t from 0 to `length`."""
        rise = sum((self.coupling * length) ** j / math.factorial(j) for j in range(len(self.T)))
        return np.asarray(np.exp(np.maximum(self.decay, 0) * length) * rise)


def triangle(T: ComplexArray) -> float:
    """Return the norm of the part of T above the diagonal."""
    return float(np.linalg.norm(np.triu(T, 1), 2))
