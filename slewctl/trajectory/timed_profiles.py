"""Profiles by name, of a given duration."""

from __future__ import annotations

from collections.abc import Callable

from slewctl.errors import check_choice, check_positive
from slewctl.trajectory.profiles import MinimumJerk, Profile, RigidTimeOptimal, SCurve, Versine

# Of a trapezoid a third each is speeding up, coasting and slowing down …
_TRAPEZOID = 3
# … and of an S-curve each of its seven segments takes a seventh.
_SEGMENTS = 7


def timed_profile(name: str, angle: float, duration_s: float) -> Profile:
    """Return a turn of a given duration.

    Parameters
    ----------
    name : {"minimum-jerk", "versine", "trapezoid", "s-curve", "rigid-time-optimal"}
        The trapezoid speeds up, coasts and slows down for a third of the time each; the
        S-curve is made of seven segments of equal length; the rigid arm's fastest turn without
        friction speeds up for one half and slows down for the other.
    angle : float
        rad, not zero.
    duration_s : float

    Returns
    -------
    Profile

    Raises
    ------
    InputError
        For another name, no turn, or a duration that is not positive.

    Examples
    --------
    >>> import slewctl as sc
    >>> f"{sc.timed_profile('s-curve', 0.5, 0.7).duration:.6g}"
    '0.7'
    """
    check_choice(name, PROFILES, "profile")
    return PROFILES[name](angle, check_positive(duration_s, "duration_s"))


def _trapezoid(angle: float, T: float) -> SCurve:
    size = abs(angle)
    rate = size / T * _TRAPEZOID / (_TRAPEZOID - 1)
    return SCurve(angle, rate, rate / T * _TRAPEZOID)


def _s_curve(angle: float, T: float) -> SCurve:
    # Boxes of 4/7, 2/7 and 1/7 of the time, whose convolution is the rate.
    part = T / _SEGMENTS
    rate = abs(angle) / (4 * part)
    acceleration = rate / (2 * part)
    return SCurve(angle, rate, acceleration, acceleration / part)


def _bang_bang(angle: float, T: float) -> RigidTimeOptimal:
    return RigidTimeOptimal(angle, 4 * abs(angle) / T / T, 1.0)


PROFILES: dict[str, Callable[[float, float], Profile]] = {
    "minimum-jerk": MinimumJerk,
    "versine": Versine,
    "trapezoid": _trapezoid,
    "s-curve": _s_curve,
    "rigid-time-optimal": _bang_bang,
}
