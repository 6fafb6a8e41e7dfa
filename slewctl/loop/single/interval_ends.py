"""Where intervals end: what L is there decides of crossings and of the turns of 1 + L.

It is asked for when all intervals are done, of all ends together, and of those alone that
decide something.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.loop.single.findings import Points, sort_out

AnyArray = np.ndarray[Any, Any]

# |S| is 1/√2 where |1 + L| is this.
LEVEL_OF_S = math.sqrt(2)
# 1 + L is at least so many times as far from zero as it moves: less than a quarter turn.
FARTHER = 1.001


class Gathered:
    """Intervals, and what is known of each, gathered in several passes.

    Parameters
    ----------
    *kinds : type
        Of the numbers in each column.
    """

    def __init__(self, *kinds: type) -> None:
        self._parts: list[list[AnyArray]] = [[np.zeros(0, kind)] for kind in kinds]

    def add(self, which: BoolArray, *columns: AnyArray) -> None:
        """Add some of the intervals of a pass."""
        if which.any():
            for part, values in zip(self._parts, columns, strict=True):
                part.append(values[which])

    @property
    def columns(self) -> tuple[AnyArray, ...]:
        """All of each column."""
        return tuple(np.concatenate(part) for part in self._parts)


def monotone() -> Gathered:
    """Return a place for intervals on which vᵏ times a part of L, or of its size, is zero once.

    Columns: their ends a and b, the error of the function, how far off its root may be, and k.
    """
    return Gathered(float, float, float, float, float)


def turns() -> Gathered:
    """Return a place for intervals on which 1 + L turns by less than half about zero.

    Columns: their ends a and b, the value in the middle, and whether it turns by less than a
    quarter to either side; else it is in the right half.
    """
    return Gathered(float, float, complex, bool)


@dataclass(frozen=True, eq=False)
class Joined:
    """Intervals of `turns` in their order.

    From the middle of one to that of the next 1 + L turns by two quarters at most where both
    are short: as much as the two values say.
    """

    a: Array
    b: Array
    middle: ComplexArray
    short: BoolArray

    @classmethod
    def of(cls, gathered: Gathered) -> Joined:
        """Put intervals in their order."""
        columns = gathered.columns
        order = np.argsort(columns[0])
        return cls(*(column[order] for column in columns))

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
    unit: tuple[Gathered, tuple[Points, Points]],
    real: tuple[Gathered, tuple[Points, Points]],
    level: tuple[Gathered, tuple[Points, Points]],
    turning: Gathered,
) -> float:
    """Sort out crossings, and return the turn of 1 + L, from L at all ends that matter.

    Parameters
    ----------
    on_axis : callable
        From v to L.
    unit, real, level : tuple of Gathered and (Points, Points)
        Those of `monotone`, of |L| − 1, of Im L and of |1 + L| − √2, and into what to sort:
        passed, or not excluded.
    turning : Gathered
        Those of `turns`.
    """
    joined = Joined.of(turning)
    asked = [(kind[0].columns, kind[1]) for kind in (unit, real, level)]
    ends = (end for columns, _ in asked for end in columns[:2])
    points = np.unique(np.concatenate([*ends, *joined.wanted]))
    values = on_axis(points)

    def at(v: Array) -> ComplexArray:
        return np.asarray(values[np.searchsorted(points, v)])

    parts: tuple[Callable[[ComplexArray], Array], ...] = (_excess, np.imag, _above)
    for ((a, b, error, off, k), into), of in zip(asked, parts, strict=True):
        signs = a**k * of(at(a)), b**k * of(at(b))
        sort_out(np.ones(len(a), dtype=bool), signs, error, off, (a, b), into)
    return joined.turn(at)


def _excess(L: ComplexArray) -> Array:
    return np.abs(L) - 1


def _above(L: ComplexArray) -> Array:
    return np.abs(1 + L) - LEVEL_OF_S
