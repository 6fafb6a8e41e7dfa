"""Two graphs of one dimension each, and the angle between them on intervals of the axis.

With directions x and y, shape p + 1, the chordal distance of two plants is |x ∧ y|/(|x||y|),
and what a controller u = K y leaves of it is |x·(m₂, −m₂K)|/(|x||y|): a quotient N/(PQ) of
squares whose numerator is enclosed by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.loop.robust.graph_line import Direction, GraphLine, Near, inverse_curves
from slewctl.loop.robust.span import Span, chosen, polynomial


@dataclass(frozen=True, eq=False)
class Angle:
    """sin² = N/(PQ) on intervals, with what the winding number needs.

    Attributes
    ----------
    N, P, Q : Span
        Squares, of shape (m,).
    bounds : ndarray, shape (2, m)
        The sine is between them.
    sure : ndarray of bool, shape (m,)
        Whether the inner product turns by less than half a turn.
    taken : tuple of ndarray of int, shape (m,)
        The poles by which x and y are multiplied.
    lengths : ndarray, shape (2, m)
        |(1, A)| and |(1, B)| are larger.
    """

    N: Span
    P: Span
    Q: Span
    bounds: Array
    sure: BoolArray
    taken: tuple[IntArray, IntArray]
    lengths: Array

    @property
    def sine(self) -> Array:
        """In the middle."""
        return np.sqrt(self.N.value / (self.P.value * self.Q.value))

    @cached_property
    def PQ(self) -> Span:
        """P Q."""
        return self.P * self.Q


def _angle(
    W: Span, x: Span, y: Span, m: tuple[Span, Span], taken: tuple[IntArray, IntArray],
    product: Span | None = None,
) -> Angle:  # fmt: skip
    """Return the angle of which |W| is the sine times |x||y|.

    Parameters
    ----------
    W, x, y : Span
    m : tuple of Span
        What (1, A) and (1, B) were multiplied by.
    taken : tuple of ndarray of int
    product : Span, optional
        Whose turns are counted; x*y of what is known of x and y else.
    """
    P, Q, size = x.sizes, y.sizes, np.sqrt((np.abs(W.value) ** 2).sum(1))
    away = np.sqrt((W.away**2).sum(1))
    dx, dy = (np.sqrt((z.away**2).sum(1) / z2.value) for z, z2 in ((x, P), (y, Q)))
    known = [np.sqrt(P.value), np.sqrt(Q.value)]
    shortest = np.array([known[0] * np.maximum(1 - dx, 0.0), known[1] * np.maximum(1 - dy, 0.0)])
    longest = known[0] * known[1] * (1 + dx) * (1 + dy)
    with np.errstate(divide="ignore"):
        most = (size + away) / shortest.prod(axis=0)
    bounds = np.array([np.maximum(size - away, 0.0) / longest, most])
    if product is None:
        cosine = np.sqrt(np.maximum(1 - W.sizes.value / (P.value * Q.value), 0.0))
        sure = dx + dy + dx * dy < cosine * (1 - 1e-9) - 1e-12
    else:
        sure = np.abs(product.value) > product.away
    lengths = shortest / np.array([z.most[:, 0] for z in m])
    return Angle(W.sizes, P, Q, bounds, sure, taken, lengths)


class Lines(Protocol):
    """What a search of the axis asks of two lines."""

    first: GraphLine
    second: GraphLine
    larger: bool  # whether the largest angle is wanted, and not the smallest

    def enclosed(self, c: Array, h: Array, low: BoolArray) -> Angle: ...
    def product(self, one: ComplexArray, two: ComplexArray) -> complex: ...
    def on_axis(self, v: Array) -> tuple[ComplexArray, Array]: ...
    def turn(self, a: Array, b: Array, taken: tuple[IntArray, IntArray]) -> Array: ...
    def sine(self, one: Direction, two: Direction) -> float: ...


class Distance:
    """The chordal distance of two plants, as many outputs each.

    Parameters
    ----------
    first, second : GraphLine
    """

    larger = True

    def __init__(self, first: GraphLine, second: GraphLine) -> None:
        self.first, self.second = first, second
        self.i, self.j = np.triu_indices(len(first.D), 1)
        one, two = first.sigma, second.sigma
        ones, twos = _pairs(one, two)
        self._ones, self._twos = ones, twos
        self._lone = np.setdiff1d(np.arange(len(one)), ones)
        self._other_lone = np.setdiff1d(np.arange(len(two)), twos)
        # Of each pole its partner; the last is of none.
        self._partner = np.full(len(one) + 1, len(two))
        self._partner[ones] = twos
        self._back = np.full(len(two) + 1, len(one))
        self._back[twos] = ones
        self._apart = np.abs(one[ones] - two[twos])
        self._changed = np.abs(second.residue[twos] - first.residue[ones])
        self._rigid = _difference(first.rigid, second.rigid)

    def enclosed(self, c: Array, h: Array, low: BoolArray) -> Angle:
        """Return the angle on intervals, some of them near the origin."""
        one, two = self.first, self.second
        near, other = one.near(c, h), two.near(c, h)
        taken = self._nearest(near, other, low)
        near, other = near.without(taken[0]), other.without(taken[1])
        A, B = one.rest(c, h, near, low), two.rest(c, h, other, low)
        E = Span(A.h, B.value - A.value, B.slope - A.slope, self._bend(c, h, near, other, low, B))
        A = Span(A.h, A.value, A.slope, A.curve + one.bend(near))
        B = Span(B.h, B.value, B.slope, B.curve + two.bend(other))
        m, n = (
            line.multiplier(c, h, own, low).column
            for line, own in zip((one, two), taken, strict=True)
        )
        rho, other_rho = one.taken(c, h, taken[0], low), two.taken(c, h, taken[1], low)
        x, y = m * A + rho, n * B + other_rho
        # x ∧ y = n x ∧ E + (1, A) ∧ (m ρ₂ − n ρ₁) + ρ₁ ∧ ρ₂, each small where the plants agree.
        i, j = self.i, self.j
        cross, double = self._cross(c, h, taken, low, (m, n), (rho, other_rho))
        W = n * (x[i] * E[j] - x[j] * E[i]) + (A[i] * cross[j] - A[j] * cross[i]) + double
        return _angle(W, x, y, (m, n), taken)

    def _bend(self, c: Array, h: Array, near: Near, other: Near, low: BoolArray, B: Span) -> Array:
        """Return bounds of the curvature of B − A, pole by pole where these are near."""
        one, two = self.first, self.second
        pairs = np.maximum(near.q[:, self._ones], other.q[:, self._twos])
        cubes = pairs * pairs * pairs
        found = (2 + 1e-9) * (cubes @ self._changed)
        moved = cubes * np.minimum(3 * self._apart * pairs, 2.0)
        found += (2 + 1e-9) * (moved @ one.size[self._ones])
        for line, own, lone in ((one, near, self._lone), (two, other, self._other_lone)):
            if len(lone):
                found += line.bend(own, lone)
        order = len(self._rigid) - 1
        if order:
            found += inverse_curves(c - h, order, low) @ np.abs(self._rigid[1:])
        for line in (one, two):
            if line.others:
                found[:, 1:] += line.others.enclosed(c, h).curve * line.scale
        return np.asarray(found)

    def _nearest(self, near: Near, other: Near, low: BoolArray) -> tuple[IntArray, IntArray]:
        """Return the pole of each that is taken out: the nearest of all, and its partner."""
        (k, close), (j, close_other) = _largest(near.u), _largest(other.u)
        first = close >= close_other
        one, two = np.where(first, k, self._back[j]), np.where(first, self._partner[k], j)
        return np.where(low, len(self.first.sigma), one), np.where(low, len(self.second.sigma), two)

    def _cross(
        self, c: Array, h: Array, taken: tuple[IntArray, IntArray], low: BoolArray,
        m: tuple[Span, Span], rho: tuple[Span, Span],
    ) -> tuple[Span, Span]:  # fmt: skip
        """Return m ρ₂ − n ρ₁ and ρ₁ ∧ ρ₂, both small where two poles nearly agree."""
        i, j = self.i, self.j
        R, both = (
            rho[0].value,
            (taken[0] < len(self.first.sigma)) & (taken[1] < len(self.second.sigma)),
        )
        step = rho[1].value - R
        apart = np.append(self.second.sigma, 0)[taken[1]] - np.append(self.first.sigma, 0)[taken[0]]
        value = np.where(both[:, None], m[0].value * step + apart[:, None] * R, step)
        slope, zero = np.where(both[:, None], 1j * step, 0), np.zeros(step.shape)
        cross, change = Span(rho[0].h, value, slope, zero), Span(rho[0].h, step, 0 * step, zero)
        if low.any():
            rigid = rho[1]
            if self.first.order == self.second.order:
                rigid = polynomial(c, h, self._rigid[:0:-1])
                cross = chosen(low, m[0] * rigid, cross)
            else:
                cross = chosen(low, m[0] * rho[1] - m[1] * rho[0], cross)
            change = chosen(low, rigid, change)
        return cross, rho[0][i] * change[j] - rho[0][j] * change[i]

    def product(self, one: ComplexArray, two: ComplexArray) -> complex:
        """Return the inner product whose turns are counted."""
        return complex(np.vdot(two, one))

    def on_axis(self, v: Array) -> tuple[ComplexArray, Array]:
        """Return 1 + B* A, and the sine."""
        A, B = self.first.values(v), self.second.values(v)
        E, i, j = B - A, self.i, self.j
        W = np.abs(A[:, i] * E[:, j] - A[:, j] * E[:, i]) ** 2
        return np.asarray((B.conj() * A).sum(1)), np.sqrt(W.sum(1) / _lengths(A, B))

    def turn(self, a: Array, b: Array, taken: tuple[IntArray, IntArray]) -> Array:
        """Return the change of arg(m n̄) on intervals."""
        one, two = taken
        return self.first.turn(a, b, one) - self.second.turn(a, b, two)

    def sine(self, one: Direction, two: Direction) -> float:
        """Return the angle of two directions."""
        x, y = one.vector / np.linalg.norm(one.vector), two.vector / np.linalg.norm(two.vector)
        return float(np.linalg.norm(y - x * np.vdot(x, y)))


class Kept:
    """What a controller with one command keeps of the angle: b at each frequency.

    Parameters
    ----------
    first : GraphLine
        Of the plant.
    second : GraphLine
        Of −K, u = K y, as a function of one input: its transpose.
    """

    larger = False

    def __init__(self, first: GraphLine, second: GraphLine) -> None:
        self.first, self.second = first, second

    def enclosed(self, c: Array, h: Array, low: BoolArray) -> Angle:
        """Return the angle on intervals, some of them near the origin."""
        directions, times, taken = [], [], []
        for line in (self.first, self.second):
            near = line.near(c, h)
            nearest = np.where(low, len(line.sigma), _largest(near.u)[0])
            near = near.without(nearest)
            rest = line.rest(c, h, near, low)
            rest = Span(rest.h, rest.value, rest.slope, rest.curve + line.bend(near))
            times.append(line.multiplier(c, h, nearest, low).column)
            directions.append(times[-1] * rest + line.taken(c, h, nearest, low))
            taken.append(nearest)
        (x, y), (m, n), (first, second) = directions, times, taken
        kept = (x * y).total
        return _angle(kept.column, x, y, (m, n), (first, second), kept)

    def product(self, one: ComplexArray, two: ComplexArray) -> complex:
        """Return the product whose turns are counted."""
        return complex(np.dot(two, one))

    def on_axis(self, v: Array) -> tuple[ComplexArray, Array]:
        """Return 1 + L, and the sine."""
        A, B = self.first.values(v), self.second.values(v)
        found = (A * B).sum(1)
        return np.asarray(found), np.abs(found) / np.sqrt(_lengths(A, B))

    def turn(self, a: Array, b: Array, taken: tuple[IntArray, IntArray]) -> Array:
        """Return the change of arg(m n) on intervals."""
        one, two = taken
        return self.first.turn(a, b, one) + self.second.turn(a, b, two)

    def sine(self, one: Direction, two: Direction) -> float:
        """Return the sine that is kept by two directions."""
        sizes = np.linalg.norm(one.vector) * np.linalg.norm(two.vector)
        return float(abs(np.dot(one.vector, two.vector)) / sizes)


def _lengths(A: ComplexArray, B: ComplexArray) -> Array:
    return np.asarray((np.abs(A) ** 2).sum(1) * (np.abs(B) ** 2).sum(1))


def _largest(u: ComplexArray) -> tuple[IntArray, Array]:
    """Return the nearest pole of each interval, and 1/distance; of no poles, n and zero."""
    if not u.shape[1]:
        return np.zeros(len(u), dtype=int), np.zeros(len(u))
    size = u.real**2 + u.imag**2
    k = size.argmax(axis=1)
    return k, size[np.arange(len(u)), k]


def _pairs(one: ComplexArray, two: ComplexArray) -> tuple[IntArray, IntArray]:
    """Return the poles that are nearest to each other, and not far."""
    if not len(one) or not len(two):
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    apart = np.abs(one[:, None] - two)
    nearest, back = apart.argmin(axis=1), apart.argmin(axis=0)
    k = np.arange(len(one))
    good = (back[nearest] == k) & (apart[k, nearest] <= 0.2 * np.abs(one))
    return k[good], nearest[good]


def _difference(one: ComplexArray, two: ComplexArray) -> ComplexArray:
    found = np.zeros((max(len(one), len(two)), one.shape[1]), complex)
    found[: len(one)] -= one
    found[: len(two)] += two
    return found
