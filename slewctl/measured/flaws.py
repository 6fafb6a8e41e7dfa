"""What is wrong with a log: gaps, an irregular clock, clipping, an encoder's steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_positive

# What is larger is measured in no unit.
_LARGEST = 1e30
# Of a period: a step between time stamps that is longer has lost a sample.
_GAP = 1.5
# Scatter of the time stamps, of a period, that is worth a word.
_JITTER = 0.01
# Share of steps further than half a period from the median with which there is no clock.
_NO_CLOCK = 0.1
# Relative difference of two clocks that are one: rounding of written times.
_SAME_CLOCK = 2e-3
# Of a sample over the whole record: a plain number that is so near is the clock's.
_ROUNDED = 0.1
# Share of samples at an extreme, and how many other levels, of a signal that is clipped.
_CLIPPED = 5e-3
_LEVELS = 12
# Distance of values from whole steps, in steps, and share of values, that make them quantised.
_ON_A_STEP = 1e-3
_MOST_STEPS = 1_000_000  # over the range: finer is no encoder's but a number's rounding


def clock_of(time: Array, sample_time: float | None, where: str) -> tuple[float, Array, list[str]]:
    """Return the period of time stamps, the sample number of each, and what was found.

    Parameters
    ----------
    time : ndarray, shape (n,)
        In s.
    sample_time : float or None
        What the user says of the clock, in s.
    where : str

    Raises
    ------
    InputError
        If the time does not increase, keeps no clock, or one that is not the user's.
    """
    if not np.all(np.isfinite(time)):
        raise InputError(
            f"the time in row {int(np.argmin(np.isfinite(time))) + 1} is no number",
            where=where,
            remedy="leave such rows out, or give sample_time and no time",
        )
    check_measurable(time, where)
    steps = np.diff(time)
    if not len(steps):
        raise InputError("one sample makes no record", where=where, remedy="log a motion")
    if np.any(steps <= 0):
        row = int(np.argmax(steps <= 0)) + 2
        raise InputError(
            f"the time does not increase at row {row}", where=where, remedy="sort the samples"
        )
    rough = float(np.median(steps))
    whole = np.maximum(np.round(steps / rough), 1)
    uneven = np.abs(steps / rough - whole) > 0.5 * whole
    if np.mean((steps / rough < 0.5) | (whole > 2) | uneven) > _NO_CLOCK:
        raise InputError(
            f"the samples keep no clock: from {steps.min():.4g} to {steps.max():.4g} s apart",
            where=where,
            remedy="log at a fixed rate",
        )
    number = np.concatenate([[0], np.cumsum(whole)])
    period = float(np.polyfit(number, time, 1)[0])
    plain = float(f"{period:.6g}")
    if abs(plain - period) * number[-1] < _ROUNDED * period:
        period = plain
    told = _irregular(time, number, period)
    if sample_time is not None:
        check_positive(sample_time, "sample_time")
        if abs(period / sample_time - 1) > _SAME_CLOCK:
            raise InputError(
                f"clocks disagree: samples are {period:.6g} s apart, sample_time is "
                f"{sample_time:g} s",
                where=where,
                remedy="leave sample_time out, or check the unit of the time",
            )
        period = sample_time
    return period, number.astype(int), told


def check_measurable(values: Array | ComplexArray, where: str) -> None:
    """Refuse numbers whose squares are beyond arithmetic: nothing measures them.

    Parameters
    ----------
    values : ndarray, shape (n,)
    where : str

    Raises
    ------
    InputError
        Naming the first row of such a number.
    """
    size = np.abs(values)
    beyond = np.isfinite(size) & (size > _LARGEST)
    if beyond.any():
        row = int(np.argmax(beyond))
        raise InputError(
            f"{size[row]:.3g} in row {row + 1} is nothing that is measured",
            where=where,
            remedy="leave such a sample empty, or check the unit",
        )


def _irregular(time: Array, number: Array, period: float) -> list[str]:
    scatter = float(np.std(np.diff(time) / period - np.diff(number)))
    if scatter <= _JITTER:
        return []
    return [
        f"the clock is irregular: steps scatter by {scatter:.1%} of the period of {period:.4g} s; "
        "the samples are taken as evenly spaced"
    ]


def on_the_clock(column: Array, number: Array) -> Array:
    """Return a signal with NaN where a sample is missing, shape (last number + 1,)."""
    whole = np.full(int(number[-1]) + 1, np.nan)
    whole[number] = column
    return whole


def longest_stretch(signals: Mapping[str, Array], period: float) -> tuple[slice, tuple[str, ...]]:
    """Return the longest stretch in which every signal has numbers, and what was left out."""
    good = np.all([np.isfinite(column) for column in signals.values()], axis=0)
    if good.all():
        return slice(0, len(good)), ()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    starts, stops = edges[::2], edges[1::2]
    if not len(starts):
        return slice(0, 0), ()
    widest = int(np.argmax(stops - starts))
    start, stop = int(starts[widest]), int(stops[widest])
    missing = int(np.count_nonzero(~good))
    first = period * int(np.argmin(good))
    return slice(start, stop), (
        f"{missing} {'sample is' if missing == 1 else 'samples are'} missing or no numbers, the "
        f"first at {first:.4g} s: of "
        f"{len(starts)} stretches the longest is kept, {period * start:.4g} to "
        f"{period * stop:.4g} s",
    )


def clipping(column: Array, unit: str) -> tuple[str, ...]:
    """Return, in words, at which levels a signal of many levels stays: it is clipped there.

    A signal of few levels, such as a PRBS, is at its extremes because it is made so.
    """
    if len(np.unique(column)) <= _LEVELS:
        return ()
    found = []
    for level in (column.min(), column.max()):
        at = column == level
        # Held at the limit from one sample to the next, and no accident of a coarse signal.
        held = float(np.mean(at[1:] & at[:-1]))
        typical = float(np.median(np.unique(column, return_counts=True)[1])) / len(column)
        if held > max(_CLIPPED, 3 * typical):
            found.append(f"{level:.4g} {unit} for {np.mean(at):.1%} of the time")
    if not found:
        return ()
    return (
        f"the input is clipped at {' and '.join(found)}; what the rig got must be in the log, "
        "not what it was told",
    )


def quantum(column: Array) -> float:
    """Return the step in which a signal moves, as an encoder's; zero where none is seen."""
    levels = np.unique(column)
    apart = np.diff(levels)
    reach = float(np.ptp(column))
    apart = apart[apart > reach / _MOST_STEPS]
    if not len(apart):
        return 0.0
    step = float(apart.min())
    count = np.round((levels - levels[0]) / step)
    for _ in range(2):  # the step from its largest multiples: the smallest are rounded most
        weight = float(count @ count)
        step = float(count @ (levels - levels[0])) / weight if weight else step
        count = np.round((levels - levels[0]) / step)
    off = np.abs((levels - levels[0]) / step - count)
    few = len(levels) < 3 or len(levels) > 0.9 * len(column)
    return 0.0 if few or np.max(off) > max(_ON_A_STEP, 1e-9 * count.max()) else step
