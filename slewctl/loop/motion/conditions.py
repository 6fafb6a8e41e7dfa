"""What a real drive and a real clock do to a slew: limits, friction, play, steps and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from slewctl.errors import InputError, check_count, check_nonnegative, check_number, check_positive
from slewctl.loop.closed import Loop
from slewctl.loop.sampled import SampledLoop
from slewctl.plant.signals import signal

# Sensors that an encoder can be.
ANGLES = ("theta", "theta_motor")
# Most of a sample by which the clock may be late.
_MOST_JITTER = 0.5

# Conditions that stand beside the turn itself in a design file.
_BESIDE = ("saturate", "nonlinear")


def place(name: str) -> str:
    """Return the key of a design file that a condition has."""
    return f"slew.{name}" if name in _BESIDE else f"slew.conditions.{name}"


@dataclass(frozen=True)
class Load:
    """A force that pushes on the arm from one time on.

    Parameters
    ----------
    time_s : float
        When it begins.
    torque : float
        On the hub, in N·m.
    tip_force : float
        On the tip, along the arc, in N.
    until_s : float, optional
        When it ends; it stays if left out.

    Raises
    ------
    InputError
        For no load, or one that ends before it begins.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Load(time_s=1.0, torque=0.2).until_s is None
    True
    """

    time_s: float
    torque: float = 0.0
    tip_force: float = 0.0
    until_s: float | None = None

    def __post_init__(self) -> None:
        check_nonnegative(self.time_s, "loads.time_s")
        for name in ("torque", "tip_force"):
            check_number(getattr(self, name), f"loads.{name}")
        if not (self.torque or self.tip_force):
            raise InputError("no load", where="loads", remedy="give a torque or a tip_force")
        if self.until_s is not None and check_number(self.until_s, "loads.until_s") <= self.time_s:
            raise InputError(
                f"the load ends at {self.until_s:g} s, before it begins",
                where="loads.until_s",
                remedy=f"give more than {self.time_s:g}",
            )


@dataclass(frozen=True)
class Conditions:
    """What a slew meets on a real arm; without any it is the slew of linear equations.

    Parameters
    ----------
    saturate : bool
        Whether the command is held within the torque and the voltage that motor and actuator
        have.
    nonlinear : bool
        Whether the arm moves by the nonlinear equations of large slews, with stiffening.
    rate_limit : float, optional
        Largest change of the command in a second, in N·m/s or V/s; of a sampled law.
    anti_windup : bool
        Whether the controller is told what its command became: an observer sees the limited
        input, an integrator is led back.
    coulomb_friction : float
        Torque of dry friction where the motor's torque acts, in N·m.
    static_friction : float, optional
        Torque that breaks it loose, at least as large; the same by default.
    backlash_deg : float
        Play of the elastic joint from one side to the other.
    encoder_counts : int, optional
        Steps in a turn by which ``theta`` or ``theta_motor`` is read.
    jitter : float
        How late a sample may be, in s; uniformly distributed in steps of T/64.
    missed : float
        Probability that a sample is missed: the command stays, the law does not move.
    noise : bool
        Whether the problem's disturbance and sensor noise act.
    seed : int, optional
        Of all that is random; 0 by default.
    loads : sequence of Load

    Raises
    ------
    InputError
        For an impossible value, or one that nothing uses.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Conditions(saturate=True, coulomb_friction=0.02).ideal
    False
    """

    saturate: bool = False
    nonlinear: bool = False
    rate_limit: float | None = None
    anti_windup: bool = True
    coulomb_friction: float = 0.0
    static_friction: float | None = None
    backlash_deg: float = 0.0
    encoder_counts: int | None = None
    jitter: float = 0.0
    missed: float = 0.0
    noise: bool = False
    seed: int | None = None
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:
        for name in ("coulomb_friction", "backlash_deg", "jitter", "missed"):
            check_nonnegative(getattr(self, name), place(name))
        if self.rate_limit is not None:
            check_positive(self.rate_limit, place("rate_limit"))
        if self.encoder_counts is not None:
            check_count(self.encoder_counts, place("encoder_counts"))
        if self.seed is not None:
            check_count(self.seed, place("seed"), 0)
        if self.missed >= 1:
            raise InputError(
                f"{self.missed:g} is no probability of a miss that leaves a sample",
                where=place("missed"),
                remedy="give 0 <= missed < 1",
            )
        if self.static_friction is not None:
            least = self.coulomb_friction
            if check_nonnegative(self.static_friction, place("static_friction")) < least:
                raise InputError(
                    f"{self.static_friction:g} N·m is less than the friction in motion",
                    where=place("static_friction"),
                    remedy=f"give at least {least:g}, or leave it out",
                )
        object.__setattr__(self, "loads", _loads(self.loads))
        if self.seed is not None and not self.random:
            raise _idle("seed", "nothing is random", "add noise, jitter or missed samples")
        if not self.anti_windup and not self.limited:
            raise _idle("anti_windup", "nothing limits the command", "add saturate or rate_limit")

    @property
    def limited(self) -> bool:
        """Whether a command may become another."""
        return self.saturate or self.rate_limit is not None

    @property
    def random(self) -> bool:
        """Whether a seed matters."""
        return self.noise or bool(self.jitter) or bool(self.missed)

    @property
    def breakaway(self) -> float:
        """Torque that breaks the arm loose, in N·m."""
        return self.coulomb_friction if self.static_friction is None else self.static_friction

    @property
    def ideal(self) -> bool:
        """Whether there are none."""
        return self == Conditions()

    def require(self, loop: Loop) -> None:
        """Refuse what a loop does not have, so that nothing asked for is left undone.

        Parameters
        ----------
        loop : Loop

        Raises
        ------
        InputError
            Naming the condition and what it wants.
        """
        arm, sampled = loop.model.arm, isinstance(loop, SampledLoop)
        if not sampled:
            for name in ("rate_limit", "encoder_counts", "jitter", "missed"):
                if getattr(self, name):
                    raise _idle(name, "a continuous law has no clock", "give it a sample_time")
        elif isinstance(loop, SampledLoop) and self.jitter > _MOST_JITTER * loop.sample_time:
            most = _MOST_JITTER * loop.sample_time
            raise InputError(
                f"{self.jitter:g} s of a clock of {loop.sample_time:g} s",
                where=place("jitter"),
                remedy=f"give at most {most:g} s, half a sample",
            )
        limits = [arm.drive.torque_limit]
        limits += [arm.motor.torque_limit, arm.motor.voltage_limit] if arm.motor else []
        if self.saturate and not any(limits):
            raise _idle("saturate", f"{arm.name} has no limit",
                        "give arm.actuator.torque_limit, or the motor's limits")  # fmt: skip
        if self.backlash_deg and arm.joint is None:
            raise _idle("backlash_deg", f"{arm.name} has no joint that could have play",
                        "give arm.joint, a stiff one if need be")  # fmt: skip
        if self.encoder_counts and not {*ANGLES} & {*loop.controller.sensors}:
            raise _idle("encoder_counts", "no angle is measured", "measure theta or theta_motor")
        if self.noise and not loop.objective.weighted:
            raise _idle("noise", "the problem states none", "give controller.limits and noise")
        for name in (*loop.controller.sensors, *dict(arm.sensors)) if self.nonlinear else ():
            if signal(name, beam=arm.beam).of == "acceleration":
                raise _idle("nonlinear", f"{name} is of the linear equations alone",
                            "measure something else, or leave it out")  # fmt: skip


def _idle(name: str, what: str, remedy: str) -> InputError:
    return InputError(what, where=place(name), remedy=f"{remedy}, or leave {name} out")


def _loads(given: Sequence[Load]) -> tuple[Load, ...]:
    if isinstance(given, Load):
        return (given,)
    if not isinstance(given, Sequence) or not all(isinstance(load, Load) for load in given):
        raise InputError(
            "not a list of loads", where=place("loads"), remedy="give slewctl.Load objects"
        )
    return tuple(given)
