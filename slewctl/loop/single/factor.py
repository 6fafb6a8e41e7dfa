"""One factor of a loop, enclosed on intervals of the axis: value, slope, curvature, error.

Everything is on the imaginary axis s = jv.  A sampled factor is a function of
z = (1 + s)/(1 − s), so that each of its poles contributes a + b/(s − σ); a continuous one
1/(s − σ).  With q = 1/distance of σ from the interval, |d²/dv²| ≤ 2 |b| q³, and a
triangular block is a chain of products of such terms.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from weakref import WeakKeyDictionary

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.enclosed import Enclosed, Terms, product_curve, reach
from slewctl.loop.single.factor_error import ErrorBound, majorant
from slewctl.loop.single.far_poles import FarPoles, far_poles
from slewctl.loop.single.long_factor import LongFactor
from slewctl.loop.single.powers import AtZero
from slewctl.loop.single.quick_error import of_simple_poles
from slewctl.loop.single.simple_poles import SimplePoles
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.long_complex import LONG_ROUNDING
from slewctl.numerics.modal_basis import AT_END
from slewctl.numerics.modal_bounds import ROUNDING
from slewctl.numerics.modal_form import COPIES, Block, ModalForm, modal_form

_KNOWN: WeakKeyDictionary[LinearSystem, dict[bool, Factor]] = WeakKeyDictionary()


class Factor:
    """The outputs of a system with one input, as functions of v on the axis.

    Parameters
    ----------
    form : ModalForm
    """

    def __init__(self, form: ModalForm) -> None:
        self.form = form
        self.sampled = bool(form.sample_time)
        self.all = Terms.of(form.poles, self.sampled)
        # A single pole at zero is a block too: sᵏ is taken out of all of them.
        at_zero = np.flatnonzero(form.alone & (form.poles == 0))
        zero = np.zeros((1, 1), dtype=complex)
        single = (Block(np.array([k]), zero, zero) for k in at_zero.tolist())
        self.blocks = [*form.blocks, *single]
        at_origin = [len(block.index) for block in self.blocks if block.nilpotent]
        self.order_at_zero = max(at_origin, default=0)
        self.at_zero = [AtZero.of(b, form, self.all) if b.nilpotent else None for b in self.blocks]
        at_end = form.alone & (form.poles == AT_END) & self.sampled
        self.alone = pick = np.flatnonzero(form.alone & (form.poles != 0) & ~at_end)
        self.simple = Terms.of(form.poles[pick], self.sampled)
        coefficient = (form.shape * form.entry)[:, pick]
        largest = max((len(block.index) for block in self.blocks), default=0)
        sums = len(form.poles) + 8 + largest**2
        self.count = sums * ROUNDING
        count = sums * LONG_ROUNDING if form.long else self.count
        self.long = LongFactor(form, self.blocks) if form.long else None
        # Of poles at z = −1, each (1 − s)/2 on the plane of s.
        edges = [Block(np.array([k]), zero, zero) for k in np.flatnonzero(at_end).tolist()]
        self.at_end = (form.shape * form.entry)[:, at_end].sum(axis=1)
        self.has_end = bool(edges)
        # Of chains of one pole a single input moves the longest alone.
        self.hidden = sum(at_origin) > self.order_at_zero or len(edges) > 1
        self.D = form.D + (coefficient * self.simple.a).sum(axis=1)
        self.residue: ComplexArray = np.asarray((coefficient * self.simple.b).T)  # (n, p)
        self.size: Array = np.abs(self.residue)
        k = self.order_at_zero
        curving = np.hstack([self.size, self.size * np.abs(self.simple.sigma[:, None]) ** k])
        self.sums = SimplePoles(self.simple.sigma, self.residue, curving if k else self.size)
        offset = count * (np.abs(form.D) + np.abs(coefficient * self.simple.a).sum(axis=1))
        self.bound = ErrorBound(form, [*self.blocks, *edges], self.alone, count, offset)
        self.quick = of_simple_poles(self.bound, self.sums, self.sampled)
        # What slopes do not know of a pole.
        self.blurred = np.abs(form.poles_low[pick])
        if self.sampled:
            self.blurred += ROUNDING * np.abs(form.poles[pick])

    @property
    def outputs(self) -> int:
        """Number of functions p."""
        return len(self.form.D)

    @property
    def poles(self) -> ComplexArray:
        """Poles on the plane of s, without those at z = −1."""
        ends = self.sampled & (self.form.poles == AT_END)
        return np.asarray(self.all.sigma[~(self.form.alone & ends)])

    @cached_property
    def unknown(self) -> float:
        """The largest error relative to the value, at and between the distances of its poles."""
        sizes = np.unique(np.abs(self.poles)[np.abs(self.poles) > 0])
        # What it works with may be slower or faster than all of its own poles.
        beyond = np.concatenate([sizes[:1] * 1e-6, sizes, sizes[-1:] * 1e3])
        s = 1j * np.concatenate([beyond, np.sqrt(beyond[1:] * beyond[:-1])])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = self.errors(s) / np.abs(self.values(s))
        return float(np.nan_to_num(found, nan=0.0).max(initial=0.0))

    def values(self, s: ComplexArray) -> ComplexArray:
        """Return the functions at points s, shape (m, p)."""
        if self.long:
            return self.long.values(s)
        if s.real.any():
            found = (1 / (s[:, None] - self.simple.sigma)) @ self.residue + self.D
        else:
            found = self.sums.values(s.imag) + self.D
        for block, powers in zip(self.blocks, self.at_zero, strict=True):
            found += (
                powers.values(s)
                if powers
                else self._solved(block, s) @ self.form.shape[:, block.index].T
            )
        if self.has_end:
            found += np.multiply.outer((1 - s) / 2, self.at_end)
        return np.asarray(found)

    def slopes(self, v: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return the functions and their derivatives by v at s = jv, shape (m, p)."""
        s = np.asarray(1j * v, dtype=complex)
        value, slope = self.sums.slopes(v)
        value += self.D
        for block, powers in zip(self.blocks, self.at_zero, strict=True):
            if powers:
                X, X1 = powers.slopes(s)
            else:
                away = 1 / self._away(block, s, 0.0)
                X, X1, _ = self._of_block(block, s, 0.0 * v, away)
            value, slope = value + X, slope + X1
        if self.has_end:
            value = value + np.multiply.outer((1 - s) / 2, self.at_end)
            slope = slope - 0.5j * self.at_end
        return self.long.values(s) if self.long else value, slope

    def enclosed(self, c: Array, h: Array) -> Enclosed:
        """Return the functions on the intervals [c − h, c + h] of v."""
        s = np.asarray(1j * c, dtype=complex)
        with np.errstate(divide="ignore", invalid="ignore"):
            value, slope, curves, apart = self.sums.enclosed(c, h)
            value += self.D
            curve, flat = curves[:, : self.outputs], curves[:, self.outputs :]
            near = [1 / self._from_interval(block, c, h) for block in self.blocks]
            bends: list[Array] = []
            for block, powers, q_block in zip(self.blocks, self.at_zero, near, strict=True):
                X, X1, X2 = (
                    powers.enclosed(s, q_block[:, 0])
                    if powers
                    else self._of_block(block, s, h, q_block)
                )
                value, slope, curve = value + X, slope + X1, curve + X2
                bends.append(X2)
            for group in self.far:
                group.lower(curve, c, h, bends)
            if self.has_end:
                value = value + np.multiply.outer((1 - s) / 2, self.at_end)
                slope = slope - 0.5j * self.at_end
            if self.quick:
                reaches = [self._reach(*x) for x in zip(self.blocks, near, strict=True)]
                error = self.quick(apart, reaches)
            else:
                error = self._error(self.sums.in_order(apart), near, 1 + c + h)
            if self.long:
                value, q = self.long.values(s), self.sums.in_order(apart)
                error = error + ROUNDING * np.abs(value) + h[:, None] * self._slope_error(q, near)
            flat = self._flat_curve(c, h, flat) if self.order_at_zero else curve
        return Enclosed(value, slope, curve, error, flat)

    @cached_property
    def far(self) -> list[FarPoles]:
        """Slow poles that cancel most of each other, seen from far."""
        blocks = {k: b for k, b in enumerate(self.blocks) if not (self.at_zero[k] or self.sampled)}
        return far_poles(self.simple.sigma, self.residue, self.form, blocks)

    def tail(self, far: float) -> tuple[ComplexArray, Array]:
        """Return the limit at infinite s, and how far from it X is for |s| ≥ far, shape (p,).

        `far` is larger than any |σ|.  What poles at z = −1 contribute is left out.
        """
        limit, away = self.D.astype(complex), np.zeros(self.outputs)
        with np.errstate(divide="ignore"):
            near = 1 / np.maximum(far - np.abs(self.all.sigma), 0.0)
        if len(self.alone):
            away = near[self.alone] @ self.size
        for block in self.blocks:
            index, T = block.index, block.T
            w, off = np.zeros(len(index), complex), np.zeros(len(index))
            for i in reversed(range(len(index))):
                S, more = self.form.entry[index[i]] + T[i] @ w, np.abs(T[i]) @ off
                a, change = self.all.a[index[i]], np.abs(self.all.b[index[i]]) * near[index[i]]
                w[i], off[i] = S * a, more * (abs(a) + change) + abs(S) * change
            Y = self.form.shape[:, index]
            limit, away = limit + Y @ w, away + np.abs(Y) @ off
        return limit, away

    def leading(self, far: float) -> tuple[ComplexArray, Array]:
        """Return E, and how far X/s is from it for |s| ≥ far; of one without poles at z = −1, X."""
        limit, away = self.tail(far)
        if not self.has_end:
            return limit, away
        return -self.at_end / 2, (np.abs(limit) + away + np.abs(self.at_end) / 2) / far

    def sizes(
        self, s: ComplexArray, radius: float, leave: int | None = None
    ) -> tuple[Array, Array]:
        """Return bounds of |X| and |X′| within a distance of points s, shape (m, p).

        Parameters
        ----------
        leave : int, optional
            A simple pole that is left out.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            q = 1 / np.maximum(np.abs(s[:, None] - self.simple.sigma) - radius, 0.0)
            if leave is not None:
                q[:, leave] = 0.0
            ends = np.abs(self.at_end) / 2
            value = q @ self.size + np.abs(self.D) + ends * (1 + np.abs(s) + radius)[:, None]
            slope = (q * q) @ self.size + ends
            for block in self.blocks:
                large, steep = self._steepest(block, 1 / self._away(block, s, radius))
                value, slope = value + large, slope + steep
        return value, slope

    def at_origin(self, radius: float) -> tuple[ComplexArray, Array]:
        """Return sᵏ X at s = 0 and how far from it sᵏ X is for |s| ≤ radius, shape (p,)."""
        k = self.order_at_zero
        with np.errstate(divide="ignore"):
            q = 1 / np.maximum(np.abs(self.simple.sigma) - radius, 0.0)
        ends = np.abs(self.at_end) / 2
        others = np.abs(self.D) + q @ self.size + ends * (1 + radius)
        slope = (q * q) @ self.size + ends
        value = 0j * self.D if k else self.values(np.zeros(1, complex))[0]
        away = radius**k * others if k else radius * slope
        for block, powers in zip(self.blocks, self.at_zero, strict=True):
            if powers:
                a, b = powers.a, powers.b
                for j, moment in enumerate(powers.moments, start=1):
                    # sᵏ uʲ with u = a + b/s.
                    top = (abs(b) + abs(a) * radius) ** j * radius ** (k - j)
                    if j == k:
                        value = value + moment * b**k
                        top -= abs(b) ** k
                    away = away + np.abs(moment) * top
            else:
                near = 1 / self._away(block, np.zeros(1, complex), radius)
                large, steep = self._steepest(block, near)
                away = away + (radius**k * large[0] if k else radius * steep[0])
        return value, away

    def _flat_curve(self, c: Array, h: Array, found: Array) -> Array:
        """Return bounds of |d²/dv² (sᵏ X)| on intervals, given those of σᵏ/(s − σ).

        sᵏ/(s − σ) = sᵏ⁻¹ + σ sᵏ⁻² + … + σᵏ/(s − σ): what is left of a rigid body is a
        polynomial, however near to zero.
        """
        k, far = self.order_at_zero, c + h
        for power, size in enumerate(self._polynomial):
            if power > 1:
                found = found + power * (power - 1) * size * far[:, None] ** (power - 2)
        for block in self.blocks:
            if not block.nilpotent:
                found = found + self._flat_block(block, k, c, h)
        return found

    def _flat_block(self, block: Block, k: int, c: Array, h: Array) -> Array:
        """Return the bound of |d²/dv² (sᵏ Y w)| of another block, by the product rule."""
        s, far = np.asarray(1j * c, dtype=complex), c + h
        w, w1, w2 = self._chain(block, s, h, 1 / self._from_interval(block, c, h))
        wide = h[:, None]
        W0, W1 = reach(wide, w, w1, w2)
        power, slope = (far**k)[:, None], (k * far ** (k - 1))[:, None]
        bend = (k * (k - 1) * far ** max(k - 2, 0))[:, None]
        own = w2 * power + 2 * W1 * slope + W0 * bend
        return np.asarray(own @ np.abs(self.form.shape[:, block.index]).T)

    @cached_property
    def _polynomial(self) -> Array:
        """Sizes of the coefficients of the polynomial in sᵏ X, shape (k + 2, p)."""
        k = self.order_at_zero
        found = np.zeros((k + 2, self.outputs), complex)
        found[k] = self.D + self.at_end / 2
        found[k + 1] = -self.at_end / 2
        for power in range(k):
            found[power] += (self.residue * self.simple.sigma[:, None] ** (k - 1 - power)).sum(0)
        found[k::-1] += self.inverse_powers
        return np.abs(found) * (1 + 1e-9)

    @property
    def inverse_powers(self) -> ComplexArray:
        """Coefficients of s⁻ᵉ of all poles at the origin, e = 0 … k, shape (k + 1, p)."""
        found = np.zeros((self.order_at_zero + 1, self.outputs), complex)
        for powers in filter(None, self.at_zero):
            found[: powers.order + 1] += powers.inverse_powers
        return found

    def errors(self, s: ComplexArray) -> Array:
        """Return bounds of the error at points s, shape (m, p)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            q = 1 / np.abs(s[:, None] - self.simple.sigma)
            near = [1 / self._away(block, s, 0.0) for block in self.blocks]
            found = self._error(q, near, 1 + np.abs(s))
        return found + ROUNDING * np.abs(self.values(s)) if self.long else found

    def _slope_error(self, q: Array, near: list[Array]) -> Array:
        """Return the bounds of what double precision makes of the slope, given 1/distances."""
        found = (q * q * (self.count + 2 * self.blurred * q)) @ self.size
        found += self.count * np.abs(self.at_end)
        for block, q_block in zip(self.blocks, near, strict=True):
            found = found + self.count * self._steepest(block, q_block)[1]
        return np.asarray(found)

    def _steepest(self, block: Block, near: Array) -> tuple[Array, Array]:
        """Return bounds of the size and the slope of Y w, given 1/distances."""
        index, Y = block.index, np.abs(self.form.shape[:, block.index])
        w = majorant(block, self._reach(block, near), np.abs(self.form.entry[index]))
        # Each of the k terms that are multiplied has a slope of at most near times it.
        return w @ Y.T, (w * near.max(axis=1, keepdims=True) * len(index)) @ Y.T

    def _away(self, block: Block, s: ComplexArray, radius: float) -> Array:
        sigma = self.all.sigma[block.index]
        return np.asarray(np.maximum(np.abs(s[:, None] - sigma) - radius, 0.0))

    def _from_interval(self, block: Block, c: Array, h: Array) -> Array:
        sigma = self.all.sigma[block.index]
        aside = np.maximum(np.abs(c[:, None] - sigma.imag) - h[:, None], 0.0)
        return np.hypot(sigma.real, aside)

    def _solved(self, block: Block, s: ComplexArray) -> ComplexArray:
        """Return w = (s − T)⁻¹ ξ of a block by back-substitution, shape (m, k)."""
        index, T = block.index, block.T
        u = self.all.a[index] + self.all.b[index] / (s[:, None] - self.all.sigma[index])
        w = np.zeros((len(s), len(index)), complex)
        for i in reversed(range(len(index))):
            above = w[:, i + 1 :] @ T[i, i + 1 :] if i + 1 < len(index) else 0.0
            w[:, i] = (self.form.entry[index[i]] + above) * u[:, i]
        return w

    def _of_block(
        self, block: Block, s: ComplexArray, h: Array, q: Array
    ) -> tuple[ComplexArray, ComplexArray, Array]:
        """Return Y (s − T)⁻¹ ξ of a block, its slope and curvature, shape (m, p)."""
        w, w1, w2 = self._chain(block, s, h, q)
        Y = self.form.shape[:, block.index].T
        return w @ Y, w1 @ Y, w2 @ np.abs(Y)

    def _chain(
        self, block: Block, s: ComplexArray, h: Array, q: Array
    ) -> tuple[ComplexArray, ComplexArray, Array]:
        """Return w = (s − T)⁻¹ ξ of a block, its slope and curvature."""
        index, T = block.index, block.T
        a, b, sigma = self.all.a[index], self.all.b[index], self.all.sigma[index]
        k, m = len(index), len(s)
        w, w1 = np.zeros((m, k), complex), np.zeros((m, k), complex)
        w2 = np.zeros((m, k))
        for i in reversed(range(k)):
            S = self.form.entry[index[i]] + w @ T[i]
            S1, S2 = w1 @ T[i], w2 @ np.abs(T[i])
            part = b[i] / (s - sigma[i])
            u, u1 = a[i] + part, -1j * part / (s - sigma[i])
            u2 = 2 * np.abs(b[i]) * q[:, i] ** 3
            w[:, i], w1[:, i] = S * u, S1 * u + S * u1
            w2[:, i] = product_curve(h, (S, S1, S2), (u, u1, u2))
        return w, w1, w2

    def _error(self, q: Array, near: list[Array], far: Array) -> Array:
        """Return the bounds of the error, given 1/distances of poles, of blocks', and 1 + |s|."""
        single = np.abs(self.simple.a) + np.abs(self.simple.b) * q if self.sampled else q
        pairs = zip(self.blocks, near, strict=True)
        ends = [far[:, None] / 2] * (len(self.bound.blocks) - len(self.blocks))
        return self.bound(single, [*(self._reach(*pair) for pair in pairs), *ends])

    def _reach(self, block: Block, near: Array) -> Array:
        return np.abs(self.all.a[block.index]) + np.abs(self.all.b[block.index]) * near


def factor_of(system: LinearSystem, long: bool = False) -> Factor:
    """Return a system with one input as a factor; of the same numbers, the same again.

    Parameters
    ----------
    system : LinearSystem
    long : bool
        In long numbers, where they know it better.
    """
    known = _KNOWN.setdefault(system, {})
    if long not in known:
        found = _of_form(modal_form(system))
        if long:
            found = min(found, _of_form(modal_form(system, long=True)), key=lambda x: x.unknown)
        known[long] = found
    return known[long]


# Of copies, which share a form; a factor knows its form, so that no weak key would do.
_of_form = lru_cache(COPIES)(Factor)
