"""Where L has no bound on the axis: poles on it, and its two ends.

Around a pole on the axis, or within rounding of it, the contour that counts unstable poles
turns out to the right.  On that small circle f = 1 + L = (r/(s − p))(1 + η) with |η| < 1, so
that f has no zero inside, the pole itself is not counted, and arg f changes by −π but for
what the ends of the arc say.  The same holds at the origin with sᵏ for s − p, and beyond the
fastest pole, where L is near to its limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.loop.single.factor import Factor
from slewctl.loop.single.factored_loop import FactoredLoop

# Inside a gap |L| is larger than this, so that no margin is reached in it.
_LARGE = 1e4
# At the origin, and in the tail, |L| is beyond any change of gain that is asked about.
WIDEST = 1e8
_TIMES = 60
# A pole at z = −1 that feedback moves by less than the reciprocal of this is told as hidden.
_FARTHEST = 1e16
# L is left where it is this near to a limit of size one: |L| = 1 may be passed beyond, at half a
# turn from −1 but for this; as many intervals as its reciprocal are needed to come nearer.
_NEAR_ONE = 1e-3
# How much farther out a tail is looked for at a time at most.
_LEAP = 1e4
# Marks about a pole: each this much farther from it than the one before.
_GRADED, _GRADES = 4.0, 16


@dataclass(frozen=True)
class Gap:
    """An interval of the axis that is not searched, and what is known of it.

    Attributes
    ----------
    start, end : float
    turn : float
        Change of arg(1 + L) from one end to the other on a contour right of it.
    least : float
        |L| is larger.
    unstable : int
        How many of its poles have a positive real part in double precision: they do not count
        as unstable, whichever side they are on, since the contour passes right of them.
    """

    start: float
    end: float
    turn: float
    least: float
    unstable: int


@dataclass(frozen=True)
class Tail:
    """The axis beyond v = `start`: |L − limit| ≤ away; with dead time L turns on a circle.

    Attributes
    ----------
    start, limit, away, turn : float
    least : float
        Where the limit is infinite, |L| is larger.
    """

    start: float
    limit: float
    away: float
    turn: float
    least: float = 0.0


class UndecidedError(Exception):
    """Something could not be proved: why, in words."""


def origin(loop: FactoredLoop) -> Gap | None:
    """Return the gap around a pole at s = 0; None where there is none."""
    k = loop.order_at_zero
    if not k:
        return None
    sizes = np.abs(loop.poles)
    sizes = sizes[sizes > 0]
    radius = 1e-3 * float(sizes.min()) if len(sizes) else 1.0
    found: Gap | None = None
    for _ in range(_TIMES):
        value, away = loop.at_origin(radius)
        at = np.array([1j * radius])
        eta = (away + radius**k) / abs(value) if value else np.inf
        if eta < 0.3:
            eta += 2 * float(loop.errors(at)[0]) * radius**k / abs(value)
        least = abs(value) * (1 - eta) / radius**k
        if eta < 0.3 and least > _LARGE:
            around = complex((1 + loop.at(at)[0]) * 1j**k * np.sign(value))
            found = Gap(0.0, radius, float(np.angle(around)) - k * np.pi / 2, least, 0)
        elif found:
            break  # nearer to the pole, its own rounding is all there is
        if found and least > WIDEST:
            break
        # At once to where |L| is a little more than what is wanted, sᵏ L being as it is.
        enough = (0.5 * abs(value) / WIDEST) ** (1 / k)
        radius = min(radius / 10, enough) if enough and not found else radius / 10
    if found:
        return found
    raise UndecidedError(
        "the pole at the origin is hidden, or too nearly so: feedback does not reach it"
    )


def gaps_on_axis(loop: FactoredLoop) -> list[Gap]:
    """Return a gap around every pole that lies on the axis, or may do so."""
    found = []
    for own, other in (
        (loop.plant, loop.controller),
        (loop.controller, loop.plant),
    ):
        moved = np.abs(own.all.b) * own.form.spread * own.form.weight
        for place, k in enumerate(own.alone.tolist()):
            pole = own.all.sigma[k]
            if pole.imag > 0 and abs(pole.real) <= 8 * moved[k] + 1e-300:
                found.append(_around(loop, own, other, place, complex(pole), float(moved[k])))
    return found


def _around(
    loop: FactoredLoop, own: Factor, other: Factor, place: int, pole: complex, moved: float
) -> Gap:
    at = np.array([1j * pole.imag])
    distances = np.abs(loop.poles - at[0])
    near = float(np.partition(distances, 1)[1]) if len(distances) > 1 else abs(pole)
    residue = complex(
        (own.residue[place] * other.values(at)[0]).sum() * np.exp(-at[0] * loop.delay)
    )
    radius, found = 1e-2 * near, None
    while radius > max(1e2 * moved, 1e-15 * abs(pole)):
        (X, _), (Y, dY) = own.sizes(at, radius, leave=place), other.sizes(at, radius)
        rest = float((X * Y).sum() + (np.abs(own.residue[place]) * dY).sum())
        rest += abs(residue) * loop.delay
        edge = np.array([1j * (pole.imag - radius), 1j * (pole.imag + radius)])
        rest += 2 * float(loop.errors(edge).max())
        # The pole itself may be off by `moved` and its real part.
        eta = (1 + rest) * radius / abs(residue) if residue else np.inf
        eta += (moved + abs(pole.real)) / radius
        least = abs(residue) / radius * (1 - eta)
        if eta < 0.3 and least > _LARGE:
            start, end = 1 + loop.at(edge)
            turn = float(np.angle(-end / start)) - np.pi
            found = Gap(pole.imag - radius, pole.imag + radius, turn, least, 2 * int(pole.real > 0))
        if found and (eta >= 0.3 or least > WIDEST):
            break  # nearer to the pole, its own rounding is all there is
        radius /= 10
    if found:
        return found
    raise UndecidedError(
        f"a pole on the stability limit at {loop.omega(np.array(pole.imag)) / (2 * np.pi):.6g} Hz "
        "is not moved by feedback"
    )


def tail(loop: FactoredLoop) -> Tail:
    """Return where the axis may be left, L being near to its limit from there on."""
    sizes = np.abs(loop.poles)
    far, before = 10 * float(sizes.max(initial=0.0)) or 1.0, np.inf
    if loop.order_at_end:
        return _pole_at_end(loop, far)
    for _ in range(_TIMES):
        limit, away = loop.tail(far)
        room = 1e-11 * abs(1 + limit) if limit else 1 / WIDEST
        if limit > 0 and of_size_one(limit):  # nearer to it |L| = 1 is hidden by rounding
            room = _NEAR_ONE
        if limit and loop.delay:  # turned on and on: a circle is all there is to know
            room = 1e-3 * (1 - abs(limit))
        # Where rounding alone is left, going farther changes nothing.
        settled = away > 0.5 * before and away < 0.1 * abs(1 + limit)
        if away <= room or settled:
            if loop.delay and abs(limit) + away >= 1:
                break
            at_start = 1 + complex(loop.at(np.array([1j * far]))[0])
            end = 1.0 if loop.delay else 1 + limit
            return Tail(far, limit, away, float(np.angle(end / at_start)))
        # As far as two poles more than zeros make it.
        far, before = far * max(10.0, min((away / room) ** 0.5, _LEAP) if room > 0 else 0.0), away
    raise UndecidedError("L is too near to minus one at infinite frequency")


def of_size_one(limit: float) -> bool:
    """Whether |L| tends to one, so that whether it passes one on the way cannot be seen."""
    return abs(abs(limit) - 1) < 1e-9


def _pole_at_end(loop: FactoredLoop, far: float) -> Tail:
    """Return the tail of a loop with a pole at z = −1, by which the contour passes inside."""
    k = loop.order_at_end
    found: Tail | None = None
    for _ in range(_TIMES):
        value, away = loop.tail(far)
        eta = (away + far**-k) / abs(value) if value else np.inf
        least = abs(value) * far**k * (1 - eta)
        if eta < 0.3 and least > _LARGE:
            around = complex((1 + loop.at(np.array([1j * far]))[0]) * (-1j) ** k * np.sign(value))
            turn = -float(np.angle(around)) - k * np.pi / 2
            found = Tail(far, np.sign(value) * np.inf, np.inf, turn, least)
        elif found:
            break
        if (found and least > WIDEST) or far > _FARTHEST:
            break
        far *= 10
    if found:
        return found
    raise UndecidedError(
        "the pole at z = -1 is hidden, or too nearly so: feedback does not reach it"
    )


def first_intervals(
    loop: FactoredLoop, start: Gap | None, gaps: list[Gap], end: Tail
) -> tuple[Array, Array]:
    """Return first intervals: between the gaps, cut at the frequencies of all poles."""
    low, high = start.end if start else 0.0, end.start
    sizes = np.abs(loop.poles)
    marks = sizes[(sizes > low) & (sizes < high)]
    first = low or float(min([high, *sizes[sizes > 0]])) * 1e-3
    decades = np.geomspace(first, high, 2 + int(2 * np.log10(high / first)))
    marks = np.unique(np.concatenate([[low, high], marks, decades[1:-1], _about(loop)]))
    marks = marks[(marks >= low) & (marks <= high)]
    apart = np.concatenate([[True], np.diff(marks) > 1e-9 * marks[1:]])
    marks = marks[apart]
    marks[-1] = high
    for gap in gaps:
        marks = marks[(marks <= gap.start) | (marks >= gap.end)]
        marks = np.unique(np.concatenate([marks, [gap.start, gap.end]]))
    a, b = marks[:-1], marks[1:]
    inside = np.zeros(len(a), dtype=bool)
    for gap in gaps:
        inside |= (a >= gap.start) & (b <= gap.end)
    return a[~inside], b[~inside]


def _about(loop: FactoredLoop) -> Array:
    """Return marks about lightly damped poles, nearer to each other the nearer they are to it.

    The halving of one interval ends there too, but one step after the other.
    """
    poles = loop.poles[(loop.poles.imag > 0) & (np.abs(loop.poles.real) < 0.1 * loop.poles.imag)]
    width = np.maximum(np.abs(poles.real), 1e-9 * poles.imag)
    marks = [np.zeros(0)]
    for k in range(_GRADES):
        step = 0.5 * _GRADED**k * width
        inside = step < 0.2 * poles.imag
        marks += [(poles.imag + sign * step)[inside] for sign in (-1, 1)]
    return np.concatenate(marks)
