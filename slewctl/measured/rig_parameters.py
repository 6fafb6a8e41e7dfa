"""What a fit to a response may adjust of a rig: its arm, and gain and dead time before it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from slewctl.arm import Arm, vary
from slewctl.errors import InputError, check_choice, shown, suggest
from slewctl.measured.rig_model import Channel
from slewctl.model import total_inertia, truth
from slewctl.model.adjustable import ADJUSTABLE
from slewctl.plant.dead_time import loop_dead_time

GAIN, DELAY, DAMPING, FRICTION = "gain", "delay", "damping", "hub.friction"
NAMES = (*ADJUSTABLE, FRICTION, DAMPING, "damping.1", DELAY, GAIN)
_ONE_RATIO = re.compile(r"damping\.([1-9][0-9]?)")
# A ratio to start from where the arm has none.
_SOME_DAMPING = 0.01
# Of a damping ratio; and modes among which the largest is looked for.
_MOST_RATIO, _MANY = 0.999, 100
# Least start of what is bounded by zero, in typical sizes.
_LEAST_START = 0.01


@dataclass(frozen=True)
class Rig:
    """An arm, and what stands between the command and its reading.

    Attributes
    ----------
    arm : Arm
        Its own dead times do not count beside `delay`.
    gain : float
        What the actuator gives of what it is told.
    delay : float
        Whole dead time in s, of actuator and sensor.
    """

    arm: Arm
    gain: float = 1.0
    delay: float = 0.0


def with_dead_time(arm: Arm, sensor: str, delay: float) -> Arm:
    """Return an arm with so much dead time from its actuator to a sensor's reading.

    What the sensor is known to have stays there, and the actuator gets the rest.
    """
    own = arm.sensor(sensor)
    if delay < own.delay:
        sensors = {**dict(arm.sensors), sensor: replace(own, delay=delay)}
        return replace(arm, actuator=replace(arm.drive, delay=0.0), sensors=sensors)
    if delay == loop_dead_time(arm, [sensor]):
        return arm
    return replace(arm, actuator=replace(arm.drive, delay=delay - own.delay))


@dataclass(frozen=True)
class Parameter:
    """A property of a rig that a fit adjusts.

    Attributes
    ----------
    name : str
    unit : str
        "×" for a factor on what the arm has.
    start : float
    scale : float
        A typical size.
    write : callable
        From the rig that the fit started with and a value to the rig that has it.
    positive : bool
        Whether its logarithm is the coordinate, as of all that the arm has: what a measurement
        cannot tell apart, such as all masses, stiffnesses and the gain times one factor, is then
        a straight line.  What the arm has none of is bounded by zero instead.
    shape : bool
        Whether it moves poles and zeros and not only their damping, and so needs other starts.
    most : float
        The largest value that it can have.
    """

    name: str
    unit: str
    start: float
    scale: float
    write: Callable[[Rig, float], Rig]
    positive: bool
    shape: bool = False
    most: float = math.inf

    @property
    def of_arm(self) -> bool:
        """Whether it is a property of the arm, its drive's dead time included."""
        return self.name != GAIN


def parameters(arm: Arm, free: object, channel: Channel, highest_hz: float) -> list[Parameter]:
    """Return the properties that the user named.

    Parameters
    ----------
    arm : Arm
    free : sequence of str
    channel : Channel
    highest_hz : float
        Of the measurement.

    Raises
    ------
    InputError
        For an unknown name, one that is given twice, or no list.
    """
    if not isinstance(free, Sequence) or isinstance(free, str) or not free:
        raise InputError(
            f"{shown(free)} is not a list of properties",
            where="fit.free",
            remedy=f"give some of {', '.join(NAMES)}",
        )
    if len(set(free)) < len(free):
        raise InputError(
            f"{shown(list(free))} names one twice", where="fit.free", remedy="name each once"
        )
    if DAMPING in free and any(_ONE_RATIO.fullmatch(str(name)) for name in free):
        raise InputError(
            "damping is freed as a whole and mode by mode",
            where="fit.free",
            remedy="keep damping, or damping.1, damping.2 and so on",
        )
    tick = channel.sample_time or 1 / (6 * highest_hz)
    late = loop_dead_time(arm, [channel.sensor])
    return [_parameter(arm, name, tick, late) for name in free]


def _parameter(arm: Arm, name: object, tick: float, late: float) -> Parameter:
    one = _ONE_RATIO.fullmatch(name) if isinstance(name, str) else None
    if one:
        return _ratio(arm, int(one[1]))
    if name == GAIN:
        return Parameter(GAIN, "×", 1.0, 1.0, lambda rig, v: replace(rig, gain=v), True)
    if name == DELAY:
        return Parameter(DELAY, "s", late, tick, lambda rig, v: replace(rig, delay=v), False)
    if name == DAMPING:
        vary(arm, damping_factor=1 + 1e-9)  # refused here where there is nothing to multiply
        most = _MOST_RATIO / max(float(arm.damping_ratios(_MANY).max()), 1e-9)
        return Parameter(
            DAMPING,
            "×",
            1.0,
            1.0,
            lambda rig, v: replace(rig, arm=vary(rig.arm, damping_factor=min(v, most))),
            True,
            most=most,
        )
    if name == FRICTION:
        omega = float(truth(arm, 1).omega[0])
        return Parameter(
            FRICTION,
            "N·m·s/rad",
            arm.hub.friction,
            total_inertia(arm) * omega,
            lambda rig, v: replace(rig, arm=vary(rig.arm, hub_friction=v)),
            arm.hub.friction > 0,
        )
    if not isinstance(name, str) or name not in ADJUSTABLE:
        check_choice(name, NAMES, "fit.free")
        raise InputError("unknown name", where="fit.free", remedy=suggest(str(name), NAMES))
    each = ADJUSTABLE[name]
    return Parameter(
        name,
        each.unit,
        each.read(arm),
        each.scale(arm),
        lambda rig, v: replace(rig, arm=each.write(rig.arm, v)),
        each.positive or each.read(arm) > 0,
        shape=True,
    )


def _ratio(arm: Arm, mode: int) -> Parameter:
    """Return the damping ratio of one mode; those of the others stay."""

    def write(rig: Rig, value: float) -> Rig:
        ratios = rig.arm.damping_ratios(mode + 1)
        ratios[mode - 1] = min(value, _MOST_RATIO)
        given = rig.arm.damping_ratio
        rest = given[mode + 1 :] if isinstance(given, Sequence) else ()
        return replace(rig, arm=replace(rig.arm, damping_ratio=(*ratios.tolist(), *rest)))

    start = float(arm.damping_ratios(mode)[-1]) or _SOME_DAMPING
    return Parameter(f"damping.{mode}", "1", start, 0.01, write, True, most=_MOST_RATIO)


def starting_coordinate(parameter: Parameter, log: Callable[[float], float]) -> float:
    """Return where the search of a property begins: its logarithm, or its ratio to its size."""
    if parameter.positive:
        return log(parameter.start)
    return max(parameter.start / parameter.scale, _LEAST_START)
