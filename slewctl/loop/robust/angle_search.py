"""The largest or smallest angle between two lines over the whole axis, by intervals.

An interval is done when it proves that the angle is nowhere on it beyond the best value seen,
but for a tolerance, and how often the inner product turns about zero; else it is cut in parts.
Rounding of the lines is a distance by the triangle inequality, and added at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, BoolArray
from slewctl.loop.robust.graph_line import Direction, GraphLine
from slewctl.loop.robust.line_pair import Angle, Lines

# What is proved of the angle's sine is this near to what was seen; with rounding, 1e-9.
TOLERANCE, KNOWN = 5e-10, 1e-9
# Ends of the axis are left where the lines stand still but for this.
_STILL = 1e-10
_TIMES, _LEVELS, _MOST, _REFINED = 60, 60, 50_000, 4
# Hills that are climbed, in so many steps of so many points.
_HILLS, _POLISHED, _FINE, _HALVED = 2, 4, 17, 20
# Into how many parts intervals are cut while there are no more than so many.
_PARTS = ((48, 8), (160, 4))
# Marks about a pole: so much farther than the one before, from so many times its width.
_GRADED, _GRADES, _WIDE = 8.0, 20, 30.0
# Lines that come so near to a right angle touch: how often the product turns has no meaning.
TOUCHING = 1 - 1e-9
_ROUNDING = 1e-14  # of products, where lines are known
_HIDDEN = "a pole on the axis is hidden, or several are at one place of it"


class UndecidedAngleError(Exception):
    """Something could not be proved: why, in words."""


@dataclass(frozen=True)
class Place:
    """A part of the axis on which both lines stand still."""

    start: float
    end: float
    at: float
    one: Direction
    two: Direction

    @property
    def away(self) -> float:
        return self.one.away + self.two.away


@dataclass(frozen=True)
class Found:
    """The extreme sine of the angle, and what is proved.

    Attributes
    ----------
    value, v : float
        Where it was seen, on the plane of s.
    lower, upper : float
    turn : float or None
        Change of the argument of the inner product of (1, A) and (1, B) from zero to
        infinity, on a contour right of poles on the axis; None where it is undecided.
    intervals : int
    """

    value: float
    v: float
    lower: float
    upper: float
    turn: float | None
    intervals: int

    def hertz(self, sample_time: float) -> float | None:
        """Return the frequency in Hz; None where it is infinite."""
        omega = 2 * np.arctan(self.v) / sample_time if sample_time else self.v
        return float(omega / (2 * np.pi)) if np.isfinite(omega) else None


def extreme(lines: Lines) -> Found:
    """Return the extreme angle of two lines.

    Raises
    ------
    UndecidedAngleError
        If a pole on the axis is hidden, or several are at one place of it.
    """
    return _Search(lines).found


class _Search:
    def __init__(self, lines: Lines) -> None:
        self.lines, self.sign = lines, 1.0 if lines.larger else -1.0
        self.pair: tuple[GraphLine, GraphLine] = (lines.first, lines.second)
        self.best, self.v = -np.inf, 0.0  # of sign·sine
        self.turn: float | None = 0.0
        self.intervals = 0
        self.slow, self.fast = self._sizes()
        self.low = self.slow / 2 if any(line.order for line in self.pair) else 0.0
        self.places = self._places()
        for place in self.places:
            self._still(place)
        self.done: list[Array] = []
        self.turns: list[Array] = []
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            self._run(self.places)
            if self.turn is not None:
                self.turn += self._turned()
            self.found = self._told()

    def _told(self) -> Found:
        proved = max(
            self._proved(),
            *(self.sign * self._sine(place) + place.away for place in self.places),
        )  # fmt: skip
        best = self.best
        if proved >= (1.0 if self.lines.larger else 0.0):  # errors may turn the product about zero
            self.turn = None
        lower, upper = sorted((self.sign * (best - self._seen()), self.sign * proved))
        return Found(
            min(self.sign * best, 1.0), self.v, max(float(lower), 0.0), min(float(upper), 1.0),
            self.turn, self.intervals,
        )  # fmt: skip

    def _sine(self, place: Place) -> float:
        return self.lines.sine(place.one, place.two)

    def _still(self, place: Place) -> None:
        """Take account of a part on which the lines stand still."""
        sine = self._sine(place)
        if self.sign * sine > self.best:
            self.best, self.v = self.sign * sine, place.at
        lengths = [float(np.linalg.norm(line.vector)) for line in (place.one, place.two)]
        inner = abs(self.lines.product(place.one.vector, place.two.vector)) / np.prod(lengths)
        if self.turn is None or not inner > 3 * place.away:
            self.turn = None
            return
        # From the end of the axis, where all is real, to the first or last mark.
        origin = place.start == 0
        there = complex(self.lines.on_axis(np.array([place.end if origin else place.start]))[0][0])
        k = [line.order if origin else 0 for line in self.pair]
        there *= 1j ** (k[0] + (-k[1] if self.lines.larger else k[1]))
        real = self.lines.product(place.one.vector, place.two.vector).real
        change = float(np.angle(there * np.sign(real)))
        self.turn += change if origin else -change

    def _sizes(self) -> tuple[float, float]:
        poles = np.concatenate([line.factor.poles for line in self.pair])
        sizes = np.abs(poles[poles != 0])
        return (float(sizes.min()), float(sizes.max())) if len(sizes) else (1.0, 1.0)

    def _places(self) -> list[Place]:
        """Return both ends of the axis."""
        first, last = 1e-12 * self.slow, 1e12 * self.fast
        start = self._smallest(lambda r: Place(0.0, r, 0.0, *(x.origin(r) for x in self.pair)),
                               first, 0.1)  # fmt: skip
        end = self._smallest(lambda r: Place(r, np.inf, np.inf, *(x.tail(r) for x in self.pair)),
                             last, 10.0)  # fmt: skip
        if any(line.crowded or any(x.away > 0.1 for x in line.passed) for line in self.pair):
            raise UndecidedAngleError(_HIDDEN)
        return [start, end]

    def _smallest(self, make: Callable[[float], Place], radius: float, times: float) -> Place:
        """Return the place that is left open as soon as the lines stand still on it."""
        best: Place | None = None
        for _ in range(_TIMES):
            with np.errstate(all="ignore"):
                place = make(radius)
            if best and best.away < 0.1 and place.away > 0.5 * best.away:
                break  # rounding is all there is
            if best is None or place.away < best.away:
                best = place
            if best.away <= _STILL:
                break
            radius *= times
        if best is None or not best.away < 0.1:
            raise UndecidedAngleError(_HIDDEN)
        return best

    def _about(self, tops: Array) -> Array:
        """Return marks about some points, nearer to each other the nearer they are to one."""
        poles = np.concatenate([[0.0], *(line.factor.poles for line in self.pair)])
        near = np.abs(poles - 1j * tops[:, None]).min(axis=1)
        step = np.outer(near, 2.0 ** -np.arange(_HALVED))
        return np.concatenate(
            [(tops[:, None] - step).ravel(), tops, (tops[:, None] + step).ravel()]
        )

    def _marks(self, places: list[Place], about: Array) -> tuple[Array, Array]:
        """Return first intervals: between the places, cut at all poles, and at some points."""
        low, high = places[0].end, places[-1].start
        decades = np.geomspace(low, high, 2 + int(np.log10(high / low)))
        marks = [decades, np.array([self.low])]
        for line in self.pair:
            poles = line.factor.poles
            marks.append(np.abs(poles[np.abs(poles.real) > 1e-9 * np.abs(poles)]))
            poles = poles[(poles.imag > 0) & (_WIDE * np.abs(poles.real) < 0.2 * poles.imag)]
            step = np.maximum(_WIDE * np.abs(poles.real), 1e-9 * poles.imag)
            for _ in range(_GRADES):
                inside = step < 0.2 * poles.imag
                marks += [(poles.imag + sign * step)[inside] for sign in (-1, 1)]
                step = step * _GRADED
            for passed in line.passed:
                marks.append(np.array([passed.v - passed.radius, passed.v + passed.radius]))
        points = np.concatenate(marks)
        points = np.unique(points[(points >= low) & (points <= high)])
        apart = np.concatenate([[True], np.diff(points) > 1e-12 * points[1:]])
        points = points[apart]
        # Not in the middle: parts of an interval about a pole would end at it.
        points = np.union1d(points, points[:-1] ** 0.4 * points[1:] ** 0.6)
        if len(about):
            points = np.union1d(points, about[(about >= low) & (about <= high)])
            points = points[np.diff(points, prepend=0.0) > 1e-14 * points]
        for line in self.pair:
            for passed in line.passed:
                points = points[np.abs(points - passed.v) > 1e-10 * passed.v]
        points[[0, -1]] = low, high
        return points[:-1], points[1:]

    def _run(self, places: list[Place]) -> None:
        a, b = self._marks(places, np.zeros(0))
        tops = self._see(np.unique(np.concatenate([a, 0.5 * (a + b), b])))
        a, b = self._marks(places, self._about(tops))
        asked = np.ones((2, len(a)), dtype=bool)
        for level in range(_LEVELS):
            if not len(a):
                return
            self.intervals += len(a)
            if self.best * self.sign >= TOUCHING and self.lines.larger:
                self.turn = None
                asked[1] = False
            last = level == _LEVELS - 1 or self.intervals > _MOST
            left = self._answer(a, b, asked, last)
            keep = left.any(axis=0)
            a, b, asked = a[keep], b[keep], left[:, keep]
            parts = next((count for most, count in _PARTS if len(a) <= most), 2)
            a, b = _cut(a, b, parts)
            asked = np.tile(asked, parts)

    def _answer(self, a: Array, b: Array, asked: BoolArray, last: bool) -> BoolArray:
        """Return which questions stay open on which intervals: of the sine, and of the turns.

        None does where intervals are as small as numbers, or too many: they keep what they prove.
        """
        c, h = _middle(a, b)
        angle = self.lines.enclosed(c, h, b <= self.low)
        sines = self.sign * angle.sine
        k = int(np.nan_to_num(sines, nan=-np.inf).argmax())
        if sines[k] > self.best:
            self.best, self.v = float(sines[k]), float(c[k])
        within = self._within(angle)
        left = asked & ~np.array([within, angle.sure])
        counted = asked[1] & angle.sure
        a1, b1, one, two = (x[counted] for x in (a, b, *angle.taken))
        self.turns.append(np.array([a1, b1, self.lines.turn(a1, b1, (one, two))]))
        small = (h <= 16 * np.finfo(float).eps * c) | last
        if (left[1] & small).any():
            self.turn = None
        left &= ~small
        limit = np.where(within | ~asked[0], self.best + TOLERANCE, np.inf)
        self._keep(a, b, limit, angle, ~left.any(axis=0))
        return left

    def _keep(self, a: Array, b: Array, limit: Array, angle: Angle, here: BoolArray) -> None:
        """Remember what an interval proves: the sine, and how long both vectors are at least."""
        proved = np.minimum(limit, self._bound(angle))
        self.done.append(np.array([a, b, proved, *angle.lengths])[:, here])

    def _bound(self, angle: Angle) -> Array:
        """Return what is known of the sine without its slope."""
        larger = self.lines.larger
        known = np.nan_to_num(angle.bounds[int(larger)], nan=1.0 if larger else 0.0)
        return np.asarray(self.sign * np.minimum(known, 1.0))

    def _within(self, angle: Angle) -> BoolArray:
        """Whether the angle is nowhere beyond the best one, but for the tolerance."""
        limit = self.best + TOLERANCE
        t = max(self.sign * limit, 0.0) ** 2
        PQ, N, h = angle.PQ, angle.N, angle.N.h
        value, slope = self.sign * (t * PQ.value - N.value), t * PQ.slope - N.slope
        curve = t * PQ.curve + N.curve
        room = value - np.abs(slope) * h - 0.5 * h * h * curve
        return np.asarray((room >= 1e-15 * t * PQ.value) | (self._bound(angle) <= limit))

    def _turned(self) -> float:
        """Return by how much the argument of the product changes on all intervals."""
        a, b, moved = np.concatenate(self.turns, axis=1)
        points, place = np.unique(np.concatenate([a, b]), return_inverse=True)
        ends = self.lines.on_axis(points)[0][place]
        change = np.angle(ends[len(a) :] / ends[: len(a)])
        return float((_wrapped(change + moved) - moved).sum())

    def _see(self, v: Array) -> Array:
        """Look at points of the axis, climb the highest hills, and return their tops."""
        sines = self.sign * self.lines.on_axis(v)[1]
        inner = np.nan_to_num(sines, nan=-np.inf)
        around = np.concatenate([[-np.inf], inner, [-np.inf]])
        hills = np.flatnonzero((inner >= around[:-2]) & (inner >= around[2:]))
        hills = hills[np.argsort(-inner[hills])][:_HILLS]
        left, right = v[np.maximum(hills - 1, 0)], v[np.minimum(hills + 1, len(v) - 1)]
        for _ in range(_POLISHED):
            fine = np.linspace(left, right, _FINE)  # (points, hills)
            sines = self.sign * self.lines.on_axis(fine.ravel())[1].reshape(fine.shape)
            k = np.nan_to_num(sines, nan=-np.inf).argmax(axis=0)
            hill = np.arange(len(hills))
            tops, heights = fine[k, hill], sines[k, hill]
            left, right = fine[np.maximum(k - 1, 0), hill], fine[np.minimum(k + 1, _FINE - 1), hill]
            best = int(heights.argmax())
            if heights[best] > self.best:
                self.best, self.v = float(heights[best]), float(tops[best])
        return tops

    def _proved(self) -> float:
        """Return the sine that is proved with all errors of both lines."""
        found = np.concatenate(self.done, axis=1)
        limit = self.best + TOLERANCE
        for _ in range(_REFINED):
            a, b, claim, *lengths = found
            proved = claim + self._inexact(*_middle(a, b), np.array(lengths))
            beyond = (proved > limit + _STILL) & (claim <= limit)
            if not beyond.any():
                break
            # Of a long interval the error is that at its nearest to any pole: cut it.
            a, b = _cut(a[beyond], b[beyond], 8)
            claim = np.tile(claim[beyond], 8)
            self.done = []
            angle = self.lines.enclosed(*_middle(a, b), b <= self.low)
            self._keep(a, b, claim, angle, np.ones(len(a), dtype=bool))
            found = np.concatenate([found[:, ~beyond], *self.done], axis=1)
        return float(np.nan_to_num(proved, nan=1.0).max())

    def _inexact(self, c: Array, h: Array, lengths: Array) -> Array:
        """Return the chordal distances that errors of both lines make on intervals."""
        total = np.full(len(c), _ROUNDING)
        for line, own in zip(self.pair, np.maximum(lengths, 1.0), strict=True):
            total += line.inexact(c, h, own)
        return total

    def _seen(self) -> float:
        """Return how far from the truth the best value may be."""
        for place in self.places:
            if place.start <= self.v <= place.end:
                return place.away
        v = np.array([self.v])
        lengths = [np.linalg.norm(line.values(v), axis=1) for line in self.pair]
        return float(self._inexact(v, 0 * v, np.array(lengths))[0])


def _middle(a: Array, b: Array) -> tuple[Array, Array]:
    c = 0.5 * (a + b)
    return c, np.maximum(b - c, c - a) * (1 + 1e-15)


def _cut(a: Array, b: Array, parts: int) -> tuple[Array, Array]:
    points = a + np.arange(parts + 1)[:, None] / parts * (b - a)
    points[-1] = b
    return points[:-1].ravel(), points[1:].ravel()


def _wrapped(angle: Array | float) -> Array:
    return np.asarray((np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)
