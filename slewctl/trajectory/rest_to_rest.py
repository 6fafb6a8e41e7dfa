"""The fastest turn of a flexible arm under a torque limit that leaves no mode vibrating.

J θ̈ = u and η̈ + 2ζω η̇ + ω² η = δu for each mode.  From rest to rest the torque obeys
∫u = 0, ∫t u = -J·angle and ∫u e^{pt} = 0 with p = ζω + iω√(1-ζ²), whatever the couplings δ; a
slew that also forgives a small error of the frequency obeys ∫t u e^{pt} = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2, pi, sqrt

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_number, check_positive, check_types
from slewctl.trajectory.costate import FullTorque, Functionals, fastest
from slewctl.trajectory.shapers import Mode, check_order

# Samples of the linear program that Newton's method starts from: at least, for each period of
# the fastest mode, and at most.
_LEAST, _A_PERIOD, _MOST = 240, 8, 20_000
# Of what the torque turns the arm in a period of its modes: beyond, squares are no numbers.
_FEWEST = 1e-60
# Bisections of its time: a thousandth of it is near enough for a start.
_BISECTIONS = 10


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

    Linear programs on a grid, bisected in time, say about how; Newton's method on their
    multipliers then finds the times to rounding, however often the torque switches.  That the
    multipliers' bound is reached proves that no other torque is faster.

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
        If the multipliers are not found to rounding, or a mode is so fast that its periods
        are too many.

    Examples
    --------
    >>> import slewctl as sc
    >>> turn = sc.rest_to_rest(1.0, torque_limit=1.0, inertia=2.0, modes=[sc.Mode(2**0.5)])
    >>> f"{turn.duration:.6f} s, {len(turn.switches)} switches"
    '4.217867 s, 3 switches'
    """
    if check_number(angle, "angle") == 0:
        raise InputError("no turn", where="angle", remedy="give an angle")
    check_order(order)
    size = abs(angle) * check_positive(inertia, "inertia")
    size /= check_positive(torque_limit, "torque_limit")
    if isinstance(modes, Sequence) and not len(modes):
        raise InputError("no mode", where="modes", remedy="give one, or take RigidTimeOptimal")
    modes = check_types(modes, Mode, "modes")
    if not _FEWEST < size * max(mode.frequency for mode in modes) ** 2 < 1 / _FEWEST:
        raise InputError(
            f"a turn of {angle:g} rad is nothing beside what the torque turns in a period, or all",
            where="angle",
            remedy="give angle, torque and inertia in SI units",
        )
    # Time is counted in what a rigid arm takes, but for a factor that costs no digit.
    unit = 2.0 ** round(log2(size) / 2)
    modes = [Mode(mode.frequency * unit, mode.ratio) for mode in modes]
    size /= unit**2
    found = fastest(_started(size, modes, order), size)
    limit = float(np.sign(angle)) * torque_limit * found.signs[0]
    return BangBang(limit, tuple((unit * found.switches).tolist()), unit * found.end)


def _farthest(end: float, modes: Sequence[Mode], order: int) -> tuple[float, FullTorque]:
    """Return how far J·angle/limit comes in a time on a grid, and the multipliers' torque."""
    from scipy.optimize import linprog  # slow to load: not before it is wanted

    functionals = Functionals(modes, order, end)
    quickest = max(mode.frequency for mode in modes)
    samples = max(_LEAST, ceil(_A_PERIOD * end * quickest / (2 * pi)))
    if samples > _MOST:
        raise AccuracyError(
            f"the mode at {quickest:.4g} rad/s has {samples // _A_PERIOD} periods in {end:.3g} s",
            where="modes",
            remedy="leave the fastest modes out, and shape the command for them",
        )
    held = np.diff(functionals.at(np.linspace(0.0, end, samples + 1))[1], axis=1)
    scale = np.abs(held).sum(axis=1, keepdims=True)
    rows = held / scale
    found = linprog(rows[0], A_eq=rows[1:], b_eq=np.zeros(len(rows) - 1), bounds=(-1, 1))
    if found.x is None:
        raise AccuracyError(
            "no torque was found",
            where="rest_to_rest",
            remedy="leave the fastest modes out, or those that the turn hardly moves",
        )
    multipliers = found.eqlin.marginals * (scale[0, 0] / scale[1:, 0])
    return -float(held[0] @ found.x), FullTorque(functionals, multipliers, end)


def _started(size: float, modes: Sequence[Mode], order: int) -> FullTorque:
    low = high = 2 * sqrt(size)  # of the rigid arm
    while _farthest(high, modes, order)[0] < size:
        low, high = high, 1.5 * high
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if _farthest(middle, modes, order)[0] < size:
            low = middle
        else:
            high = middle
    return _farthest(high, modes, order)[1]
