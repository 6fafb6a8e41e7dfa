"""The fastest turn of a flexible arm under a torque limit that leaves no mode vibrating.

J θ̈ = u and η̈ + 2ζω η̇ + ω² η = δu for each mode.  From rest to rest the torque obeys
∫u = 0, ∫t u = -J·angle and ∫u e^{pt} = 0 with p = ζω + iω√(1-ζ²), whatever the couplings δ; a
slew that also forgives a small error of the frequency obeys ∫t u e^{pt} = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.optimize import linprog

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_number, check_positive
from slewctl.trajectory.shapers import Mode

# Samples of the linear program that Newton's method starts from.
_SAMPLES = 240
# Bisections of its time: a thousandth of it is near enough for a start.
_BISECTIONS = 10
# A sample of the program is at its limit within this part of it.
_AT_LIMIT = 1e-6
# Newton's steps, and the last of them as a part of the duration.
_STEPS, _CONVERGED = 40, 1e-13
# What the switching equations may leave, of terms of size one.
_LEFT = 1e-9


@dataclass(frozen=True)
class BangBang:
    """Full torque one way and the other, from rest to rest.

    Attributes
    ----------
    limit : float
        The torque before the first switch, in N·m, with the sign of the angle.
    switches : tuple of float
        Times in s.
    duration : float
        In s.
    """

    limit: float
    switches: tuple[float, ...]
    duration: float

    def torque(self, t: Array) -> Array:
        """Return the torque in N·m at times t; at a switch, that after it."""
        t = np.asarray(t, dtype=float)
        passed = np.searchsorted(self.switches, t, side="right")
        moving = (t >= 0) & (t < self.duration)
        return np.where(moving, self.limit * (-1.0) ** passed, 0.0)


def rest_to_rest(
    angle: float, torque_limit: float, inertia: float, modes: Sequence[Mode], order: int = 1
) -> BangBang:
    """Return the fastest turn under a torque limit that leaves no vibration.

    Linear programs on a grid, bisected in time, say how often the torque switches and about
    when; Newton's method on the switching equations then finds the times to rounding.

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    torque_limit : float
        N·m.
    inertia : float
        Of the whole arm about its axis, in kg·m².
    modes : sequence of Mode
        The arm's free modes.
    order : {1, 2}
        1 leaves no vibration in the modes as given; with 2 its derivative with respect to
        each frequency vanishes as well.

    Returns
    -------
    BangBang

    Raises
    ------
    InputError
        For no turn, or numbers that are not positive.
    AccuracyError
        If the number of switches is not that of the switching equations, or Newton's method
        does not converge.

    Examples
    --------
    >>> import slewctl as sc
    >>> turn = sc.rest_to_rest(1.0, torque_limit=1.0, inertia=2.0, modes=[sc.Mode(2**0.5)])
    >>> f"{turn.duration:.6f} s, {len(turn.switches)} switches"
    '4.217867 s, 3 switches'
    """
    if check_number(angle, "angle") == 0:
        raise InputError("no turn", where="angle", remedy="give an angle")
    if order not in (1, 2):
        raise InputError(f"{order} is no order", where="order", remedy="give 1 or 2")
    size = abs(angle) * check_positive(inertia, "inertia")
    size /= check_positive(torque_limit, "torque_limit")
    end, torque = _started(size, modes, order)
    start = np.append(_switches(torque, end / _SAMPLES), end)
    wanted = 2 + 2 * order * len(modes)
    if len(start) != wanted:
        raise AccuracyError(
            f"on a grid of {_SAMPLES} the fastest turn switches {len(start) - 1} times, not the "
            f"{wanted - 1} times whose equations are solved here",
            where="rest_to_rest",
            remedy="ask for fewer modes, the slowest ones, and shape the command for the others",
        )
    times = _newton(start, size, modes, order)
    return BangBang(
        float(np.sign(angle)) * torque_limit, tuple(times[:-1].tolist()), float(times[-1])
    )


def _rows(t: Array, end: float, modes: Sequence[Mode], order: int) -> tuple[Array, Array]:
    """Return the weights f of ∫f u and their antiderivatives at times t, one functional a row.

    The first is t, the second 1; exponentials are counted from the end and so don't grow.
    """
    weights, sums = [t, np.ones_like(t)], [t**2 / 2, t]
    for mode in modes:
        pole = mode.ratio * mode.frequency + 1j * mode.damped
        wave, since = np.exp(pole * (t - end)), t - end
        made = [(wave, wave / pole), (since * wave, (since - 1 / pole) * wave / pole)]
        for weight, total in made[:order]:
            weights += [weight.real, weight.imag]
            sums += [total.real, total.imag]
    return np.array(weights), np.array(sums)


def _farthest(end: float, modes: Sequence[Mode], order: int) -> tuple[float, Array]:
    """Return J·angle/limit that is reached in a time at most, and the torque by samples."""
    grid = np.linspace(0.0, end, _SAMPLES + 1)
    held = np.diff(_rows(grid, end, modes, order)[1], axis=1)
    scale = np.abs(held).sum(axis=1, keepdims=True)
    found = linprog(held[0], A_eq=(held / scale)[1:], b_eq=np.zeros(len(held) - 1), bounds=(-1, 1))
    if found.x is None:
        raise AccuracyError(f"no torque was found: {found.message}", where="rest_to_rest")
    return -float(held[0] @ found.x), found.x


def _started(size: float, modes: Sequence[Mode], order: int) -> tuple[float, Array]:
    low = high = 2 * sqrt(size)  # of the rigid arm
    while _farthest(high, modes, order)[0] < size:
        low, high = high, 1.5 * high
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if _farthest(middle, modes, order)[0] < size:
            low = middle
        else:
            high = middle
    return high, _farthest(high, modes, order)[1]


def _switches(torque: Array, step: float) -> Array:
    """Return when the torque changes its sign, by the means of the samples in between."""
    full = np.flatnonzero(np.abs(torque) > 1 - _AT_LIMIT)
    found = []
    for before, after in pairwise(full):
        if torque[before] * torque[after] < 0:
            between = torque[before + 1 : after] * np.sign(torque[before])
            found.append(step * (before + 1 + (1 + between).sum() / 2))
    return np.array(found)


def _newton(times: Array, size: float, modes: Sequence[Mode], order: int) -> Array:
    """Solve the switching equations: ∫f u = -Σ jump·F(time), and its derivative is -jump·f."""
    jumps = 2.0 * (-1.0) ** np.arange(1, len(times) + 1)
    jumps[-1] /= 2
    end = times[-1]
    wanted = np.zeros(len(times))
    wanted[0] = -size
    for _ in range(_STEPS):
        weights, sums = _rows(times, end, modes, order)
        started = _rows(np.zeros(1), end, modes, order)[1][:, 0]
        error = -(sums @ jumps) - started - wanted
        step = np.linalg.lstsq(-weights * jumps, -error, rcond=None)[0]
        # No switch overtakes another: each gap keeps half of itself at least.
        closing = np.max(-np.diff(step, prepend=0.0) / np.diff(times, prepend=0.0))
        times = times + step / max(1.0, 2 * closing)
        if np.abs(step).max() <= _CONVERGED * end or times[-1] > 2 * end:
            break
    scale = np.abs(sums).max(axis=1)
    apart = np.diff(times, prepend=0.0)
    if not np.all(np.isfinite(times)) or apart.min() <= 0 or np.any(np.abs(error) > _LEFT * scale):
        raise AccuracyError(
            "Newton's method on the switching equations does not converge",
            where="rest_to_rest",
            remedy="leave out a mode, or turn by another angle",
        )
    return times
