"""A return ratio L = Σ Kᵢ Gᵢ e^(−sτ) that is never multiplied out, enclosed on intervals."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.loop.single.enclosed import Enclosed, from_segment, product_curve, reach
from slewctl.loop.single.factor import Factor, factor_of
from slewctl.loop.single.split import in_series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modal_bounds import ROUNDING
from slewctl.numerics.modal_form import LONGEST

# Intervals that are looked at together: a loop that nothing is known of has half a million, and
# each of them a number for every pole.
_AT_ONCE = 20_000


def factored(
    plant: LinearSystem, controller: LinearSystem | None = None, delay: float = 0.0
) -> FactoredLoop:
    """Return a loop in factors.

    Parameters
    ----------
    plant : LinearSystem
        With one input; without a controller, L itself, which is taken apart where its
        matrices show two systems in series.
    controller : LinearSystem, optional
        From the plant's outputs to its input, under negative feedback, on the plant's clock.
    delay : float
        Dead time in s of a continuous loop.
    """
    if controller is None and (parts := in_series(plant)) is not None:
        plant, controller = parts
    if controller is None:
        controller = LinearSystem(
            np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1), plant.dt
        )
    with np.errstate(all="ignore"):  # a pole at z = −1 is infinite on the plane of s
        return _factored(plant, controller, delay)


def _factored(plant: LinearSystem, controller: LinearSystem, delay: float) -> FactoredLoop:
    # Of one command: its dual has one input, and as many outputs as it reads.
    A, B, C, D = controller.matrices
    return FactoredLoop(plant, LinearSystem(A.T, C.T, B.T, D.T, plant.dt), delay)


@dataclass(frozen=True, eq=False)
class Enclosure:
    """L on intervals [c − h, c + h] of the axis, and H = sᵏ L, k the order of its pole at 0.

    L ∈ value + slope δ ± (curve δ²/2 + error), and so H with an error of |s|ᵏ error.

    Attributes
    ----------
    c, h : ndarray, shape (m,)
    value, slope, flat, flat_slope : ndarray of complex, shape (m,)
    curve, error, flat_curve, flat_error : ndarray, shape (m,)
    most : ndarray, shape (m,)
        |L| is smaller, however often dead time turns it.
    """

    c: Array
    h: Array
    value: ComplexArray
    slope: ComplexArray
    curve: Array
    error: Array
    flat: ComplexArray
    flat_slope: ComplexArray
    flat_curve: Array
    flat_error: Array
    most: Array

    def part(self, which: BoolArray | slice) -> Enclosure:
        """Return some of the intervals."""
        return Enclosure(*(getattr(self, field.name)[which] for field in fields(self)))

    @classmethod
    def joined(cls, parts: list[Enclosure]) -> Enclosure:
        """Return the intervals of several together."""
        columns = ([getattr(part, field.name) for part in parts] for field in fields(cls))
        return cls(*(np.concatenate(column) for column in columns))

    @cached_property
    def bend(self) -> Array:
        """What the curvature makes of L at the ends at most."""
        return 0.5 * self.h * self.h * self.curve

    @cached_property
    def radius(self) -> Array:
        """R: how far L is from the segment at most."""
        return self.bend + self.error

    @cached_property
    def reach(self) -> Array:
        """How far L may be from its value in the middle, for all that is known."""
        return np.abs(self.slope) * self.h + self.radius

    @cached_property
    def away(self) -> Array:
        """|1 + L| is at least so large."""
        away = from_segment(self.value, self.slope, self.h, -1.0) - self.radius
        return np.maximum(away, 1 - self.most)

    def steepness(self, offset: float = 0.0) -> Array:
        """Return how fast |L + offset| changes at least where that is positive.

        There it does so one way.
        """
        value = self.value + offset
        size, steep = np.abs(value), np.abs(self.slope)
        reach = steep * self.h + self.bend
        uphill = np.abs((value.conj() * self.slope).real)
        with np.errstate(invalid="ignore"):
            slope = uphill - (steep * reach + (size + reach) * self.h * self.curve)
            return np.asarray(slope / (size + reach))

    def imaginary(self, k: int) -> Imaginary:
        """Return vᵏ Im L, or Im L itself where that is known to be farther from zero.

        At the origin's pole the curvature of L grows without bound, beyond all poles that of
        vᵏ L.

        Parameters
        ----------
        k : int
            Order of the pole at zero.
        """
        back = (-1j) ** k
        plain = (self.value.imag, self.slope.imag, self.curve, self.error)
        flat = (
            (back * self.flat).imag,
            (back * self.flat_slope).imag,
            self.flat_curve,
            self.flat_error,
        )
        with np.errstate(all="ignore"):
            better = self._clearance(*plain) * self.c**k > self._clearance(*flat)
        value, slope, curve, error = (
            np.where(better, own, other) for own, other in zip(plain, flat, strict=True)
        )
        return Imaginary(value, slope, curve, error, np.where(better, 0, k))

    def _clearance(self, value: Array, slope: Array, curve: Array, error: Array) -> Array:
        reach = np.abs(slope) * self.h + 0.5 * self.h * self.h * curve + error
        return np.asarray(np.abs(value) - reach)


@dataclass(frozen=True, eq=False)
class Imaginary:
    """vᵏ Im L on intervals: in value + slope δ ± (curve δ²/2 + error); arrays of shape (m,)."""

    value: Array
    slope: Array
    curve: Array
    error: Array
    k: IntArray


class FactoredLoop:
    """The return ratio of a plant with one input and a controller with one command.

    Parameters
    ----------
    plant : LinearSystem
        From the command to the signals that the controller reads.
    dual : LinearSystem
        Of the controller: from its command to what it reads.
    delay : float
        Dead time in s of a continuous loop, anywhere in it.
    long : bool
        Whether to take long numbers where double precision knows a factor too little.

    Attributes
    ----------
    plant, controller : Factor
    """

    def __init__(
        self, plant: LinearSystem, dual: LinearSystem, delay: float = 0.0, long: bool = False
    ) -> None:
        self._systems = plant, dual
        self.plant, self.controller = factor_of(plant, long), factor_of(dual, long)
        self.delay, self.sample_time = delay, plant.sample_time

    @property
    def unknown(self) -> float:
        """The larger of the relative errors of the two factors."""
        return max(self.plant.unknown, self.controller.unknown)

    @property
    def longer(self) -> FactoredLoop | None:
        """The same in long numbers; None where they tell nothing better, or of rounding alone."""
        if self.unlinked:  # they would prove something of the last digits of what was given
            return None
        worse = max(zip(self._factors, self._systems, strict=True), key=lambda x: x[0].unknown)
        if len(worse[1].A) > LONGEST:
            return None
        found = FactoredLoop(*self._systems, self.delay, long=True)
        return found if found.unknown < 0.5 * self.unknown else None

    @property
    def unlinked(self) -> bool:
        """Whether poles at s = 0, or z = 1, are one chain by no more than rounding, if at all."""
        return any(factor.form.unlinked for factor in self._factors)

    @property
    def _factors(self) -> tuple[Factor, Factor]:
        return self.plant, self.controller

    @cached_property
    def order_at_zero(self) -> int:
        """Order k of the pole at s = 0, or z = 1, that is exactly there."""
        return self.plant.order_at_zero + self.controller.order_at_zero

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles of both factors on the plane of s, a sampled loop's too, but for z = −1."""
        return np.concatenate([self.plant.poles, self.controller.poles])

    @property
    def order_at_end(self) -> int:
        """Order of the pole at z = −1 that is exactly there."""
        return self.plant.has_end + self.controller.has_end

    def tail(self, far: float) -> tuple[float, float]:
        """Return Σ Kᵢ Gᵢ at infinite s, which is real, and how far from it it is for |s| ≥ far.

        Divided by sᵏ where a pole of order k is at z = −1.
        """
        (G, dG), (K, dK) = self.plant.leading(far), self.controller.leading(far)
        away = np.abs(G) * dK + dG * np.abs(K) + dG * dK
        # Farther out all poles are farther away; those of one distance differ by less than half.
        s = np.array([1j * far])
        eG, eK = 2 * self.plant.errors(s)[0], 2 * self.controller.errors(s)[0]
        eG, eK = eG / far**self.plant.has_end, eK / far**self.controller.has_end
        inexact = eG * (np.abs(K) + dK) + (np.abs(G) + dG) * eK + eG * eK
        return float((G * K).sum().real), float((away + inexact).sum())

    def at_origin(self, radius: float) -> tuple[float, float]:
        """Return sᵏ L at s = 0, which is real, and how far from it sᵏ L is for |s| ≤ radius.

        The error of L is that on the circle.
        """
        (G, dG), (K, dK) = self.plant.at_origin(radius), self.controller.at_origin(radius)
        value, away = (G * K).sum(), (np.abs(G) * dK + dG * np.abs(K) + dG * dK).sum()
        away = away + np.expm1(radius * self.delay) * (abs(value) + away)
        return float(value.real), float(away)

    def omega(self, v: Array) -> Array:
        """Return the frequency in rad/s at points of the axis."""
        v = np.asarray(v, dtype=float)
        return np.asarray(2 * np.arctan(v) / self.sample_time) if self.sample_time else v

    def axis(self, omega: Array) -> Array:
        """Return the points of the axis at frequencies in rad/s."""
        omega = np.asarray(omega, dtype=float)
        return np.asarray(np.tan(omega * self.sample_time / 2)) if self.sample_time else omega

    def at(self, s: ComplexArray) -> ComplexArray:
        """Return L at points s, shape (m,)."""
        found = (self.plant.values(s) * self.controller.values(s)).sum(axis=1)
        return np.asarray(found * np.exp(-s * self.delay) if self.delay else found)

    def on_axis(self, v: Array) -> ComplexArray:
        """Return L at s = jv, shape (m,)."""
        return self.at(np.asarray(1j * v, dtype=complex))

    def slopes(self, v: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return L and its derivative by v at s = jv, shape (m,)."""
        (G, G1), (K, K1) = self.plant.slopes(v), self.controller.slopes(v)
        value, slope = (G * K).sum(axis=1), (G1 * K + G * K1).sum(axis=1)
        if self.delay:
            turn = np.exp(-1j * v * self.delay)
            value, slope = value * turn, (slope - 1j * self.delay * value) * turn
        return value, slope

    def errors(self, s: ComplexArray) -> Array:
        """Return bounds of the error of `at`, shape (m,)."""
        G, K = np.abs(self.plant.values(s)), np.abs(self.controller.values(s))
        more = ROUNDING * (4 + np.abs(s) * self.delay)[:, None]
        eG, eK = self.plant.errors(s), self.controller.errors(s)
        return np.asarray((eG * K + G * eK + eG * eK + more * G * K).sum(axis=1))

    def enclosed(self, c: Array, h: Array) -> Enclosure:
        """Return L on the intervals [c − h, c + h]."""
        if len(c) <= _AT_ONCE:
            return self._enclosed(c, h)
        starts = range(0, len(c), _AT_ONCE)
        parts = [self._enclosed(c[k : k + _AT_ONCE], h[k : k + _AT_ONCE]) for k in starts]
        return Enclosure.joined(parts)

    def _enclosed(self, c: Array, h: Array) -> Enclosure:
        wide = h[:, None]
        G, K = self.plant.enclosed(c, h), self.controller.enclosed(c, h)
        value, slope, curve, error = _product(G, K, wide)
        most = reach(h, value, slope, curve)[0]
        if self.delay:
            error = error + ROUNDING * (1 + (c + h) * self.delay) * np.abs(value)
        k, power = self.order_at_zero, np.asarray((1j * c) ** self.order_at_zero)
        if k:
            before = 1j * k * np.asarray((1j * c) ** (k - 1))
            flat_slope = before * value + power * slope
            sides = (
                _flattened(c, X, at.order_at_zero)
                for at, X in zip(self._factors, (G, K), strict=True)
            )
            flat_curve = product_curve(wide, *sides).sum(axis=1)
        else:
            flat_slope, flat_curve = slope, curve
        flat = power * value
        if self.delay:
            turn = np.exp(-1j * c * self.delay)
            lag = (turn, -1j * self.delay * turn, np.full(len(c), self.delay * self.delay))
            curve = product_curve(h, (value, slope, curve), lag)
            flat_curve = product_curve(h, (flat, flat_slope, flat_curve), lag)
            slope = slope * turn + value * lag[1]
            flat_slope = flat_slope * turn + flat * lag[1]
            value, flat = value * turn, flat * turn
        return Enclosure(
            c,
            h,
            value,
            slope,
            curve,
            error,
            flat,
            flat_slope,
            flat_curve,
            error * (c + h) ** k,
            most + error,
        )


def _product(X: Enclosed, Y: Enclosed, h: Array) -> tuple[ComplexArray, ComplexArray, Array, Array]:
    """Return value, slope, curvature and error of Σ Xᵢ Yᵢ."""
    x, y = (X.value, X.slope, X.curve), (Y.value, Y.slope, Y.curve)
    value = (X.value * Y.value).sum(axis=1)
    slope = (X.slope * Y.value + X.value * Y.slope).sum(axis=1)
    curve = product_curve(h, x, y).sum(axis=1)
    with np.errstate(invalid="ignore"):
        far_x, far_y = reach(h, *x)[0], reach(h, *y)[0]
        error = (X.error * far_y + far_x * Y.error + X.error * Y.error).sum(axis=1)
        error += 4 * ROUNDING * (far_x * far_y).sum(axis=1)
    return value, slope, curve, np.where(np.isnan(error), np.inf, error)


def _flattened(c: Array, x: Enclosed, k: int) -> tuple[ComplexArray, ComplexArray, Array]:
    """Return value, slope and curvature of sᵏ X at s = jc."""
    if not k:
        return x.value, x.slope, x.flat
    power = ((1j * c) ** k)[:, None]
    before = (1j * k * (1j * c) ** (k - 1))[:, None]
    return power * x.value, before * x.value + power * x.slope, x.flat
