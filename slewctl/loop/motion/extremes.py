"""The largest value of a signal over all times, and the last time that it leaves a band.

An interval of time is thrown away when its bound says that it cannot hold what is sought,
and cut into parts otherwise, so that nothing is missed between samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, Protocol

import numpy as np

from slewctl._types import Array, BoolArray, IntArray
from slewctl.errors import AccuracyError
from slewctl.loop.motion.modal_motion import Motion, Seen

# Relative: extremes and times are found to this.
_PRECISION = 1e-10
# An interval is cut into so many parts at least and at most; about so many are made at once.
_FEWEST, _MANIEST, _AT_ONCE = 4, 32, 64
# So many are looked at together, to spare memory, and for one slew.
_TOGETHER, _MOST = 4096, 2_000_000
# A motion and where a search first cuts its pieces, in s after their starts, shape (k, cuts)
# for k signals that are searched, or (1, cuts) for all of them; one whose cuts decrease is
# not searched.
Part = tuple[Motion, Array]


@dataclass(frozen=True)
class Sought:
    """What is measured of signals.

    Attributes
    ----------
    signal : ndarray of int, shape (k,)
    offset : ndarray, shape (k,)
        Subtracted from the signal.
    sense : ndarray, shape (k,)
        +1 or −1: the difference, or its negative; 0: its size.
    since : ndarray, shape (k,)
        The time from which it counts, in s.
    floor : ndarray, shape (k,)
        Differences this small are none.
    """

    signal: IntArray
    offset: Array
    sense: Array
    since: Array
    floor: Array

    def measure(self, which: IntArray, value: Array) -> Array:
        """Return what is measured of values of the signals `which`."""
        away, sense = value - self.offset[which], self.sense[which]
        return np.where(sense == 0, np.abs(away), sense * away)

    def at_rest(self, moved: SlewMotion) -> Array:
        """Return what the measures tend to."""
        return self.measure(np.arange(len(self.signal)), moved.final[self.signal])


class SlewMotion(Protocol):
    """The signals of a slew over all times.

    Attributes
    ----------
    final : ndarray, shape (signals,)
        What they tend to.
    turning : list of list of (Motion, ndarray)
        Stretches of the motion until the reference is at rest, in their order in time; each
        is made of one or more motions that take turns.
    """

    final: Array
    turning: list[list[Part]]

    def resting(
        self, signals: IntArray, margins: Callable[[], Array], *, backwards: bool = False
    ) -> Iterator[list[Part]]:
        """Yield the stretches that follow, up to where the signals have come to rest.

        Parameters
        ----------
        signals : ndarray, shape (k,)
        margins : callable
            How near to its last value each must stay; asked for again for each stretch.
        backwards : bool
            Whether the last stretch comes first.
        """

    def curves(self, end: float, points: int) -> tuple[Array, Array]:
        """Return times from 0 to `end` and the signals there, shape (signals, times)."""


class _Intervals(NamedTuple):
    """Intervals of the pieces of a motion, and the number of what is sought in them."""

    which: IntArray
    piece: IntArray
    left: Array
    width: Array

    def chosen(self, those: BoolArray | slice) -> _Intervals:
        return _Intervals(self.which[those], self.piece[those], self.left[those], self.width[those])

    def cut(self) -> _Intervals:
        """Return the parts of each interval."""
        count = min(max(_AT_ONCE // max(len(self.left), 1), _FEWEST), _MANIEST)
        part = self.width / count
        left = self.left[:, None] + part[:, None] * np.arange(count)
        return _Intervals(
            np.repeat(self.which, count),
            np.repeat(self.piece, count),
            left.ravel(),
            np.repeat(part, count),
        )

    def ends(self) -> _Intervals:
        """Return both ends of each interval, as intervals of no width."""
        left = np.concatenate([self.left, self.left + self.width])
        return _Intervals(np.tile(self.which, 2), np.tile(self.piece, 2), left, 0 * left)


def _begun(part: Part, since: Array) -> _Intervals:
    """Return the pieces of a motion as they are first cut, from `since` on."""
    motion, cuts = part
    cuts = np.broadcast_to(cuts, (len(since), cuts.shape[1]))[:, None]
    left = np.maximum(cuts[..., :-1], (since[:, None] - motion.starts)[..., None])
    width = cuts[..., 1:] - left
    which, piece, _ = used = np.nonzero(width >= 0)
    return _Intervals(which, piece, left[used], width[used])


class Search:
    """A search for extremes that counts its work."""

    def __init__(self) -> None:
        self._left = float(_MOST)

    def highest(self, moved: SlewMotion, sought: Sought) -> Array:
        """Return the suprema of the measures over all times."""
        last = sought.at_rest(moved)
        best = last.copy()

        def margins() -> Array:
            return best - last + self._slack(sought, best)

        for stretch in chain(moved.turning, moved.resting(sought.signal, margins)):
            for part in stretch:
                self._raise(best, part, sought)
        return best

    def last_outside(self, moved: SlewMotion, sought: Sought, level: float) -> float:
        """Return the last time at which a measure exceeds `level`; infinite if there is none."""
        last = sought.at_rest(moved)
        if last[0] > level:
            return np.inf
        room = np.maximum(level - last, sought.floor)
        after = moved.resting(sought.signal, lambda: room, backwards=True)
        for stretch in chain(after, reversed(moved.turning)):
            latest = max(self._last_in(part, sought, level) for part in stretch)
            if latest > -np.inf:
                return latest
        return 0.0

    @staticmethod
    def _slack(sought: Sought, best: Array) -> Array:
        return np.asarray(_PRECISION * np.abs(best) + sought.floor)

    def _raise(self, best: Array, part: Part, sought: Sought) -> None:
        """Raise what is the best until now to the suprema in a part of the motion."""
        motion, at = part[0], _begun(part, sought.since)
        while len(at.left):
            seen = self._seen(motion, at, sought)
            np.maximum.at(best, at.which, sought.measure(at.which, seen.value))
            bound = sought.measure(at.which, seen.followed) + seen.spread
            open_ = bound > (best + self._slack(sought, best))[at.which]
            # What rises or falls all along is largest at one of its ends.
            ends = at.chosen(open_ & seen.monotone).ends()
            if len(ends.left):
                at_ends = sought.measure(ends.which, self._seen(motion, ends, sought).value)
                np.maximum.at(best, ends.which, at_ends)
            at = at.chosen(open_ & ~seen.monotone).cut()

    def _last_in(self, part: Part, sought: Sought, level: float) -> float:
        motion, at, latest = part[0], _begun(part, sought.since), -np.inf
        while len(at.left):
            seen = self._seen(motion, at, sought)
            times = motion.starts[at.piece] + at.left
            outside = sought.measure(at.which, seen.value) > level
            latest = (times + at.width / 2).max(where=outside, initial=latest)
            end = times + at.width
            bound = sought.measure(at.which, seen.followed) + seen.spread
            open_ = (bound > level * (1 + _PRECISION)) & (end > latest)
            at = at.chosen(open_ & (at.width > _PRECISION * end)).cut()
        return float(latest)

    def _seen(self, motion: Motion, at: _Intervals, sought: Sought) -> Seen:
        self._left -= len(at.left) * motion.work
        if self._left < 0:
            raise AccuracyError(
                f"the extremes of the slew are not found in {int(_MOST / motion.work)} intervals "
                "of time",
                where="slew",
                remedy="the motion oscillates too often before it is at rest; damp it more"
                if motion.work < 2
                else "weights this far apart make a loop whose modes are not told apart; bring "
                "limits and noises closer together",
            )
        half, signal = at.width / 2, sought.signal[at.which]
        seen = []
        for k in range(0, len(half), _TOGETHER):
            part = slice(k, k + _TOGETHER)
            middle = at.left[part] + half[part]
            seen.append(motion.seen(signal[part], at.piece[part], middle, half[part]))
        return seen[0] if len(seen) == 1 else Seen.joined(seen)
