"""Whether a drive can make an arm follow a command, and how long the command must take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slewctl.errors import InputError
from slewctl.loop.closed import Loop
from slewctl.loop.motion.slew_inputs import Slew, feedforward
from slewctl.plant.signals import TORQUE
from slewctl.trajectory.shapers import Shaper

# Times of a command at which its torque is looked at.
_POINTS = 1001
# A command so much longer needs hardly more than friction: no time is long enough.
_LONGEST = 1e6
# A time that is told in three digits, and shall suffice.
_ROUNDED_UP = 1.002


def rigid_needs(loop: Loop, slew: Slew) -> tuple[float, float | None]:
    """Return the largest torque in N·m and voltage in V by which the rigid arm follows a slew.

    Parameters
    ----------
    loop : Loop
    slew : Slew
        With its shaper made.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> rigid_needs(loop, sc.Slew(30.0, 4.0))[0] < 0.2
    True
    """
    _, rate, acceleration = slew.reference(np.linspace(0.0, slew.duration_s, _POINTS))
    of_rate, of_acceleration = feedforward(loop, 1.0, 0.0), feedforward(loop, 0.0, 1.0)
    actuator = of_rate * rate + of_acceleration * acceleration
    motor = loop.model.arm.motor
    if motor is None:
        return float(np.abs(actuator).max()), None
    if loop.objective.actuator == TORQUE:
        torque, voltage = actuator, motor.voltage(actuator, rate)
    else:
        torque, voltage = motor.torque(actuator, rate), actuator
    return float(np.abs(torque).max()), float(np.abs(voltage).max())


def least_duration(loop: Loop, slew: Slew) -> float:
    """Return the shortest duration in s in which the drive can turn the rigid arm so.

    Parameters
    ----------
    loop : Loop
    slew : Slew
        With its shaper made, which stays as it is.

    Returns
    -------
    float
        Infinite if no duration will do; zero where nothing limits it.
    """
    arm = loop.model.arm
    added = slew.shaper.duration if isinstance(slew.shaper, Shaper) else 0.0

    def beyond(duration: float) -> bool:
        longer = replace(slew, duration_s=duration, horizon_s=None)
        return bool(arm.exceeded(*rigid_needs(loop, longer)))

    return _least(beyond, slew.duration_s, added)


def _least(beyond: Callable[[float], bool], duration: float, added: float) -> float:
    """Return the shortest duration that is not beyond the limits, between powers of two."""
    from scipy.optimize import brentq  # slow to load: not before it is wanted

    low = high = duration - added
    while beyond(high + added):
        low, high = high, 2 * high
        if high > _LONGEST * duration:
            return np.inf
    while not beyond(low + added):
        low, high = low / 2, low
        if _LONGEST * low < duration:
            return 0.0
    found = brentq(lambda t: 1.0 if beyond(t + added) else -1.0, low, high, xtol=1e-4 * low)
    return float(found * (1 + 1e-4) + added)


def require_feasible(loop: Loop, slew: Slew) -> None:
    """Refuse a slew that the drive cannot make the rigid arm follow.

    Parameters
    ----------
    loop : Loop
    slew : Slew
        With its shaper made.

    Raises
    ------
    InputError
        With what it needs, what there is, and the time that works.
    """
    beyond = loop.model.arm.exceeded(*rigid_needs(loop, slew))
    if not beyond:
        return
    least = least_duration(loop, slew) * _ROUNDED_UP
    raise InputError(
        f"a slew of {slew.duration_s:g} s needs {'; '.join(beyond)}",
        where="slew.duration_s",
        remedy=f"take at least {least:.3g} s" if np.isfinite(least) else "turn by less",
    )


def told_time(loop: Loop, slew: Slew) -> str:
    """Return the time that would do, in words; empty where the rigid arm alone is no reason.

    Parameters
    ----------
    loop : Loop
    slew : Slew
    """
    least = least_duration(loop, slew)
    if least <= slew.duration_s or not np.isfinite(least):
        return ""
    return f": at least {least * _ROUNDED_UP:.3g} s for the rigid arm"
