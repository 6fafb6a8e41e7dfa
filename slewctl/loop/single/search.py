"""The whole axis in intervals, each of which proves something or is halved.

On an interval [c − h, c + h] the loop is L(c) + L′(c) δ but for R, a bound of curvature and
errors.  Questions are asked until each is answered everywhere: |L| = 1 is impossible, or
passed once; L is not real and negative there, or once, or no better than what was found;
1 + L is at least as far from zero as the best value seen, and so with the disk and with |T|;
|1 + L| passes √2 first elsewhere, or here once; the argument of 1 + L changes by what its ends
say.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.loop.single.axis_ends import WIDEST, Gap, Tail, first_intervals
from slewctl.loop.single.distances import OF_S, OF_T, beyond, measured, near, where_large
from slewctl.loop.single.enclosed import from_segment
from slewctl.loop.single.factored_loop import Enclosure, FactoredLoop, Imaginary
from slewctl.loop.single.findings import Least, Points, polish
from slewctl.loop.single.interval_ends import FARTHER, LEVEL_OF_S, monotone, settled, turns

# Relative tolerance of the smallest distances.
TOLERANCE = 2e-10
_MOST = 400_000
_LEVELS = 200
# Steps towards a smallest value, down to where rounding hides the bend.
_POLISHED, _NEAREST = 12, 1e-6
# Of a distance that boxes prove, in bits.
_BISECTED = 40
# Into how many parts intervals are cut while there are no more than so many.
_PARTS = ((4, 32), (12, 16), (32, 8), (128, 4))
UNIT, REAL, WINDING, LEVEL, MODULUS, DISK, COMPLEMENTARY = range(7)


class Search:
    """Answers all questions of one loop.

    Parameters
    ----------
    loop : FactoredLoop
    gaps : list of Gap
        Without the origin's.
    start : Gap or None
        At the origin.
    end : Tail
    shift : float
        (σ − 1)/2 of the disk.
    most_gain : float
        The largest gain factor that matters; below `WIDEST` the nearest limits alone do.

    Attributes
    ----------
    unit, unit_touched, real, real_touched : Points
        |L| = 1 passed, or not excluded; the same of L real and negative.
    crossings : Enclosure
        L within the widths of `unit` and then of `real`.
    level, level_touched : Points
        The first |1 + L| = √2 that is passed, and what is not excluded before it.
    floor : float
        Gain factors below it, at which a gap may hide a pole on the limit, are not judged.
    unstable_open : int
        Unstable poles of the factors, without those in gaps.
    turn : float or None
        Change of arg(1 + L) over the axis; None where it is undecided.
    intervals : int
    of_size_one : bool
        Whether |L| = 1 is excluded nowhere.
    """

    def __init__(
        self,
        loop: FactoredLoop,
        start: Gap | None,
        gaps: list[Gap],
        end: Tail,
        shift: float,
        most_gain: float = WIDEST,
    ) -> None:
        self.loop = loop
        self.shifts = {MODULUS: OF_S, DISK: shift, COMPLEMENTARY: OF_T}
        self.unit, self.unit_touched = Points(), Points()
        self.real, self.real_touched = Points(), Points()
        self.level, self.level_touched = Points(), Points()
        closed = [*gaps, *([start] if start else [])]
        large = [gap.least for gap in closed] + ([end.least] if end.least else [])
        self.floor = max((1 / least for least in large), default=0.0)
        self.turn: float | None = end.turn + sum(gap.turn for gap in closed)
        self.most_gain = most_gain
        self.rise, self.fall = most_gain, max(1 / WIDEST, self.floor)
        # Of infinitely many, too, limits farther out than one that is surely there are left.
        self.nearest_alone = bool(loop.delay) or most_gain < WIDEST
        inside = sum(gap.unstable for gap in closed)
        self.unstable_open = int(np.sum(loop.poles.real > 0)) - inside
        self.intervals, self.of_size_one = 0, True
        self._steep, self._sloping, self._falling = monotone(), monotone(), monotone()
        self._turns, self._low = turns(), np.inf  # from where |1 + L| is less than √2
        self._answered: list[tuple[Array, Array, BoolArray]] = []
        self._least = dict.fromkeys(self.shifts, (np.inf, 0.0, 0.0))
        self._undecided: dict[int, list[Enclosure]] = {kind: [] for kind in self.shifts}
        self._run(*first_intervals(loop, start, gaps, end))
        # The others were held against the smallest distance that was seen.
        self._proved = {kind: self._nearest(kind) for kind in self.shifts}
        self.level.keep_lowest()
        polish(self.unit, self.level, self.real, LEVEL_OF_S, loop.slopes)
        self.crossings = self._tighten()
        self._ends(large, end)
        self._polish()

    def proof(self, question: int) -> tuple[Array, Array]:
        """Return the ends of the intervals on which a question was answered, increasing.

        Some distances are proved to be only a little less than the smallest one that was
        seen; what cannot be told from a crossing is among those that are touched.

        Parameters
        ----------
        question : int
            UNIT, REAL, WINDING, LEVEL, MODULUS, DISK or COMPLEMENTARY.
        """
        a = np.concatenate([a[asked[question]] for a, _, asked in self._answered])
        b = np.concatenate([b[asked[question]] for _, b, asked in self._answered])
        order = np.argsort(a)
        return a[order], b[order]

    def least(self, kind: int) -> Least:
        """Return the smallest distance of a kind: min |1 + L| of MODULUS, 1/|S + shift| of DISK.

        Of COMPLEMENTARY it is min |1 + L|/|L|, the reciprocal of the largest |T|.
        """
        value, v, _ = self._least[kind]
        return Least(value, v, min(self._proved[kind], value))

    def _ends(self, large: list[float], end: Tail) -> None:
        for kind, shift in self.shifts.items():
            for least in large:
                self._proved[kind] = min(self._proved[kind], where_large(shift, least))
            if end.least:
                continue
            circle = np.array([end.limit + 0j])
            if self.loop.delay:
                circle = abs(end.limit) * np.exp(1j * np.linspace(0, np.pi, 3))
            values = measured(shift, circle)
            k = int(np.argmin(values))
            if values[k] < self._least[kind][0]:
                self._least[kind] = float(values[k]), np.inf, 0.0
            proved = near(shift, complex(circle[k]), end.away)
            if proved > 0 and end.away > 1e-9 * abs(1 + circle[k]):
                self._proved[kind] = min(self._proved[kind], proved)

    def _tighten(self) -> Enclosure:
        """Bring crossings nearer to where they are, from what is known beside them: all of it."""
        v, width = (np.concatenate([u, r]) for u, r in zip(
            (self.unit.left[0], self.unit.width[0]), (self.real.left[0], self.real.width[0]),
            strict=True,
        ))  # fmt: skip
        box, count = self.loop.enclosed(v, width), len(self.unit.left[0])
        part = box.imaginary(self.loop.order_at_zero)
        self.unit.tighten(box.error[:count], box.steepness()[:count])
        steep = np.abs(part.slope) - width * part.curve
        self.real.tighten(part.error[count:], steep[count:])
        return replace(box, h=np.concatenate([self.unit.width[0], self.real.width[0]]))

    def _polish(self) -> None:
        """Go to the bottom of the parabola through three points about each smallest value."""
        for kind, shift in self.shifts.items():
            for _ in range(_POLISHED):
                value, v, h = self._least[kind]
                if not (_NEAREST * v < h < v < np.inf):
                    break
                points = np.array([v - h / 2, v, v + h / 2])
                left, middle, right = measured(shift, self.loop.on_axis(points)).tolist()
                bend = left - 2 * middle + right
                if not bend > 0:
                    break
                step = float(np.clip((left - right) / bend / 4, -1, 1)) * h
                lower = float(measured(shift, self.loop.on_axis(np.array([v + step])))[0])
                if not lower < value:
                    step, lower = 0.0, value
                self._least[kind] = lower, v + step, max(abs(step), h / 4)

    def _lower(self, L: ComplexArray, v: Array, h: Array) -> None:
        for kind, shift in self.shifts.items():
            values = measured(shift, L)
            k = int(np.argmin(values))
            if values[k] < self._least[kind][0]:
                self._least[kind] = float(values[k]), float(v[k]), float(h[k])

    def _run(self, a: Array, b: Array) -> None:
        asked = np.ones((7, len(a)), dtype=bool)
        # A smallest value may be reached where the axis begins or ends, which no middle is.
        ends = np.setxor1d(a, b)
        self._lower(self.loop.on_axis(ends), ends, 0 * ends)
        for _ in range(_LEVELS):
            if not len(a):
                break
            self.intervals += len(a)
            c = 0.5 * (a + b)
            h = np.maximum(b - c, c - a) * (1 + 1e-15)
            box = self.loop.enclosed(c, h)
            part = box.imaginary(self.loop.order_at_zero)
            self._lower(box.value, c, h)
            left = self._answer(box, part, a, b, asked)
            self.of_size_one &= not (asked[UNIT] & ~left[UNIT]).any()
            small = self._settled(box, part) | (self.intervals > _MOST)
            self._give_up(box, left & small)
            left &= ~small
            self._answered.append((a, b, asked & ~left))
            keep = left.any(axis=0)
            a, b, asked = _parted(a[keep], b[keep], left[:, keep])
        turn = settled(
            self.loop.on_axis,
            (self._steep, (self.unit, self.unit_touched)),
            (self._sloping, (self.real, self.real_touched)),
            (self._falling, (self.level, self.level_touched)),
            self._turns,
        )
        if self.turn is not None:
            self.turn += turn

    def _settled(self, box: Enclosure, part: Imaginary) -> BoolArray:
        """Whether halving would change nothing, for each question: its errors are all there is."""
        h, L = box.h, box.value
        reach, twice = np.abs(box.slope) * h + box.bend, 2 * box.error
        moves = np.abs(part.slope) * h + 0.5 * h * h * part.curve
        small = np.empty((7, len(h)), dtype=bool)
        small[UNIT] = np.abs(np.abs(L) - 1) + reach <= twice
        small[REAL] = np.abs(part.value) + moves <= 2 * part.error
        small[list(self.shifts)] = box.bend <= 0.25 * box.error
        w = np.abs(1 + L)
        small[WINDING] = w + reach <= twice
        small[LEVEL] = np.abs(w - LEVEL_OF_S) + reach <= twice
        if (unknown := ~np.isfinite(box.error)).any():
            # Of a shorter interval, farther from a pole, the error may be known: in its middle.
            at = self.loop.errors(np.asarray(1j * box.c[unknown], dtype=complex))
            small[:, unknown] = ~np.isfinite(at)
        return np.asarray(small | (h <= 16 * np.finfo(float).eps * box.c))

    def _answer(
        self,
        box: Enclosure,
        part: Imaginary,
        a: Array,
        b: Array,
        asked: BoolArray,
    ) -> BoolArray:
        """Return which questions stay open on which intervals."""
        h, L, L1, R = box.h, box.value, box.slope, box.radius
        ahead, back = np.abs(L + L1 * h), np.abs(L - L1 * h)
        most = np.minimum(np.maximum(ahead, back) + R, box.most)
        least = from_segment(L, L1, h, 0.0) - R
        left = np.zeros_like(asked)
        left[UNIT] = self._unit(box, (a, b), asked[UNIT] & (least <= 1) & (most >= 1))
        left[REAL] = self._real(box, part, (a, b), asked[REAL], (least, most))
        left[LEVEL] = self._level(box, (a, b), asked[LEVEL] & (a < self._low))
        for kind, shift in self.shifts.items():
            t = self._least[kind][0] * (1 - TOLERANCE)
            left[kind] = asked[kind] & ~beyond(shift, box, t, self.loop.order_at_zero)
        short = np.abs(1 + L) > FARTHER * box.reach
        clear = short | (box.most < 1)
        self._turns.add(asked[WINDING] & clear, a, b, 1 + L, short)
        left[WINDING] = asked[WINDING] & ~clear
        return left

    def _level(self, box: Enclosure, ends: tuple[Array, Array], asked: BoolArray) -> BoolArray:
        """Leave open where |1 + L| may be √2, below the first place where it is less for sure."""
        L, L1, h = 1 + box.value, box.slope, box.h
        most = np.maximum(np.abs(L + L1 * h), np.abs(L - L1 * h)) + box.radius
        self._low = float(np.min(ends[0][most < LEVEL_OF_S], initial=self._low))
        open_ = asked & (most >= LEVEL_OF_S) & (box.away <= LEVEL_OF_S)
        if not open_.any():
            return open_
        steep = box.steepness(1.0)
        once = open_ & (steep > 0)
        off = box.error / np.where(once, steep, 1.0)
        self._falling.add(once, *ends, box.error, off, np.zeros(len(off)))
        return open_ & ~once

    def _unit(self, box: Enclosure, ends: tuple[Array, Array], asked: BoolArray) -> BoolArray:
        if not asked.any():
            return asked
        steep = box.steepness()
        once = asked & (steep > 0)
        off = box.error / np.where(once, steep, 1.0)
        self._steep.add(once, *ends, box.error, off, np.zeros(len(off)))
        return asked & ~once

    def _real(
        self,
        box: Enclosure,
        part: Imaginary,
        ends: tuple[Array, Array],
        asked: BoolArray,
        size: tuple[Array, Array],
    ) -> BoolArray:
        h, (least, most) = box.h, size
        positive = box.value.real - np.abs(box.slope.real) * h - box.radius > 0
        beyond = (most < 1) & (most * self.rise < 1) | (least > 1) & (least * self.fall > 1)
        steep = np.abs(part.slope)
        apart = np.abs(part.value) > steep * h + 0.5 * h * h * part.curve + part.error
        open_ = asked & ~positive & ~beyond & ~apart
        if not open_.any():
            return open_
        steep = steep - h * part.curve
        once = open_ & (steep > 0)
        off = part.error / np.where(once, steep, 1.0)
        self._sloping.add(once, *ends, part.error, off, part.k)
        if self.nearest_alone:
            self._approach(once & (box.value.real + box.reach < 0), ends, size)
        return open_ & ~once

    def _approach(
        self, negative: BoolArray, ends: tuple[Array, Array], size: tuple[Array, Array]
    ) -> None:
        """Bring the widest gains that matter nearer, where L is real on intervals."""
        if not negative.any():
            return
        a, b = (self.loop.on_axis(end[negative]).imag > 0 for end in ends)
        least, most = (bound[negative][a != b] for bound in size)
        self.rise = float(np.min(1 / least[most < 1], initial=self.rise))
        self.fall = float(np.max(1 / most[least > 1], initial=self.fall))

    def _give_up(self, box: Enclosure, left: BoolArray) -> None:
        """Record what cannot be decided above rounding."""
        if not left.any():
            return
        for kind, points in (
            (UNIT, self.unit_touched), (REAL, self.real_touched), (LEVEL, self.level_touched)
        ):  # fmt: skip
            if left[kind].any():
                points.add(box.c[left[kind]], box.c[left[kind]], box.h[left[kind]])
        for kind in self.shifts:
            if left[kind].any():
                self._undecided[kind].append(box.part(left[kind]))
        if left[WINDING].any():
            self.turn = None

    def _nearest(self, kind: int) -> float:
        """Return the largest distance that undecided boxes prove, the smallest seen at most."""
        seen = self._least[kind][0] * (1 - TOLERANCE)
        if not self._undecided[kind]:
            return seen
        box = Enclosure.joined(self._undecided[kind])
        shift, order = self.shifts[kind], self.loop.order_at_zero
        low, high = 0.0, min(seen, WIDEST)
        if beyond(shift, box, high, order).all():
            return high
        for _ in range(_BISECTED):
            t = 0.5 * (low + high)
            low, high = (t, high) if beyond(shift, box, t, order).all() else (low, t)
        return low


def _parted(a: Array, b: Array, asked: BoolArray) -> tuple[Array, Array, BoolArray]:
    """Return intervals in equal parts: the more the fewer they are, for a level costs alike."""
    parts = next((count for most, count in _PARTS if len(a) <= most), 2)
    inner = a + np.arange(1, parts)[:, None] / parts * (b - a)
    points = np.vstack([a, inner, b])
    return points[:-1].ravel(), points[1:].ravel(), np.tile(asked, parts)
