"""The graph of a system with one input at each frequency: a line through (1, A(jv)).

Multiplied by s − σ of the nearest pole, or by sᵏ near the origin, the line has a direction
x = (m, m A) that is smooth and not zero: it passes a resonance, damped or not, as any other
place.  What rounding takes from A is a chordal distance between lines, and added as such.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array, ComplexArray, IntArray
from slewctl.loop.robust.span import Span, polynomial, power
from slewctl.loop.single.factor import Factor
from slewctl.numerics.modal_form import Block, ModalForm

# Curvatures are summed upward.
_UP = 2 + 1e-9


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
        self.rigid: ComplexArray = _beside(0.0, _inverse_powers(factor) * scale)
        self.D = _beside(1.0, factor.D * scale) + self.rigid[0]
        others = [block for block in factor.blocks if not block.nilpotent]
        self.others = Factor(_alone(factor.form, others)) if others else None

    @property
    def unstable(self) -> int:
        """How many poles have a positive real part in double precision."""
        return int(np.sum(self.factor.poles.real > 0))

    @property
    def head(self) -> ComplexArray:
        """Coefficients of the polynomial that sᵏ times the rigid body is, shape (k, p + 1)."""
        return self.rigid[:0:-1]

    def near(self, c: Array, h: Array) -> Near:
        """Return the distances of the simple poles from intervals."""
        u = 1 / (1j * c[:, None] - self.sigma)
        aside = np.maximum(np.abs(c[:, None] - self.sigma.imag) - h[:, None], 0.0)
        with np.errstate(divide="ignore"):
            return Near(u, 1 / np.sqrt(self.sigma.real**2 + aside * aside))

    def rest(self, c: Array, h: Array, near: Near, low: bool) -> Span:
        """Return (1, A) without the poles that `near` leaves out, near the origin without sᵏ's.

        Its curvature by the simple poles is left to the caller.
        """
        s, wide = np.asarray(1j * c, dtype=complex)[:, None], h[:, None]
        value, slope = near.u @ self.residue + self.D, -1j * ((near.u * near.u) @ self.residue)
        curve = np.zeros(value.shape)
        if not low:
            for e, coefficient in enumerate(self.rigid[1:], start=1):
                value = value + coefficient / s**e
                slope = slope - 1j * e * coefficient / s ** (e + 1)
                curve = curve + e * (e + 1) * np.abs(coefficient) / (c - h)[:, None] ** (e + 2)
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

    def multiplier(self, c: Array, h: Array, taken: IntArray, low: bool) -> Span:
        """Return m: sᵏ near the origin, else s − σ of the pole that is taken, or one."""
        if low:
            return power(c, h, self.order)
        some = taken < len(self.sigma)
        sigma = np.append(self.sigma, 0)[taken]
        value = np.where(some, 1j * c - sigma, 1.0)
        return Span(h, value, np.where(some, 1j, 0.0), np.zeros(len(c)))

    def taken(self, c: Array, h: Array, taken: IntArray, low: bool) -> Span:
        """Return ρ = m (1, A) − m·rest: a polynomial near the origin, else a residue."""
        if low:
            return polynomial(c, h, self.head)
        value = np.vstack([self.residue, np.zeros((1, len(self.D)))])[taken]
        return Span(h[:, None], value, 0 * value, np.zeros(value.shape))

    def turn(self, a: Array, b: Array, taken: IntArray, low: bool) -> Array:
        """Return the change of arg m from a to b: past a pole on the axis on its right."""
        if low or not len(self.sigma):
            return np.zeros(len(a))
        sigma = np.append(self.sigma, 0)[taken]
        found = _turn(sigma, a, b)
        return np.where(taken < len(self.sigma), found, 0.0)

    def values(self, v: Array) -> ComplexArray:
        """Return (1, A) at points of the axis, shape (m, p + 1)."""
        return _beside(1.0, self.factor.values(np.asarray(1j * v, dtype=complex)) * self.scale)

    def inexact(self, c: Array, h: Array) -> Array:
        """Return bounds of the error of A on intervals, shape (m,): twice that of one sum."""
        factor = self.factor
        q = self.near(c, h).q
        simple = factor.simple
        single = np.abs(simple.a) + np.abs(simple.b) * q if factor.sampled else q
        blocks = []
        for block in factor.blocks:
            a, b, sigma = (getattr(factor.all, x)[block.index] for x in ("a", "b", "sigma"))
            aside = np.maximum(np.abs(c[:, None] - sigma.imag) - h[:, None], 0.0)
            blocks.append(np.abs(a) + np.abs(b) / np.hypot(sigma.real, aside))
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(np.linalg.norm(2 * factor.bound(single, blocks) * self.scale, axis=1))

    def origin(self, radius: float) -> Direction:
        """Return the direction for |s| ≤ radius."""
        value, away = self.factor.at_origin(radius)
        error = 2 * self.factor.errors(np.array([1j * radius]))[0] * radius**self.order
        value, away = value * self.scale, float(np.linalg.norm((away + error) * self.scale))
        if not self.order:
            return Direction(np.append(1.0, value), _chord(away, 1.0, value))
        return Direction(np.append(0.0, value), _chord(away + radius**self.order, 0.0, value))

    def tail(self, far: float) -> Direction:
        """Return the direction for |s| ≥ far."""
        value, away = self.factor.tail(far)
        error = 2 * self.factor.errors(np.array([1j * far]))[0]
        value = value * self.scale
        return Direction(
            np.append(1.0, value),
            _chord(float(np.linalg.norm((away + error) * self.scale)), 1.0, value),
        )

    @property
    def moved(self) -> Array:
        """How far rounding may have moved each simple pole."""
        form, pick = self.factor.form, self.factor.alone
        return np.asarray(np.abs(self.factor.simple.b) * (form.spread * form.weight)[pick])

    def on_axis(self) -> IntArray:
        """Return the simple poles above the origin that lie on the axis, or may do so."""
        doubtful = np.abs(self.sigma.real) <= 8 * self.moved + 1e-300
        return np.flatnonzero((self.sigma.imag > 0) & doubtful)

    def around(self, v: float, radius: float) -> Direction:
        """Return the direction within a distance of jv, past a pole there."""
        at, scale = np.array([1j * v]), self.scale
        inside = np.flatnonzero(np.abs(self.sigma - at[0]) < 2 * radius)
        if len(inside) > 1:
            return Direction(self.D, np.inf)
        if not len(inside):
            value = self.values(np.array([v]))[0, 1:]
            slope = self.factor.sizes(at, radius)[1][0] * scale
            error = self.inexact(np.array([v]), np.array([radius]))[0]
            away = float(np.linalg.norm(slope)) * radius + error
            return Direction(np.append(1.0, value), _chord(away, 1.0, value))
        k = int(inside[0])
        moved = float(self.moved[k])
        reach = radius + abs(self.sigma[k] - at[0]) + moved
        rest = self.factor.sizes(at, radius, leave=k)[0][0] * scale
        away = reach * (1 + float(np.linalg.norm(rest))) + moved * float(np.linalg.norm(rest))
        # What is not known of the residue, from the error at the edge.
        edge = self.factor.errors(at + 1j * radius)[0] * scale
        away += 2 * radius * float(np.linalg.norm(edge))
        return Direction(self.residue[k], _chord(away, 0.0, self.residue[k]))


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


def _chord(away: float, first: float, value: ComplexArray) -> float:
    """Return the largest chordal distance from (first, value) of a vector that is `away` of it."""
    length = float(np.sqrt(first + np.sum(np.abs(value) ** 2)))
    return min(away / length * (1 + 1e-9), 1.0) if length else 1.0


def _inverse_powers(factor: Factor) -> ComplexArray:
    """Return the coefficients of s⁻ᵉ of all blocks at the origin, shape (k + 1, p)."""
    found = np.zeros((factor.order_at_zero + 1, factor.outputs), complex)
    form = factor.form
    for block in factor.blocks:
        if not block.nilpotent:
            continue
        a, b = factor.all.a[block.index[0]], factor.all.b[block.index[0]]
        vector, term = form.entry[block.index], np.ones(1, complex)
        for _ in block.index:  # Y Tʲ⁻¹ ξ uʲ with u = a + b/s
            term = np.polynomial.polynomial.polymul(term, [a, b])
            found[: len(term)] += term[:, None] * (form.shape[:, block.index] @ vector)
            vector = block.T @ vector
    return found


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
