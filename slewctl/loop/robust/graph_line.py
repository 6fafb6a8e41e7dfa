"""The graph of a system with one input at each frequency: a line through (1, A(jv)).

Multiplied by s − σ of the nearest pole, or by sᵏ near the origin, the line has a direction
x = (m, m A) that is smooth and not zero: it passes a resonance, damped or not, as any other
place.  What rounding takes from A is a chordal distance between lines, and added as such.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.loop.robust.span import Span, chosen, polynomial, power
from slewctl.loop.single.factor import Factor
from slewctl.numerics.modal_bounds import ROUNDING
from slewctl.numerics.modal_form import Block, ModalForm

# Curvatures are summed upward.
_UP = 2 + 1e-9
# The square of a distance for a point that is a pole.
_THERE = 1e-300
# Poles as lightly damped as this are passed as if they were on the axis.
_UNDAMPED = 1e-6


@dataclass(frozen=True, eq=False)
class Direction:
    """Where a line points on a small part of the axis, and how far from it it is at most.

    Attributes
    ----------
    vector : ndarray of complex, shape (p + 1,)
    away : float
        Chordal distance.
    """

    vector: ComplexArray
    away: float


@dataclass(frozen=True, eq=False)
class Near:
    """What the poles say on intervals: 1/(jc − σ), and 1/distance from the interval, (m, n)."""

    u: ComplexArray
    q: Array

    def without(self, taken: IntArray) -> Near:
        """Return the same with one pole of each interval left out; n for none."""
        rows = np.flatnonzero(taken < self.u.shape[1])
        u, q = self.u.copy(), self.q.copy()
        u[rows, taken[rows]] = 0
        q[rows, taken[rows]] = 0
        return Near(u, q)


class GraphLine:
    """The graph of A, each output in a unit of its own.

    Parameters
    ----------
    factor : Factor
        Without poles at z = −1.
    scale : ndarray, shape (p,)
        By which the outputs are multiplied.
    """

    def __init__(self, factor: Factor, scale: Array) -> None:
        self.factor, self.scale, self.order = factor, scale, factor.order_at_zero
        self.sigma: ComplexArray = factor.simple.sigma
        # All with a column for the one of (1, A).
        self.residue: ComplexArray = _beside(0.0, factor.residue * scale)
        self.size: Array = np.abs(self.residue)
        # Of s⁻ᵉ, e = 0, 1, …, k: a rigid body.
        self.rigid: ComplexArray = _beside(0.0, factor.inverse_powers * scale)
        self.D = _beside(1.0, factor.D * scale) + self.rigid[0]
        others = [block for block in factor.blocks if not block.nilpotent]
        self.others = Factor(_alone(factor.form, others)) if others else None

    @property
    def unstable(self) -> int:
        """How many poles have a positive real part in double precision."""
        return int(np.sum(self.factor.poles.real > 0))

    @property
    def crowded(self) -> bool:
        """Whether poles that cannot be told apart lie on the axis, or are hidden at the origin."""
        if self.factor.hidden or not self.others:
            return self.factor.hidden
        poles = self.others.poles
        return bool((np.abs(poles.real) <= _UNDAMPED * np.abs(poles)).any())

    @property
    def head(self) -> ComplexArray:
        """Coefficients of the polynomial that sᵏ times the rigid body is, shape (k, p + 1)."""
        return self.rigid[:0:-1]

    def near(self, c: Array, h: Array) -> Near:
        """Return the distances of the simple poles from intervals."""
        real, away = -self.sigma.real, c[:, None] - self.sigma.imag
        size = real * real + away * away
        size[size == 0] = _THERE
        u = np.empty(size.shape, dtype=complex)
        u.real, u.imag = real / size, -away / size
        aside = np.maximum(np.abs(away) - h[:, None], 0.0)
        with np.errstate(divide="ignore"):
            return Near(u, 1 / np.sqrt(real * real + aside * aside))

    def rest(self, c: Array, h: Array, near: Near, low: BoolArray) -> Span:
        """Return (1, A) without the poles that `near` leaves out, near the origin without sᵏ's.

        Its curvature by the simple poles is left to the caller.
        """
        wide = h[:, None]
        value, slope = near.u @ self.residue + self.D, -1j * ((near.u * near.u) @ self.residue)
        curve = np.zeros(value.shape)
        if self.order:
            back = np.where(low, 0, 1 / (1j * c))[:, None]
            powers = np.cumprod(np.repeat(back, self.order, axis=1), axis=1)
            value += powers @ self.rigid[1:]
            slope -= 1j * back * ((powers * np.arange(1, self.order + 1)) @ self.rigid[1:])
            curve += inverse_curves(c - h, self.order, low) @ np.abs(self.rigid[1:])
        if self.others:
            more = self.others.enclosed(c, h)
            value[:, 1:] += more.value * self.scale
            slope[:, 1:] += more.slope * self.scale
            curve[:, 1:] += more.curve * self.scale
        return Span(wide, value, slope, curve)

    def bend(self, near: Near, which: IntArray | slice = slice(None)) -> Array:
        """Return bounds of the curvature of some simple poles, shape (m, p + 1)."""
        q = near.q[:, which]
        return np.asarray(_UP * ((q * q * q) @ self.size[which]))

    def multiplier(self, c: Array, h: Array, taken: IntArray, low: BoolArray) -> Span:
        """Return m: sᵏ near the origin, else s − σ of the pole that is taken, or one."""
        some = taken < len(self.sigma)
        sigma = np.append(self.sigma, 0)[taken]
        value = np.where(some, 1j * c - sigma, 1.0)
        found = Span(h, value, np.where(some, 1j, 0.0), np.zeros(len(c)))
        return chosen(low, power(c, h, self.order), found) if low.any() else found

    def taken(self, c: Array, h: Array, taken: IntArray, low: BoolArray) -> Span:
        """Return ρ = m (1, A) − m·rest: a polynomial near the origin, else a residue."""
        value = np.vstack([self.residue, np.zeros((1, len(self.D)))])[taken]
        found = Span(h[:, None], value, 0 * value, np.zeros(value.shape))
        return chosen(low, polynomial(c, h, self.head), found) if low.any() else found

    def turn(self, a: Array, b: Array, taken: IntArray) -> Array:
        """Return the change of arg m from a to b: past a pole on the axis on its right."""
        if not len(self.sigma):
            return np.zeros(len(a))
        sigma = np.append(self.sigma, 0)[taken]
        found = _turn(sigma, a, b)
        return np.where(taken < len(self.sigma), found, 0.0)

    def values(self, v: Array) -> ComplexArray:
        """Return (1, A) at points of the axis, shape (m, p + 1)."""
        return _beside(1.0, self.factor.values(np.asarray(1j * v, dtype=complex)) * self.scale)

    def inexact(self, c: Array, h: Array, lengths: Array) -> Array:
        """Return bounds of the chordal distance that errors of A make on intervals, shape (m,).

        Parameters
        ----------
        c, h : ndarray, shape (m,)
        lengths : ndarray, shape (m,)
            |(1, A)| is larger.
        """
        factor = self.factor
        simple, q = factor.simple, self.near(c, h).q
        single = np.abs(simple.a) + np.abs(simple.b) * q if factor.sampled else q
        blocks = []
        for block in factor.blocks:
            a, b, sigma = (getattr(factor.all, x)[block.index] for x in ("a", "b", "sigma"))
            aside = np.maximum(np.abs(c[:, None] - sigma.imag) - h[:, None], 0.0)
            blocks.append(np.abs(a) + np.abs(b) / np.hypot(sigma.real, aside))
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            # Twice that of one sum, for what is taken out and multiplied.
            error = np.linalg.norm(2 * factor.bound(single, blocks) * self.scale, axis=1)
            found = np.nan_to_num(_chord(error, lengths), nan=1.0)
        for passed in self.passed:
            inside = np.abs(c - passed.v) + h <= passed.radius
            found = np.where(inside, np.minimum(found, passed.away), found)
        return np.asarray(found)

    def origin(self, radius: float) -> Direction:
        """Return the direction for |s| ≤ radius."""
        value, away = self.factor.at_origin(radius)
        error = 2 * self.factor.errors(np.array([1j * radius]))[0] * radius**self.order
        value, off = value * self.scale, float(np.linalg.norm((away + error) * self.scale))
        if not self.order:
            return _at(value, off)
        # Of sᵏ (1, A).
        size = float(np.linalg.norm(value))
        off = (off + radius**self.order) / size if size else 1.0
        return Direction(np.append(0.0, value), min(off * (1 + 1e-9), 1.0))

    def tail(self, far: float) -> Direction:
        """Return the direction for |s| ≥ far."""
        value, away = self.factor.tail(far)
        error = 2 * self.factor.errors(np.array([1j * far]))[0]
        return _at(value * self.scale, float(np.linalg.norm((away + error) * self.scale)))

    @cached_property
    def passed(self) -> list[Passed]:
        """The poles above the origin that lie on the axis, or nearly so."""
        found = []
        for k in np.flatnonzero(self.sigma.imag > 0).tolist():
            if abs(self.sigma[k].real) <= _UNDAMPED * self.sigma[k].imag:
                found.append(self._passed(k))
        return found

    def _passed(self, k: int) -> Passed:
        """Return how well the line is known where it passes a pole.

        The error of A is a shift of the pole, one of its residue and one of the rest.  The
        latter two are bounded by the error on a circle about it: Cauchy's integral, and the
        maximum principle.
        """
        sigma, factor = self.sigma[k], self.factor
        form, j = factor.form, factor.alone[k]
        shift = 2 * float(np.abs(factor.simple.b[k]) * form.spread[j] * form.weight[j])
        shift += 4 * ROUNDING * float(abs(sigma) + abs(factor.simple.b[k] * form.poles[j]))
        apart = np.sort(np.abs(factor.poles - sigma))
        circle = 1e-2 * float(apart[1] if len(apart) > 1 else abs(sigma))
        size = float(np.linalg.norm(self.residue[k]))
        if not circle or not size:
            return Passed(float(sigma.imag), 0.0, 1.0)
        # All round the other poles are no nearer than half of their distance from its top.
        top = np.array([sigma + 1j * circle])
        edge = 2 * float(np.linalg.norm(factor.errors(top)[0] * self.scale))
        residue = circle * edge
        rest = edge + 2 * (residue / circle + size * shift / circle**2)
        others = factor.sizes(np.array([sigma]), circle, leave=k)[0][0] * self.scale
        most = 1 + float(np.linalg.norm(others))
        radius = min(circle, size / (2 * most))
        away = 2 * (shift * most + residue + radius * rest) / size
        return Passed(float(sigma.imag), radius - abs(float(sigma.real)), away)


@dataclass(frozen=True)
class Passed:
    """A pole on the axis: within a radius of jv the line is known but for a chordal distance."""

    v: float
    radius: float
    away: float


def _at(value: ComplexArray, away: float) -> Direction:
    """Return the direction of (1, A), A within a distance of a value."""
    length = np.array([np.sqrt(1 + np.sum(np.abs(value) ** 2))])
    return Direction(np.append(1.0, value), float(_chord(np.array([away]), length)[0]))


def _chord(error: Array, lengths: Array) -> Array:
    """Return the largest chordal distance from a longer (1, A), of A within an error."""
    return np.minimum(error * (1 + 1e-9) / (lengths * np.maximum(lengths - error, 1.0)), 1.0)


def inverse_curves(nearest: Array, order: int, low: BoolArray) -> Array:
    """Return the curvatures of s⁻ᵉ, e = 1, …, k, at the nearest points, or zero, shape (m, k)."""
    e, back = np.arange(1, order + 1), np.where(low, 0.0, 1 / nearest)[:, None]
    powers = np.cumprod(np.repeat(back, order, axis=1), axis=1)
    return np.asarray(powers * (e * (e + 1) * back * back) * (1 + 1e-9))


def _beside(first: float, rows: ComplexArray) -> ComplexArray:
    """Return rows with one more entry before the others."""
    return np.concatenate([np.full((*rows.shape[:-1], 1), first), rows], axis=-1)


def _turn(sigma: ComplexArray, a: Array, b: Array) -> Array:
    """Return the change of arg(jv − σ) from v = a to b."""
    sign = np.where(sigma.real > 0, -1.0, 1.0)
    width = np.abs(sigma.real)
    return np.asarray(
        sign * (np.arctan2(b - sigma.imag, width) - np.arctan2(a - sigma.imag, width))
    )


def _alone(form: ModalForm, blocks: list[Block]) -> ModalForm:
    """Return the part of a form that some blocks are."""
    pick = np.concatenate([block.index for block in blocks])
    place = {int(k): i for i, k in enumerate(pick)}
    moved = tuple(
        Block(np.array([place[int(k)] for k in block.index]), block.T, block.low)
        for block in blocks
    )
    columns = {name: getattr(form, name)[:, pick] for name in ("shape", "shape_error", "shape_low")}
    rows = {
        name: getattr(form, name)[pick]
        for name in ("poles", "entry", "spread", "weight", "entry_error", "poles_low", "entry_low")
    }
    return replace(
        form, blocks=moved, D=0 * form.D, component=np.zeros(len(pick), dtype=int), long=False,
        **columns, **rows,
    )  # fmt: skip
