"""Where intervals end: what L is there decides of crossings and of the turns of 1 + L.

It is asked for when all intervals are done, of all ends together, and of those alone that
decide something.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.loop.single.findings import Points, sort_out

# 1 + L is at least so many times as far from zero as it moves: less than a quarter turn.
FARTHER = 1.001


@dataclass(eq=False)
class Monotone:
    """Intervals on which a function passes zero once at most, with its error and its roots'."""

    a: list[Array] = field(default_factory=list)
    b: list[Array] = field(default_factory=list)
    error: list[Array] = field(default_factory=list)
    off: list[Array] = field(default_factory=list)
    k: list[Array] = field(default_factory=list)

    def add(
        self, which: BoolArray, a: Array, b: Array, error: Array, off: Array, k: Array | IntArray
    ) -> None:
        """Add intervals; the function is vᵏ times a part of L, or of its size."""
        if which.any():
            for own, values in zip(self._lists, (a, b, error, off, k), strict=True):
                own.append(np.asarray(values[which], dtype=float))

    @property
    def _lists(self) -> tuple[list[Array], ...]:
        return self.a, self.b, self.error, self.off, self.k

    @property
    def arrays(self) -> tuple[Array, ...]:
        """a, b, error, off and k."""
        return tuple(np.concatenate([np.zeros(0), *own]) for own in self._lists)


@dataclass(eq=False)
class Turns:
    """Intervals on which 1 + L turns by less than half about zero, with its middle values."""

    a: list[Array] = field(default_factory=list)
    b: list[Array] = field(default_factory=list)
    middle: list[ComplexArray] = field(default_factory=list)
    short: list[BoolArray] = field(default_factory=list)

    def add(
        self, which: BoolArray, a: Array, b: Array, middle: ComplexArray, short: BoolArray
    ) -> None:
        """Add intervals: whether by less than a quarter to either side, or in the right half."""
        if which.any():
            self.a.append(a[which])
            self.b.append(b[which])
            self.middle.append(middle[which])
            self.short.append(short[which])

    @property
    def joined(self) -> Joined:
        """The intervals in their order."""
        a = np.concatenate([np.zeros(0), *self.a])
        order = np.argsort(a)
        b = np.concatenate([np.zeros(0), *self.b])[order]
        middle = np.concatenate([np.zeros(0, complex), *self.middle])[order]
        short = np.concatenate([np.zeros(0, bool), *self.short])[order]
        return Joined(a[order], b, middle, short)


@dataclass(frozen=True, eq=False)
class Joined:
    """Intervals in their order.

    From the middle of one to that of the next 1 + L turns by two quarters at most where both
    are short: as much as the two values say.
    """

    a: Array
    b: Array
    middle: ComplexArray
    short: BoolArray

    @property
    def _direct(self) -> BoolArray:
        """Whether the next interval begins where this one ends, and both are short."""
        return (self.b[:-1] == self.a[1:]) & self.short[:-1] & self.short[1:]

    @property
    def wanted(self) -> tuple[Array, Array]:
        """Where an interval begins and ends at which values are needed."""
        direct = self._direct
        return self.a[~np.append(False, direct)], self.b[~np.append(direct, False)]

    def turn(self, at: Callable[[Array], ComplexArray]) -> float:
        """Return the change of arg(1 + L) over all of them, given L at the wanted ends."""
        if not len(self.a):
            return 0.0
        direct, w = self._direct, self.middle
        left, right = ~np.append(False, direct), ~np.append(direct, False)
        parts = [
            w[1:][direct] / w[:-1][direct],
            w[left] / (1 + at(self.a[left])),
            (1 + at(self.b[right])) / w[right],
        ]
        return float(np.angle(np.concatenate(parts)).sum())


def settled(
    on_axis: Callable[[Array], ComplexArray],
    unit: tuple[Monotone, tuple[Points, Points]],
    real: tuple[Monotone, tuple[Points, Points]],
    turns: Turns,
) -> float:
    """Sort out crossings, and return the turn of 1 + L, from L at all ends that matter.

    Parameters
    ----------
    on_axis : callable
        From v to L.
    unit, real : tuple of Monotone and (Points, Points)
        Of |L| − 1 and of Im L, and into what to sort: passed, or not excluded.
    turns : Turns
    """
    joined = turns.joined
    one, other = unit[0].arrays, real[0].arrays
    points = np.unique(np.concatenate([*one[:2], *other[:2], *joined.wanted]))
    values = on_axis(points)

    def at(v: Array) -> ComplexArray:
        return np.asarray(values[np.searchsorted(points, v)])

    for (a, b, error, off, k), (_, into), of in ((one, unit, _excess), (other, real, np.imag)):
        signs = a**k * of(at(a)), b**k * of(at(b))
        sort_out(np.ones(len(a), dtype=bool), signs, error, off, (a, b), into)
    return joined.turn(at)


def _excess(L: ComplexArray) -> Array:
    return np.abs(L) - 1
