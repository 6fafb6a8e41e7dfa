"""A slew as it happens: simulated step by step under conditions, and measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._show import Axes, DataFrame, axes_or_new, rows_of, to_frame
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.animation.animation import Animation
from slewctl.animation.movement import Movement
from slewctl.design.anti_windup import anti_windup
from slewctl.errors import AccuracyError, InputError, check_choice, check_type, shown
from slewctl.loop.closed import Loop
from slewctl.loop.motion.conditions import Conditions
from slewctl.loop.motion.continuous_walk import continuous_track
from slewctl.loop.motion.drawn import movement_of
from slewctl.loop.motion.pushed_arm import Limits, PushedArm
from slewctl.loop.motion.sampled_walk import sampled_track
from slewctl.loop.motion.shaped_slew import shaped
from slewctl.loop.motion.slew import BAND, SlewResponse, SlewSummary
from slewctl.loop.motion.slew_inputs import Slew
from slewctl.loop.motion.stepwise import Track, check_step, longest_step
from slewctl.loop.sampled import SampledLoop
from slewctl.plant.signals import TORQUE

# Signals of a simulation with their units.
UNITS = {
    "theta": "rad", "theta_ref": "rad", "theta_dot": "rad/s", "theta_motor": "rad",
    "theta_motor_dot": "rad/s", "tip": "m", "tip_ref": "m", "tip_deflection": "m",
    "torque": "N·m", "voltage": "V", "command": "N·m or V", "applied": "N·m or V",
    "friction_torque": "N·m", "energy": "J", "work": "J",
}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(SlewResponse):
    """A slew as it happened, with all its signals.

    Attributes
    ----------
    signals : mapping of str to ndarray
        By name: ``theta``, ``theta_ref``, ``theta_dot``, ``theta_motor``,
        ``theta_motor_dot``, ``tip``, ``tip_ref``, ``tip_deflection``, ``torque`` of the
        actuator, ``voltage`` where there is a motor, ``command`` of the controller and
        ``applied`` by the drive, ``friction_torque``, ``energy`` of the arm and ``work`` of
        the actuator, each at `t`; what jumps there has the value after it.
    slew : Slew
        With its shaper as it was made.
    step : float
        The longest step in s.
    anti_windup : str
        How the controller is told of limits; empty where there are none.
    movement : Movement
        What the arm does at a few hundred times: its angle and its shape.
    """

    signals: Mapping[str, Array]
    slew: Slew
    step: float
    anti_windup: str
    movement: Movement

    @property
    def conditions(self) -> Conditions:
        """What the slew met."""
        return self.slew.conditions

    @property
    def seed(self) -> int | None:
        """Of all that was random; None where nothing was."""
        return (self.conditions.seed or 0) if self.conditions.random else None

    @property
    def _unsettled(self) -> str:
        return f"not seen settled by {self.t[-1]:.4g} s"

    def __str__(self) -> str:
        s = self.summary
        told = super().__str__().replace("slew:", "slew as it happens:", 1)
        told += f", {s.energy_j:.4g} J"
        if self.conditions.limited:
            told += f", limited for {s.saturation_s:.4g} s"
        return told

    def to_frame(self) -> DataFrame:
        """Return all signals as a pandas data frame, one time a row."""
        return to_frame(self.rows())

    def rows(self) -> list[dict[str, object]]:
        """Return all signals, one time a row."""
        return rows_of({"t": self.t, **self.signals})

    def plot(self, what: str = "tip", ax: Axes | None = None) -> Axes:
        """Draw one curve over time.

        Parameters
        ----------
        what : str
            A signal, or ``error``, that of the tip in m.
        ax : matplotlib Axes, optional
            By default those of a new figure.

        Raises
        ------
        InputError
            For another curve.
        """
        curves = {**self.signals, "error": self.tip - self.tip_reference}
        values = curves[check_choice(what, curves, "what")]
        ax = axes_or_new(ax)
        if f"{what}_ref" in curves:
            ax.plot(self.t, curves[f"{what}_ref"], lw=4, alpha=0.4, label="wanted")
        ax.plot(self.t, values, label=what)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(f"{what.replace('_', ' ')} ({UNITS.get(what, 'm')})")
        ax.legend()
        return ax

    def animate(
        self,
        beside: Simulation | None = None,
        *,
        names: Sequence[str] | None = None,
        magnify: float | None = None,
    ) -> Animation:
        """Return the slew as it moves, beside another one if wanted.

        Parameters
        ----------
        beside : Simulation, optional
        names : sequence of str, optional
            Of each, to stand above it; by default the slew's angle and profile.
        magnify : float, optional
            Factor of the deflections; by default one that shows them.

        Returns
        -------
        Animation
            It shows itself in a notebook; ``save("slew.html")`` or ``save("slew.gif")`` writes it.

        Raises
        ------
        InputError
            For other than one name each, a factor that is not positive, or something else
            than a simulation beside.

        Examples
        --------
        >>> import slewctl as sc
        >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
        >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0},
        ...                      {"torque": 0.1, "theta": 0.01}, slew=sc.Slew(30.0, 4.0))
        >>> K = sc.lqg(problem.plant("clamped-free", n=1))
        >>> problem.simulate(K).animate(names=["lqg"])
        <animation of lqg, 12 s>
        """
        if beside is not None and not isinstance(beside, Simulation):
            raise InputError(
                f"{shown(beside)} is no simulation",
                where="beside",
                remedy="give what problem.simulate returned",
            )
        both = [self] if beside is None else [self, beside]
        if names is None:
            names = [f"{one.slew.angle_deg:g} degrees, {one.slew.profile}" for one in both]
        told = list(names) if isinstance(names, list | tuple) else []
        if len(told) != len(both) or not all(isinstance(name, str) for name in told):
            raise InputError(
                f"{shown(names)} for {len(both)} slews", where="names", remedy="give one name each"
            )
        return Animation([one.movement for one in both], told, magnify)


@single_threaded
def simulate(loop: Loop, slew: Slew, *, step: float | None = None) -> Simulation:
    """Return a slew of a stable loop as it happens, step by step.

    What is linear is exact from step to step, by the matrix exponential, and so is a sampled
    law with its hold and delay.  The nonlinear equations, play, and the limits of a continuous
    law are met by a method of fourth order, dry friction by one that sticks without chatter.
    The controller is given what `simulate_slew` gives it, the rigid arm's torque as well.

    Parameters
    ----------
    loop : Loop
    slew : Slew
        A shaper that is but named is made for this loop.
    step : float, optional
        The longest one in s, a twentieth of the slew at most; by default a twentieth of the
        period of the third mode, and a two hundredth of the slew.

    Returns
    -------
    Simulation

    Raises
    ------
    UnstableLoopError
        If the loop is unstable.
    InputError
        For conditions that the loop does not have, a shaper that cannot be made, or a step
        that is too long.
    AccuracyError
        For more steps than anybody waits for, or a motion that leaves the range of numbers.
    LargeDeflectionError
        If the arm bends further than the nonlinear equations can describe.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01,
    ...              actuator=sc.Actuator(torque_limit=0.06))
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> slew = sc.Slew(30.0, 4.0, conditions=sc.Conditions(saturate=True))
    >>> sc.simulate(loop, slew).summary.peak_torque
    0.06
    """
    check_type(slew, Slew, "slew")
    loop.require_stable("a slew response")
    slew.conditions.require(loop)
    slew = shaped(slew, loop)
    longest = longest_step(loop, slew) if step is None else check_step(step, slew)
    with np.errstate(over="ignore", invalid="ignore"):
        if isinstance(loop, SampledLoop):
            longest = min(longest, loop.sample_time)
            track = sampled_track(loop, slew, longest)
        else:
            track = continuous_track(loop, slew, longest)
    if not np.isfinite(track.states).all():
        raise AccuracyError(
            f"the motion leaves the range of numbers {_when(track):.4g} s after the beginning",
            where="simulate",
            remedy="limit less, slew more slowly, or give a shorter step",
        )
    signals = _signals(loop, slew, track)
    told = anti_windup(loop.controller)[1] if slew.conditions.anti_windup else "none"
    return Simulation(
        track.t,
        signals["theta"],
        signals["tip"],
        signals["tip_deflection"],
        signals["torque"],
        signals["applied"],
        signals["tip_ref"],
        _summary(loop, slew, track, signals),
        signals,
        slew,
        longest,
        told if slew.conditions.limited else "",
        movement_of(loop.model, track.t, track.states, signals),
    )


def _when(track: Track) -> float:
    return float(track.t[int(np.argmin(np.isfinite(track.states).all(axis=1)))])


def _signals(loop: Loop, slew: Slew, track: Track) -> dict[str, Array]:
    arm, motor = PushedArm(loop, slew.conditions), loop.model.arm.motor
    states = arm.slowed(track.states)
    seen = states @ arm.seen.T + np.multiply.outer(track.applied, arm.through)
    theta, theta_dot, theta_motor, rate, tip, deflection, applied = seen.T
    by_torque = loop.objective.actuator == TORQUE
    limits = Limits(loop, slew.conditions)
    torque = applied
    if not (by_torque or motor is None):
        torque = limits.met(motor.torque(applied, rate))
    wanted = slew.reference(track.t)[0]
    found = {
        "theta": theta, "theta_ref": wanted, "theta_dot": theta_dot,
        "theta_motor": theta_motor, "theta_motor_dot": rate, "tip": tip,
        "tip_ref": loop.model.arm.reach * wanted,
        "tip_deflection": deflection, "torque": torque,
    }  # fmt: skip
    if motor is not None:
        found["voltage"] = limits.met(motor.voltage(applied, rate)) if by_torque else applied
    # At the end of a step what was held is still the old: the work of a step is of its own ends.
    late = seen[1:, -1] + (track.applied[:-1] - track.applied[1:]) * arm.through[-1]
    ends = late if by_torque or motor is None else motor.torque(late, rate[1:])
    steps = (torque[:-1] + ends) / 2 * np.diff(theta_motor)
    found |= {
        "command": track.command,
        "applied": applied,
        "friction_torque": track.friction,
        "energy": arm.energy(track.states),
        "work": np.concatenate([[0.0], np.cumsum(steps)]),
    }
    return found


def _summary(loop: Loop, slew: Slew, track: Track, signals: Mapping[str, Array]) -> SlewSummary:
    travel = loop.model.arm.reach * math.radians(slew.angle_deg)
    t, size, error = track.t, abs(travel), signals["tip"] - travel
    after = t >= slew.duration_s
    torque = float(np.abs(signals["torque"]).max())
    voltage = float(np.abs(signals["voltage"]).max()) if "voltage" in signals else None
    beyond = float((np.sign(travel) * error).max()) / size
    limits = not slew.conditions.saturate and bool(loop.model.arm.exceeded(torque, voltage))
    return SlewSummary(
        _settled(t, error, BAND * size),
        float(np.abs(error[after]).max()),
        torque,
        voltage,
        limits,
        max(beyond, 0.0),
        float(np.abs(np.diff(signals["work"])).sum()),
        float(np.diff(t)[track.limited[:-1]].sum()),
    )


def _settled(t: Array, error: Array, band: float) -> float:
    """Return when a signal comes into its band for good, between two times by a straight line.

    It may be going through where it has been seen there for less than twice the time that this
    takes, and is so fast at the end that it would be outside after as long again.
    """
    away = np.abs(error)
    outside = np.flatnonzero(away > band)
    if not len(outside):
        return 0.0
    last = int(outside[-1])
    if last == len(t) - 1:
        return math.inf
    step, fallen = float(t[last + 1] - t[last]), float(away[last] - away[last + 1])
    found = float(t[last] + (away[last] - band) / fallen * step)
    seen, rate = float(t[-1]) - found, abs(float((error[-1] - error[-2]) / (t[-1] - t[-2])))
    stays = float(away[-1]) + 2 * rate * seen <= band
    return found if stays or seen >= 4 * band / fallen * step else math.inf
