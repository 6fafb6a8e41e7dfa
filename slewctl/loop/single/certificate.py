"""Margins with their proof: what the intervals of the whole axis say of a loop."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.axis_ends import (
    WIDEST,
    Gap,
    Tail,
    UndecidedError,
    gaps_on_axis,
    of_size_one,
    origin,
    tail,
)
from slewctl.loop.single.factored_loop import Enclosure, FactoredLoop
from slewctl.loop.single.findings import Least
from slewctl.loop.single.interval_ends import LEVEL_OF_S
from slewctl.loop.single.margin_report import Report
from slewctl.loop.single.margin_results import Crossing, Margins, doubts_of
from slewctl.loop.single.mode_names import Modes
from slewctl.loop.single.perturbation import Changed, Kind
from slewctl.loop.single.search import COMPLEMENTARY, DISK, MODULUS, REAL, UNIT, Search
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.numerics.linear_system import LinearSystem

# What is known to this needs no long numbers.
NARROW = 1e-9
# Of a few operations at the end, relative.
_ULPS = 8 * float(np.finfo(float).eps)
# Boxes that were left undecided are looked at in so many parts, if there are no more than this.
_PARTS, _FEW = 16, 1000


@dataclass(frozen=True, eq=False)
class Certificate:
    """A loop's axis, searched.

    Attributes
    ----------
    loop : FactoredLoop
    start : Gap or None
    end : Tail
    search : Search
    """

    loop: FactoredLoop
    start: Gap | None
    end: Tail
    search: Search

    @property
    def unstable(self) -> int | None:
        """Unstable closed-loop poles, hidden ones included; None where it is undecided.

        By the argument principle: as many as open-loop ones, less the turns of 1 + L about
        zero from v = 0 to infinity, of which each half is one pole.
        """
        if self.search.turn is None:
            return None
        turns = self.search.turn / math.pi
        if abs(turns - round(turns)) > 1e-3:
            return None
        return self.search.unstable_open - round(turns)


class UnprovedStabilityError(UndecidedError):
    """A closed-loop pole is so near to the axis that only computed poles say on which side."""

    def __init__(self, found: Certificate) -> None:
        super().__init__("a closed-loop pole is too near to the axis to prove its side of it")
        self.found = found


def certify(loop: FactoredLoop, skew: float = 0.0, most_gain: float = WIDEST) -> Certificate:
    """Search the axis of a loop; see `Search`.

    Raises
    ------
    UndecidedError
        If its ends, or poles on it, cannot be dealt with.
    UnstableLoopError
        If poles on the limit are hidden, or dead time destabilises it whatever the gain.
    """
    if not np.isfinite(loop.poles).all():
        raise UndecidedError("several poles lie at z = -1")
    if loop.plant.hidden or loop.controller.hidden:
        where = "z = 1 or z = -1" if loop.sample_time else "s = 0"
        raise UnstableLoopError(
            f"the closed loop is not stable: of several poles at {where} one signal moves one "
            "chain alone, and the others are hidden",
            where="margins",
            remedy="take out what is there twice",
        )
    if loop.unlinked:
        where = "z = 1" if loop.sample_time else "s = 0"
        raise UndecidedError(
            f"several poles at {where} are one chain by rounding alone, if at all: where they are "
            "none, all but one are hidden"
        )
    if loop.delay and abs(loop.tail(math.inf)[0]) >= 1:
        raise UnstableLoopError(
            "|L| is not below one at infinite frequency: with dead time the closed loop has "
            "infinitely many unstable poles",
            where="delay",
            remedy="let the controller or the plant roll off, as every real one does",
        )
    start, gaps, end = origin(loop), gaps_on_axis(loop), tail(loop)
    return Certificate(loop, start, end, Search(loop, start, gaps, end, (skew - 1) / 2, most_gain))


def certified_margins(
    loop: FactoredLoop,
    light: LinearSystem,
    skew: float,
    modes: Modes,
    within: float = NARROW,
    most_gain: float = WIDEST,
) -> Margins:
    """Return the margins of a loop that is stable, each with what is proved of it.

    Parameters
    ----------
    loop : FactoredLoop
    light : LinearSystem
        The same as one system, without its dead time; from it perturbations are made.
    skew, modes, within, most_gain
        See `classical_margins`.

    Raises
    ------
    UndecidedError
        If the stability of the loop cannot be proved, or |L| = 1 is undecided over a band.
    """
    try:
        found = _certified(loop, light, skew, modes, most_gain)
    except UndecidedError:
        if not (longer := loop.longer):
            raise
        return _certified(longer, light, skew, modes, most_gain)
    narrow = all(_narrow(crossing, within) for crossing in found.each.values())
    if narrow or not (longer := loop.longer):
        return found
    with suppress(UndecidedError):
        found = _certified(longer, light, skew, modes, most_gain)
    return found


def _certified(
    loop: FactoredLoop, light: LinearSystem, skew: float, modes: Modes, most_gain: float
) -> Margins:
    found = certify(loop, skew, most_gain)
    if found.unstable is None:
        raise UnprovedStabilityError(found)
    if found.unstable:
        late = f" with a dead time of {loop.delay:g} s" if loop.delay else ""
        poles = "pole" if found.unstable == 1 else "poles"
        raise UnstableLoopError(
            f"the closed loop{late} is not stable: it has {found.unstable} unstable {poles}",
            where="margins",
            remedy="change the design; without the dead time the loop's poles say where it fails"
            if late
            else "change the design; the loop's poles say where it fails",
        )
    return margins_of(found, light, skew, modes)


def margins_of(
    found: Certificate,
    light: LinearSystem,
    skew: float,
    modes: Modes,
    doubts: tuple[str, ...] = (),
) -> Margins:
    """Return the margins of a stable loop whose axis was searched."""
    loop, search, end = found.loop, found.search, found.end
    report = Report(
        lambda omega: _undelayed(loop, omega),
        float(light.D[0, 0]),
        end.limit,
        loop.sample_time,
        not len(loop.poles),
        modes,
        None if loop.delay else Changed(light),
    )
    seen = _seen(loop, search)
    limits, (rise, fall) = _gain_limits(found, *seen[REAL])
    turns, omega, (least_turn, least_delay) = _turns(found, *seen[UNIT])
    first = found.start.end if found.start else 0.0
    above = not len(turns) and abs(loop.on_axis(np.array([first]))[0]) > 1
    phase = report.phase(turns, omega, bool(above), _below(math.degrees(least_turn)))
    delay = report.delay(turns, omega, bool(above), phase.at_least, least_delay)
    if search.of_size_one:
        phase, delay = report.all_pass()
    crossings = {
        "gain_db": report.gain(limits, "rise", _below(20 * math.log10(rise))),
        "gain_reduction_db": report.gain(
            limits, "fall", _below(-20 * math.log10(fall)) if fall else math.inf
        ),
        "phase_deg": phase,
        "delay_s": delay,
        "modulus": _nearest(report, loop, "modulus", search.least(MODULUS), 1.0),
        "disk": _nearest(report, loop, "disk", search.least(DISK), skew),
        "complementary": _nearest(report, loop, "disk", search.least(COMPLEMENTARY), -1.0),
    }
    crossings = report.named(crossings)
    doubts += doubts_of({name: crossings[name] for name in crossings if name != "complementary"})
    hertz = tuple(float(w) / (2 * math.pi) for w in omega)
    return Margins(
        **crossings,
        gain_crossings_hz=hertz,
        confirmed=not doubts,
        skew=float(skew),
        doubts=doubts,
        intervals=search.intervals,
        bandwidth_hz=_bandwidth(found) / (2 * math.pi),
        crossings=report.all_crossings(limits, turns, omega),
    )


def _below(value: float) -> float:
    """Return a little less: what rounding may have made of a change of units."""
    return max(value * (1 - _ULPS), 0.0)


def _narrow(crossing: Crossing, within: float) -> bool:
    """Whether a margin is known as well as is wanted."""
    if crossing.at_least is None or math.isinf(crossing.value):
        return not crossing.wide
    return crossing.at_least >= crossing.value * (1 - within) - within


def _undelayed(loop: FactoredLoop, omega: Array) -> ComplexArray:
    """Return L without its dead time, as sums over modes have it."""
    v = loop.axis(omega)
    return np.asarray(loop.on_axis(v) * np.exp(1j * v * loop.delay))


def _bandwidth(found: Certificate) -> float:
    """Return ω where |S| first rises through 1/√2; see `Margins`."""
    loop, search = found.loop, found.search
    if not found.start and abs(1 + loop.on_axis(np.zeros(1))[0]) <= LEVEL_OF_S:
        return 0.0
    places = np.concatenate([search.level.arrays[0], search.level_touched.arrays[0]])
    return float(loop.omega(places).min(initial=math.inf))


def _nearest(report: Report, loop: FactoredLoop, kind: Kind, least: Least, skew: float) -> Crossing:
    return report.nearest(
        kind, least.value, float(loop.omega(np.array(least.v))), skew, least.proved
    )


def _gain_limits(
    found: Certificate, passed: Balls, touched: Balls
) -> tuple[list[tuple[float, float]], tuple[float, float]]:
    """Return all gain limits that were found, and between which two factors there is none.

    Parameters
    ----------
    found : Certificate
    passed, touched : Balls
        Where L is real, and where it may be.
    """
    loop, search, end = found.loop, found.search, found.end
    rise, fall = search.most_gain, max(1 / WIDEST, search.floor)
    limits: list[tuple[float, float]] = []
    if not len(loop.poles):
        limits = [(-1 / end.limit, math.inf)] if end.limit < 0 else []
        factors = [factor for factor, _ in limits]
        return limits, (
            min([WIDEST, *(f for f in factors if f >= 1)]),
            max([0.0, *(f for f in factors if f < 1)]),
        )
    for place, value, size in zip(passed.v.tolist(), passed.values, passed.sizes, strict=True):
        if value.real < 0:
            factor = -1 / value.real
            if 1 / WIDEST <= factor <= WIDEST:
                limits.append((factor, float(loop.omega(np.array(place)))))
            rise, fall = _narrowed(rise, fall, *_factors(abs(value), size))
    for place, value, size in zip(touched.v.tolist(), touched.values, touched.sizes, strict=True):
        if place > 0 and value.real - size < 0:  # L is real at v = 0 anyway
            rise, fall = _narrowed(rise, fall, *_factors(abs(value), size))
    if not loop.order_at_zero:
        origin_value = float(loop.on_axis(np.zeros(1))[0].real)
        if origin_value < 0:
            limits.append((-1 / origin_value, 0.0))
            rise, fall = _narrowed(rise, fall, -1 / origin_value, -1 / origin_value)
    if end.least:
        return sorted(set(limits)), (rise, fall)
    last = math.pi / loop.sample_time if loop.sample_time else math.inf
    if loop.delay and end.limit:
        limits.append((1 / abs(end.limit), math.inf))
        rise = min(rise, 1 / (abs(end.limit) + end.away))
    elif end.limit < 0 and not (loop.sample_time and abs(end.limit) <= end.away):
        limits.append((-1 / end.limit, last))
    if end.away > end.limit:
        beyond = end.away - end.limit
        rise, fall = _narrowed(
            rise, fall, 1 / beyond, -1 / end.limit if end.limit < 0 else math.inf
        )
    return sorted(set(limits)), (rise, fall)


def _factors(value: float, size: float) -> tuple[float, float]:
    """Return between which factors the limit lies where |L| is a value within ± size."""
    most = 1 / (value - size) * (1 + _ULPS) if value > size else math.inf
    return 1 / (value + size) * (1 - _ULPS), most


def _narrowed(rise: float, fall: float, low: float, high: float) -> tuple[float, float]:
    """Return the factors between which there is no limit, given that one may lie in [low, high]."""
    if high >= 1:
        rise = min(rise, max(low, 1.0))
    if low < 1:
        fall = max(fall, min(high, 1.0))
    return rise, fall


@dataclass(frozen=True, eq=False)
class Balls:
    """L at points, and how far it may be from that within their widths."""

    v: Array
    width: Array
    values: list[complex]
    sizes: list[float]


def _seen(loop: FactoredLoop, search: Search) -> dict[int, tuple[Balls, Balls]]:
    """Return L where a question was answered by a crossing, and where it may be."""
    count = len(search.unit.left[0])
    places = [_cut(*points.arrays) for points in (search.unit_touched, search.real_touched)]
    first = len(places[0][0])
    middles, widths = (np.concatenate(each) for each in zip(*places, strict=True))
    touched = loop.enclosed(middles, widths) if len(middles) else search.crossings.part(slice(0))
    return {
        UNIT: (_balls(search.crossings, slice(count)), _balls(touched, slice(first))),
        REAL: (_balls(search.crossings, slice(count, None)), _balls(touched, slice(first, None))),
    }


def _balls(box: Enclosure, own: slice) -> Balls:
    sizes = np.where(np.isnan(box.reach), np.inf, box.reach)[own]
    return Balls(box.c[own], box.h[own], box.value[own].tolist(), sizes.tolist())


def _cut(v: Array, width: Array) -> tuple[Array, Array]:
    """Return boxes in parts, in each of which L changes little even beside the origin's pole."""
    count = _PARTS if len(v) <= _FEW else 1
    offsets = (np.arange(count) + 0.5) * 2 / count - 1
    parts = v[:, None] + width[:, None] * offsets
    return parts.ravel(), np.repeat(width / count * (1 + 1e-9), count)


def _turns(
    found: Certificate, passed: Balls, touched: Balls
) -> tuple[Array, Array, tuple[float, float]]:
    """Return turns in rad and ω at the gain crossings, and the least of both that is proved."""
    loop = found.loop
    turns = -np.angle(-np.array(passed.values, dtype=complex))
    omega = loop.omega(passed.v)
    least_turn = least_delay = math.inf
    ends = [*(omega * (1 + 4e-16)), *loop.omega(touched.v + touched.width)]
    values, sizes = [*passed.values, *touched.values], [*passed.sizes, *touched.sizes]
    for value, size, last in zip(values, sizes, ends, strict=True):
        turn = -float(np.angle(-value))
        off = math.asin(min(size / abs(value), 1.0)) + _ULPS if value else math.pi
        least_turn = min(least_turn, max(abs(turn) - off, 0.0))
        lag = (-turn) % (2 * math.pi)
        safe = lag - off if off <= lag <= 2 * math.pi - off else 0.0
        least_delay = min(least_delay, safe / last if last else math.inf)
    if of_size_one(found.end.limit):
        least_turn, least_delay = min(least_turn, math.pi - 2 * found.end.away), 0.0
    return turns, omega, (least_turn, least_delay)
