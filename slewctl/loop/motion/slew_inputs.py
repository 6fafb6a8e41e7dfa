"""What a loop is told during a slew, and what is read off it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.errors import (
    InputError,
    check_choice,
    check_count,
    check_number,
    check_positive,
    shown,
)
from slewctl.loop.closed import Loop
from slewctl.loop.motion.conditions import Conditions
from slewctl.plant.signals import TORQUE, signal
from slewctl.plant.statespace import APPLIED
from slewctl.trajectory.profiles import MINIMUM_JERK, MinimumJerk, Profile
from slewctl.trajectory.shapers import SHAPERS, Shaper, check_error
from slewctl.trajectory.timed_profiles import PROFILES, timed_profile

# Outputs of the loop that the signals are made of; the last is what the actuator applies.
WATCHED = ("theta", "theta_motor_dot", "tip", "tip_deflection", APPLIED)
# Signals of a slew, and the voltage behind them where the arm has a motor.
THETA, TIP, DEFLECTION, HUB_TORQUE, VOLTAGE = range(5)

ROBUST = "robust"
# Shapers that a slew can name beside the classical ones: with its impulses on the controller's
# clock, and for a band of frequencies.
SLEW_SHAPERS = (*SHAPERS, "sampled", ROBUST)
# The profile whose response is known at all times.
_EXACT = "minimum-jerk"


@dataclass(frozen=True)
class Slew:
    """A rest-to-rest turn: what the loop is told, and under which conditions.

    Without conditions and shaper, and with the minimum-jerk profile, the response is exact at
    all times (see `simulate_slew`); any other is simulated step by step (see `simulate`).

    Parameters
    ----------
    angle_deg : float
        Angle turned, not zero.
    duration_s : float
        Time that the reference takes, shaper and all.
    horizon_s : float, optional
        Time drawn, longer than the duration; by default three times as long.  The summary
        of a slew that is exact is of all times and does not depend on it; one that is
        simulated ends there.
    profile : str
        ``minimum-jerk``, ``versine``, ``trapezoid``, ``s-curve`` or ``rigid-time-optimal``;
        see `timed_profile`.
    shaper : str or Shaper, optional
        What the profile is convolved with.  A name, ``zv``, ``mzv``, ``zvd``, ``ei``, ``ei2``,
        ``ei3``, ``sampled`` or ``robust``, is made into a shaper for the modes that the loop
        would leave vibrating; a shaper is taken as it is.
    modes : int, optional
        How many of them, where the shaper is a name; one by default.
    frequency_error : float, optional
        Of a robust shaper: how far off their frequencies may be, relative; 0.1 by default.
    conditions : Conditions

    Raises
    ------
    InputError
        For no turn, times that are not positive or too short, an unknown name, or a shaper
        that is longer than the slew.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Slew(angle_deg=30.0, duration_s=2.0).angle_deg
    30.0
    """

    angle_deg: float
    duration_s: float
    horizon_s: float | None = None
    profile: str = "minimum-jerk"
    shaper: str | Shaper | None = None
    modes: int | None = None
    frequency_error: float | None = None
    conditions: Conditions = field(default_factory=Conditions)

    def __post_init__(self) -> None:
        if check_number(self.angle_deg, "slew.angle_deg") == 0:
            raise InputError("no turn", where="slew.angle_deg", remedy="give an angle")
        check_positive(self.duration_s, "slew.duration_s")
        with np.errstate(all="ignore"):
            peak = np.abs(self.coefficients[2]).max()
        if not np.finfo(float).tiny < peak < np.finfo(float).max:
            raise InputError(
                f"{self.angle_deg:g} degrees in {self.duration_s:g} s is an acceleration "
                "outside the range of the numbers",
                where="slew.duration_s",
                remedy="give the time in seconds",
            )
        if self.horizon_s is not None:
            check_positive(self.horizon_s, "slew.horizon_s")
            if self.horizon_s <= self.duration_s:
                raise InputError(
                    f"{self.horizon_s:g} s ends before the slew of {self.duration_s:g} s",
                    where="slew.horizon_s",
                    remedy="make it longer than slew.duration_s",
                )
        self._check_command()

    def _check_command(self) -> None:
        check_choice(self.profile, PROFILES, "slew.profile")
        named = isinstance(self.shaper, str)
        if named:
            check_choice(self.shaper, SLEW_SHAPERS, "slew.shaper")
        elif isinstance(self.shaper, Shaper):
            try:
                self.shaper.require_within(self.duration_s)
            except InputError as error:
                raise error.at("slew.duration_s") from error
        elif self.shaper is not None:
            raise InputError(
                f"{shown(self.shaper)} is no shaper",
                where="slew.shaper",
                remedy="give a name, such as 'zvd', or a slewctl.Shaper",
            )
        if self.modes is not None:
            check_count(self.modes, "slew.modes")
            if not named:
                raise InputError(
                    "modes of no shaper", where="slew.modes", remedy="give slew.shaper a name"
                )
        if self.frequency_error is not None:
            if self.shaper != ROBUST:
                raise InputError(
                    "only a robust shaper is made for an error of the frequencies",
                    where="slew.frequency_error",
                    remedy=f'give shaper = "{ROBUST}", or leave it out',
                )
            check_error(self.frequency_error, "slew.frequency_error")
        if not isinstance(self.conditions, Conditions):
            raise InputError(
                f"{shown(self.conditions)} are no conditions",
                where="slew.conditions",
                remedy="give slewctl.Conditions",
            )

    @property
    def exact(self) -> bool:
        """Whether the response is known at all times, without steps."""
        plain = self.profile == _EXACT and self.shaper is None
        return plain and self.conditions.ideal

    @cached_property
    def turn(self) -> Profile:
        """The profile without its shaper."""
        added = self.shaper.duration if isinstance(self.shaper, Shaper) else 0.0
        angle = float(np.radians(self.angle_deg))
        return timed_profile(self.profile, angle, self.duration_s - added)

    def table(self) -> dict[str, Any]:
        """Return the slew as the ``[slew]`` table of a design file.

        Raises
        ------
        InputError
            For a shaper that is no name: impulses are not written.
        """
        if isinstance(self.shaper, Shaper):
            raise InputError(
                "a shaper of its own cannot be written to a design file",
                where="slew.shaper",
                remedy="give its name, such as 'zvd'",
            )
        table: dict[str, Any] = {
            "angle_deg": self.angle_deg,
            "duration_s": self.duration_s,
            "horizon_s": self.horizon_s,
            "profile": None if self.profile == _EXACT else self.profile,
            "shaper": self.shaper,
            "modes": self.modes,
            "frequency_error": self.frequency_error,
        }
        met = self.conditions
        changed = {
            f.name: getattr(met, f.name)
            for f in fields(met)
            if f.name != "loads" and getattr(met, f.name) != f.default
        }
        for key in ("saturate", "nonlinear"):
            table[key] = changed.pop(key, None)
        if met.loads:
            changed["loads"] = [
                {k: v for k, v in asdict(load).items() if k == "time_s" or v} for load in met.loads
            ]
        return {**table, "conditions": changed or None}

    @property
    def end(self) -> float:
        """Time drawn, in s."""
        return 3 * self.duration_s if self.horizon_s is None else self.horizon_s

    @property
    def coefficients(self) -> Array:
        """Angle (rad), rate and acceleration of the reference as powers of t/duration, (3, 6)."""
        T, angle = np.float64(self.duration_s), np.radians(self.angle_deg)
        return np.array(MINIMUM_JERK) * np.array([[angle], [angle / T], [angle / T / T]])

    @property
    def peak_acceleration(self) -> float:
        """Largest |angular acceleration| of the reference, in rad/s²."""
        return MinimumJerk(np.radians(self.angle_deg), self.duration_s).peak_acceleration

    def reference(self, t: Array) -> tuple[Array, Array, Array]:
        """Return angle (rad), rate and acceleration of the reference at times t.

        Of a shaper that is but named the profile is not shaped.
        """
        if isinstance(self.shaper, Shaper):
            return self.shaper.command(self.turn, t)
        return self.turn.at(t)


def rigid_readings(loop: Loop, angle: float, rate: float, acceleration: float) -> list[float]:
    """Return what each sensor would read if the arm were rigid."""
    motion = {"displacement": angle, "rate": rate, "acceleration": acceleration}
    readings = []
    for name in loop.controller.sensors:
        sensor = signal(name, beam=loop.model.arm.beam)
        readings.append(float(sensor.row(loop.model)[0] * motion[sensor.of]))
    return readings


def feedforward(loop: Loop, rate: float, acceleration: float) -> float:
    """Return the actuator's signal that would turn the rigid arm along the reference."""
    model = loop.model
    # The first rows of M and D are those of the rigid rotation.
    torque = model.mass[0, 0] * acceleration + model.damping[0, 0] * rate
    motor = model.arm.motor
    if loop.objective.actuator == TORQUE or motor is None:
        return float(torque)
    return float(motor.voltage(torque, rate))


def told(loop: Loop) -> Array:
    """Return [sensor references; feedforward] of angle, rate and acceleration, (inputs, 3)."""
    columns = [[*rigid_readings(loop, *unit), feedforward(loop, *unit[1:])] for unit in np.eye(3)]
    return np.array(columns).T


def signals(loop: Loop) -> Array:
    """Return the rows that make the signals of a slew of `WATCHED`."""
    theta, rate, tip, deflection, actuator = np.eye(len(WATCHED))
    motor = loop.model.arm.motor
    if motor is None:
        return np.array([theta, tip, deflection, actuator])
    if loop.objective.actuator == TORQUE:
        return np.array([theta, tip, deflection, actuator, motor.voltage(actuator, rate)])
    return np.array([theta, tip, deflection, motor.torque(actuator, rate), actuator])
