"""A motion as modes and polynomials: its value at any time, and bounds over intervals.

Between two instants at which something changes, a linear system driven by a polynomial in
time moves as a polynomial and decaying oscillations.  Fast modes follow the polynomial with
one of the same degree and their oscillation beside it; modes that have hardly begun to move
by the end are a power series, since with them the two would be large and of opposite sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.linalg import solve_triangular

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.errors import AccuracyError
from slewctl.loop.motion.block_motion import Swinging
from slewctl.loop.motion.decoupled import Decoupled

Values = TypeVar("Values", Array, ComplexArray)
# What a state matrix, or its inverse, does to arrays of states.
Linear = Callable[[Any], Any]
# A power series of modes that turn by less than one radian: 1/20! is less than 1e-18.
_TERMS = 20
# Up to this turn in half an interval a mode is followed by its value and slope.
_FOLLOWED = 1.0
# A block of so many modes doubles the work.
_LIGHT = 4
# Each piece is bounded in so many parts.
_SLICES = 8


class Seen(NamedTuple):
    """Signals at the middle of intervals, and what bounds them over the whole of each.

    Attributes
    ----------
    value : ndarray
        In the middle.
    followed : ndarray
        The same without modes that turn too fast to be followed over the interval.
    slope : ndarray
        Of what is followed, times half the width.
    curvature : ndarray
        Largest second derivative of it, times the square of half the width.
    far : ndarray
        Largest value of what is not followed.
    """

    value: Array
    followed: Array
    slope: Array
    curvature: Array
    far: Array

    @staticmethod
    def joined(parts: Sequence[Seen]) -> Seen:
        """Return the intervals of all parts."""
        return Seen(*(np.concatenate(same) for same in zip(*parts, strict=True)))

    @property
    def monotone(self) -> BoolArray:
        """Whether the signal rises, or falls, over the whole interval."""
        return (self.far == 0) & (np.abs(self.slope) > self.curvature)

    @property
    def spread(self) -> Array:
        """How far the signal may lie from `followed`."""
        return np.asarray(np.abs(self.slope) + self.curvature / 2 + self.far)


@dataclass(frozen=True, eq=False)
class Motion:
    """Signals over pieces of time, of equal length and with the same modes.

    Attributes
    ----------
    starts : ndarray, shape (p,)
        Times at which the pieces start, in s.
    length : float
        In s; infinite for what goes on for ever.
    polynomials : ndarray, shape (p, signals, terms)
        Coefficients of powers of the fraction of the piece that has passed.
    rates : ndarray, shape (K,)
    amplitudes : ndarray, shape (p, K)
        Each e^(rate·t) at the start of the piece.
    rows : ndarray, shape (signals, K)
    blocks : tuple of Swinging
    """

    starts: Array
    length: float
    polynomials: Array
    rates: ComplexArray
    amplitudes: ComplexArray
    rows: ComplexArray
    blocks: tuple[Swinging, ...]

    @property
    def work(self) -> float:
        """How much longer an interval takes than with modes that stand alone."""
        return 1 + sum((len(block.T) / _LIGHT) ** 2 for block in self.blocks)

    def combined(self, shares: Array, starts: Array) -> Motion:
        """Return pieces (p,) that are sums of these, each times its share, shape (p, pieces)."""
        count, shape = len(shares), self.polynomials.shape[1:]
        return Motion(
            starts,
            self.length,
            (shares @ self.polynomials.reshape(len(self.starts), -1)).reshape(count, *shape),
            self.rates,
            shares @ self.amplitudes,
            self.rows,
            tuple(block.combined(shares) for block in self.blocks),
        )

    def at(self, piece: IntArray, tau: Array) -> Array:
        """Return all signals at times `tau` after the starts of pieces, (signals, times)."""
        swing = self.amplitudes[piece] * np.exp(self.rates * tau[:, None])
        found = (swing @ self.rows.T).real
        for block in self.blocks:
            found = found + (block.at(piece, tau) @ block.rows.T).real
        powers = np.vander(tau / self.length, self.polynomials.shape[2], increasing=True)
        return (found + (self.polynomials[piece] @ powers[..., None])[..., 0]).T

    def seen(self, signal: IntArray, piece: IntArray, tau: Array, half: Array) -> Seen:
        """Return signals in the middle, tau, and bounds on tau − half … tau + half.

        Parameters
        ----------
        signal, piece, tau, half : ndarray, shape (m,)
            Of each interval: which signal, of which piece, and where in it.
        """
        amplitude = self.rows[signal] * self.amplitudes[piece]
        swing = amplitude * _exponentials(self.rates, tau)
        turn = np.abs(self.rates) * half[:, None]
        near = turn <= _FOLLOWED
        largest = np.abs(amplitude) * self._grown(tau, half)
        kept = np.where(near, swing, 0)
        value, followed = swing.real.sum(axis=1), kept.real.sum(axis=1)
        slope = (kept @ self.rates).real * half
        curvature = (largest * np.where(near, turn, 0) ** 2).sum(axis=1)
        far = np.where(near, 0, largest).sum(axis=1)
        for block in self.blocks:
            part = _block_seen(block, signal, piece, tau, half)
            value, followed = value + part.value, followed + part.followed
            slope, curvature = slope + part.slope, curvature + part.curvature
            far = far + part.far
        p, p1, p2 = self._polynomial(signal, piece, tau, half)
        return Seen(value + p, followed + p, slope + p1, curvature + p2, far)

    def _grown(self, tau: Array, half: Array) -> Array:
        """Return the largest |e^(rate·t)| for t from tau − half to tau + half."""
        decay = self.rates.real
        grown = _exponentials(decay, tau - half)
        if np.any(decay > 0):
            grown = grown * np.exp(2 * np.maximum(decay, 0) * half[:, None])
        return grown

    def _polynomial(
        self, signal: IntArray, piece: IntArray, tau: Array, half: Array
    ) -> tuple[Array, Array, Array]:
        """Return value, slope·half and a bound of curvature·half² of the polynomial."""
        c = self.polynomials[piece, signal]
        if c.shape[1] == 1:
            return c[:, 0], np.zeros(len(c)), np.zeros(len(c))
        s, g = tau / self.length, half / self.length
        j = np.arange(c.shape[1])
        powers = np.vander(s, len(j), increasing=True)
        slope = ((c * j)[:, 1:] * powers[:, :-1]).sum(axis=1)
        bend = ((c * j * (j - 1))[:, 2:] * powers[:, :-2]).sum(axis=1)
        # The third derivative by its terms: it counts for less and less.
        third = np.abs(c * j * (j - 1) * (j - 2))[:, 3:] * np.vander(
            s + g, len(j) - 3, increasing=True
        )
        return (
            (c * powers).sum(axis=1),
            slope * g,
            (np.abs(bend) + g * third.sum(axis=1)) * g**2,
        )

    def bounds(self) -> Array:
        """Bound each signal over each piece of finite length, shape (p, signals)."""
        shape = (len(self.starts), len(self.rows), _SLICES)
        piece, signal, part = (index.ravel() for index in np.indices(shape))
        half = np.full(len(part), self.length / _SLICES / 2)
        seen = self.seen(signal, piece, (2 * part + 1) * half, half)
        return np.asarray((np.abs(seen.followed) + seen.spread).reshape(shape).max(axis=2))

    def sizes(self) -> Array:
        """Return the sum of the sizes of all terms of each signal in each piece."""
        found = np.abs(self.polynomials).sum(axis=2)
        growth = np.exp(np.maximum(self.rates.real, 0) * self.length)
        found = found + (np.abs(self.amplitudes) * growth) @ np.abs(self.rows).T
        for block in self.blocks:
            rise = block.growth(np.array([self.length]))
            sizes = np.linalg.norm(block.states, axis=1)[:, None]
            found = found + rise * sizes * np.linalg.norm(block.rows, axis=1)
        return found

    def until(self, signal: int, margin: float) -> float:
        """Return a time after which an endless signal is within `margin` of its last value."""
        sizes = np.abs(self.rows[signal] * self.amplitudes[0]).tolist()
        decays = self.rates.real.tolist()
        parts = [(size, decay, 0.0, 1) for size, decay in zip(sizes, decays, strict=True)]
        for block in self.blocks:
            size = np.linalg.norm(block.rows[signal]) * np.linalg.norm(block.states[0])
            parts.append((float(size), block.decay, block.coupling, len(block.T)))
        return decayed(parts, margin)


def decayed(parts: Sequence[tuple[float, float, float, int]], margin: float) -> float:
    """Return a time after which Σ size·e^(decay·t)·Σ_j (coupling·t)^j/j! stays below `margin`.

    Parameters
    ----------
    parts : sequence of (size, decay, coupling, order)
        j is less than the order.
    margin : float
        Positive.

    Raises
    ------
    AccuracyError
        If something does not decay.
    """
    latest, share = 0.0, math.log(max(margin, np.finfo(float).tiny)) - math.log(len(parts) or 1)
    for size, decay, coupling, order in parts:
        if size == 0:
            continue
        if not decay < 0:
            raise AccuracyError(
                "a motion of the loop does not decay, to working precision",
                where="slew",
                remedy="damp it more",
            )
        # From the first of these times on every term falls.
        above = math.log(size) - share
        t = max((order - 1) / -decay, above / -decay)
        while order > 1:
            rise = sum((coupling * t) ** j / math.factorial(j) for j in range(order))
            if above + decay * t + math.log(rise) <= 0:
                break
            t *= 1.25
        latest = max(latest, t)
    return latest


def _exponentials(rates: Values, t: Array) -> Values:
    """Return e^(rate·t), shape (times, rates), of times many of which are the same."""
    different, which = np.unique(t, return_inverse=True)
    return np.exp(rates * different[:, None])[which]


def _block_seen(
    block: Swinging, signal: IntArray, piece: IntArray, tau: Array, half: Array
) -> Seen:
    state, rows = block.at(piece, tau), block.rows[signal]
    near = block.rate * half <= _FOLLOWED
    rate, size = state @ block.T.T, np.linalg.norm(rows, axis=1)
    value = (rows * state).sum(axis=1).real
    slope = (rows * rate).sum(axis=1).real * half
    # What the second derivative is in the middle grows by no more than this to either side.
    bend = np.linalg.norm(rate @ block.T.T, axis=1) * half**2
    curvature = size * bend * np.exp(block.rate * np.where(near, half, 0))
    far, wide = np.zeros(len(half)), np.flatnonzero(~near)
    if len(wide):
        first = np.linalg.norm(block.at(piece[wide], (tau - half)[wide]), axis=1)
        far[wide] = size[wide] * first * block.growth(2 * half[wide])
    return Seen(
        value,
        np.where(near, value, 0),
        np.where(near, slope, 0),
        np.where(near, curvature, 0),
        far,
    )


def driven(
    modes: Decoupled,
    outputs: Array,
    states: Array,
    drive: Array,
    direct: Array,
    starts: Array,
    length: float,
) -> Motion:
    """Return the motion of ẋ = A x + drive, seen as outputs·x + direct.

    Parameters
    ----------
    modes : Decoupled
        Of A.
    outputs : ndarray, shape (signals, n)
    states : ndarray, shape (p, n)
        At the start of each piece.
    drive, direct : ndarray, shapes (p, n, d), (p, signals, d)
        Coefficients of powers of the fraction of the piece that has passed; of the first
        alone if the length is infinite.
    starts : ndarray, shape (p,)
    length : float
    """
    rows = outputs @ modes.right
    given = direct.shape[2]
    polynomials = np.zeros((*direct.shape[:2], max(given, _TERMS)))
    polynomials[..., :given] = direct

    def entering(left: ComplexArray) -> tuple[ComplexArray, list[ComplexArray]]:
        return left @ states.T, [left @ drive[..., j].T for j in range(given)]

    def add(rows: ComplexArray, terms: list[ComplexArray]) -> None:
        for j, term in enumerate(terms):
            polynomials[..., j] += (rows @ term).real.T

    slow = np.abs(modes.rates) * length < 1
    rates, (start, forcing) = modes.rates[slow, None], entering(modes.left[slow])
    add(rows[:, slow], _series(lambda x: rates * x, start, forcing, length))
    fast, (start, forcing) = modes.rates[~slow, None], entering(modes.left[~slow])
    following = _following(lambda x: x / fast, forcing, length)
    add(rows[:, ~slow], following)
    blocks = []
    for block in modes.blocks:
        T, seen, (first, forced) = block.T, outputs @ block.right, entering(block.left)
        if np.abs(np.diag(T)).max() * length < 1:
            add(seen, _series(partial(np.matmul, T), first, forced, length))
            continue
        followed = _following(partial(solve_triangular, T), forced, length)
        add(seen, followed)
        blocks.append(Swinging(T, (first - followed[0]).T, seen))
    used = np.flatnonzero(np.any(polynomials != 0, axis=(0, 1)))
    terms = max(int(used[-1]) + 1 if len(used) else 1, given)
    return Motion(
        starts,
        length,
        polynomials[..., :terms],
        modes.rates[~slow],
        (start - following[0]).T,
        rows[:, ~slow],
        tuple(blocks),
    )


def _series(
    apply: Linear, start: ComplexArray, forcing: list[ComplexArray], length: float
) -> list[ComplexArray]:
    """Return the power series of ẋ = apply(x) + Σ forcing_j s^j, in s = t/length."""
    terms = [start]
    for j in range(_TERMS - 1):
        rate = apply(terms[-1])
        if j < len(forcing):
            rate = rate + forcing[j]
        terms.append(rate * (length / (j + 1)))
    return terms


def _following(solve: Linear, forcing: list[ComplexArray], length: float) -> list[ComplexArray]:
    """Return the polynomial x in s = t/length that solves ẋ = A x + Σ forcing_j s^j."""
    terms: list[ComplexArray] = []
    for j in reversed(range(len(forcing))):
        above = (j + 1) / length * terms[0] if terms else 0
        terms.insert(0, solve(above - forcing[j]))
    return terms
