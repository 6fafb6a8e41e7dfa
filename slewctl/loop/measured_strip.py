"""The strip in which a measured L lies, and what it meets: the real axis, |L| = 1, and −1.

Between two places L is no farther from a straight segment than the disks and its bend say.
Where the strip meets a line in one run of segments and L comes from one side and leaves to the
other, it crosses there for certain, somewhere in the run; elsewhere it may.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, BoolArray, IntArray
from slewctl.loop.measured_loop import MeasuredLoop
from slewctl.loop.measured_margin_results import MeasuredMargin
from slewctl.loop.single.enclosed import from_segment
from slewctl.loop.single.roots import passed

# A smallest distance is looked for between so many points, again and again about the lowest.
_POINTS, _ROUNDS = 17, 8
_TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Reach:
    """Where L may cross a line: one number for each run of segments that meet it.

    Attributes
    ----------
    least, most : ndarray, shape (k,)
        Of the real part, or of the angle from −1, that it may have there.
    certain : ndarray of bool, shape (k,)
        Whether it crosses.
    omega : ndarray, shape (k, 2)
        Between which frequencies in rad/s.
    """

    least: Array
    most: Array
    certain: BoolArray
    omega: Array


class Strip:
    """A measured loop as segments with radii.

    Parameters
    ----------
    loop : MeasuredLoop
    """

    def __init__(self, loop: MeasuredLoop) -> None:
        self.loop = loop
        self.start, self.step = loop.L[:-1], np.diff(loop.L)
        self.radius = np.maximum(loop.radius[:-1], loop.radius[1:]) + loop.bend

    def distance(self, point: float) -> Array:
        """Return how far each segment is from a real point, shape (m − 1,)."""
        half = 0.5 * self.step
        return from_segment(self.start + half, half, np.ones(len(half)), point)

    def near(self, point: float) -> BoolArray:
        """Return on which segments L may be there, shape (m − 1,)."""
        return self.distance(point) <= self.radius

    def modulus(self) -> MeasuredMargin:
        """Return the distance of L from −1."""
        loop, distance = self.loop, self.distance(-1.0)
        value, hz = self._lowest(distance - loop.bend, 0.0)
        least = self._lowest(distance - self.radius, -1.0)[0]
        most = self._lowest(distance - loop.bend, 1.0)[0]
        return MeasuredMargin(value, max(min(least, value), 0.0), max(most, value), hz)

    def gains(self) -> tuple[MeasuredMargin, MeasuredMargin]:
        """Return how much the gain may rise and fall."""
        loop, reach = self.loop, self._real_axis()
        hz = passed(lambda hz: loop.at(hz)[0].imag, loop.hz)
        at = loop.at(hz)[0].real
        hz, at = hz[at < 0], at[at < 0]

        def margin(rise: bool) -> MeasuredMargin:
            """Of gain factors 1/|x| above one, or below it."""
            here = at >= -1 if rise else at <= -1
            own, places = _decibels(at[here]), hz[here]
            low, high = reach.least, np.minimum(reach.most, 0.0)
            beside = (high >= -1) & (low < 0) if rise else low <= -1
            nearest = np.maximum(low, -1) if rise else np.minimum(high, -1)
            least = np.min(_decibels(nearest[beside]), initial=np.inf)
            sure = reach.certain & ((low >= -1) & (high < 0) if rise else high <= -1)
            most = np.min(_decibels(high[sure] if rise else low[sure]), initial=np.inf)
            return _margin(own, places, float(least), float(most))

        return margin(True), margin(False)

    def phases(self) -> tuple[MeasuredMargin, MeasuredMargin, tuple[float, ...]]:
        """Return phase and delay margin, and where |L| = 1."""
        loop, reach = self.loop, self._unit_circle()
        hz = passed(lambda hz: np.abs(loop.at(hz)[0]) - 1, loop.hz)
        turn = np.angle(-loop.at(hz)[0])
        low, high = reach.least, reach.most
        through = np.floor(high / _TURN) * _TURN >= low  # a whole number of turns is inside
        # The size of an angle between −π and π; the farthest of an interval is at an end, or π.
        ends = np.abs(np.angle(np.exp(1j * np.stack([low, high]))))
        half = np.floor((high - np.pi) / _TURN) * _TURN + np.pi >= low
        least = np.where(through, 0.0, ends.min(axis=0, initial=np.inf))
        most = np.where(half, np.pi, ends.max(axis=0, initial=0.0))
        phase = _margin(
            np.degrees(np.abs(turn)),
            hz,
            float(np.min(np.degrees(least), initial=np.inf)),
            float(np.min(np.degrees(most[reach.certain]), initial=np.inf)),
        )
        first = np.where(through, 0.0, np.mod(low, _TURN)) / reach.omega[:, 1]
        last = np.where(through, _TURN, np.mod(high, _TURN)) / reach.omega[:, 0]
        delay = _margin(
            np.mod(turn, _TURN) / (_TURN * hz),
            hz,
            float(np.min(first, initial=np.inf)),
            float(np.min(last[reach.certain], initial=np.inf)),
        )
        return phase, delay, tuple(hz.tolist())

    def _real_axis(self) -> Reach:
        """Return the real parts of where the strip meets the real axis."""
        y, dx, dy, R = self.start.imag, self.step.real, self.step.imag, self.radius
        level = np.where(dy == 0, 1.0, dy)
        # Where on the segment the axis is within R, and where there the disk reaches farthest.
        bounds = np.sort(np.stack([(-R - y) / level, (R - y) / level]), axis=0)
        first, last = np.where(dy == 0, [[0.0], [1.0]], np.clip(bounds, 0, 1))
        touched = (np.minimum(y, y + dy) <= R) & (np.maximum(y, y + dy) >= -R)
        rise = R * dx / np.maximum(np.abs(self.step), np.finfo(float).tiny)
        ends = []
        for sign in (-1.0, 1.0):
            t = np.where(dy == 0, sign * dx > 0, (sign * rise * np.sign(dy) - y) / level)
            t = np.clip(t, first, last)
            half = np.sqrt(np.maximum(R**2 - (y + t * dy) ** 2, 0.0))
            ends.append(self.start.real + t * dx + sign * half)
        return self._reach(touched, np.sign(self.loop.L.imag), *ends)

    def _unit_circle(self) -> Reach:
        """Return the angles from −1 of where the strip meets the unit circle."""
        size, R = np.abs(self.loop.L), self.radius
        touched = (self.distance(0.0) <= 1 + R) & (np.maximum(size[:-1], size[1:]) >= 1 - R)
        (a, b), (c, d) = self._within(1 + R), self._within(1 - R)
        first, last = np.clip(a, 0, 1), np.clip(b, 0, 1)
        first, last = (np.where((t > c) & (t < d), x, t) for t, x in ((first, d), (last, c)))
        # Along a run the angle is followed, so that it may turn by more than a half.
        angle = np.unwrap(np.angle(-self.loop.L))[:-1]
        ends = [self.start + np.clip(t, 0, 1) * self.step for t in (first, last)]
        turns = angle + np.angle(np.stack(ends) / self.start)
        wide = np.arcsin(np.minimum(R / np.maximum(self.distance(0.0), 1e-300), 1.0))
        return self._reach(touched, np.sign(size - 1), turns.min(0) - wide, turns.max(0) + wide)

    def _within(self, radius: Array) -> tuple[Array, Array]:
        """Return from where to where on its line a segment is within a circle about zero.

        Where it is not, both are where it is nearest.
        """
        L, step = self.start, self.step
        size = np.maximum(np.abs(step) ** 2, np.finfo(float).tiny)
        middle = -(L * step.conj()).real / size
        room = np.maximum(radius, 0) ** 2 - np.abs(L + middle * step) ** 2
        half = np.sqrt(np.maximum(room, 0) / size)
        return middle - half, middle + half

    def _reach(self, touched: BoolArray, side: Array, least: Array, most: Array) -> Reach:
        """Return what runs of touched segments reach."""
        edge = np.diff(np.concatenate([[0], touched.astype(int), [0]]))
        first, after = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
        # A run that begins or ends with the band may have crossed outside it.
        inside = (first > 0) & (after < len(touched))
        low, high = (
            _of_runs(f, x, first, after) for f, x in ((np.minimum, least), (np.maximum, most))
        )
        omega = _TURN * np.stack([self.loop.hz[first], self.loop.hz[after]], axis=1)
        return Reach(low, high, inside & (side[first] != side[after]), omega)

    def _lowest(self, bound: Array, times: float) -> tuple[float, float]:
        """Return the least |1 + L| + `times` the radius, and where.

        Parameters
        ----------
        bound : ndarray, shape (m - 1,)
            It is no less on a segment.
        times : float
        """
        loop = self.loop

        def at(hz: Array) -> Array:
            L, radius = loop.at(hz)
            return np.asarray(np.abs(1 + L) + times * radius)

        seen = np.abs(1 + loop.L) + times * loop.radius
        may_be = np.flatnonzero(bound <= seen.min())
        left, right = loop.hz[may_be], loop.hz[may_be + 1]
        part, row = np.linspace(0, 1, _POINTS), np.arange(len(left))
        for _ in range(_ROUNDS):
            hz = left[:, None] + part * (right - left)[:, None]
            k = np.argmin(at(hz.ravel()).reshape(hz.shape), axis=1)
            left, right = hz[row, np.maximum(k - 1, 0)], hz[row, np.minimum(k + 1, _POINTS - 1)]
        hz = np.concatenate([0.5 * (left + right), loop.hz[[np.argmin(seen)]]])
        found = at(hz)
        lowest = int(np.argmin(found))
        return float(found[lowest]), float(hz[lowest])


def _of_runs(extreme: np.ufunc, values: Array, first: IntArray, after: IntArray) -> Array:
    if not len(first):
        return np.zeros(0)
    ends = np.stack([first, after], axis=1).ravel()
    # reduceat takes from each index to the next; the last run may end with the array.
    return np.asarray(extreme.reduceat(np.append(values, values[-1]), ends)[::2])


def _decibels(x: Array) -> Array:
    """Return the size of 20 log₁₀|x|, infinite at zero."""
    with np.errstate(divide="ignore"):
        return np.abs(20 * np.log10(np.abs(x)))


def _margin(own: Array, hz: Array, least: float, most: float) -> MeasuredMargin:
    """Return the smallest of the margins of L's own crossings, between bounds of all."""
    if not len(own):
        return MeasuredMargin(np.inf, least, np.inf, None)
    k = int(np.argmin(own))
    value = float(own[k])
    return MeasuredMargin(value, min(least, value), max(most, value), float(hz[k]))
