"""Commands side by side: what each shaper costs in time, and what it leaves on the truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from slewctl._show import Axes, Tabular, axes_or_new
from slewctl._types import Array
from slewctl.errors import InputError
from slewctl.loop.closed import Loop
from slewctl.loop.motion.conditions import Conditions
from slewctl.loop.motion.feasible import least_duration, require_feasible, rigid_needs
from slewctl.loop.motion.shaped_slew import ringing_modes
from slewctl.loop.motion.simulation import simulate
from slewctl.loop.motion.slew_inputs import ROBUST, Slew
from slewctl.loop.sampled import SampledLoop
from slewctl.trajectory.robust_shaper import bands_of, robust_shaper
from slewctl.trajectory.sampled_shaper import sampled_shaper
from slewctl.trajectory.shapers import SHAPERS, Mode, Shaper, check_error, shaper
from slewctl.trajectory.timed_profiles import PROFILES

# Of the sensitivity curves: how far frequencies are off, and how many are drawn.
_SPREAD, _CURVE = 0.4, 161


@dataclass(frozen=True)
class ShapedCommand:
    """A shaper and what it does to a slew.

    Attributes
    ----------
    name : str
        ``none`` without a shaper.
    shaper : Shaper or None
    residual : float
        Largest residual in the modes as they are, a part of the unshaped impulse's.
    residual_off : float
        The same with all frequencies off by the error, either way.
    fits : bool
        Whether the slew has time for it.
    tip_m : float or None
        Largest tip error after the slew on the truth, simulated; None if it does not fit.
    settling_s : float or None
        When the tip has come within 2 % of its travel for good.
    """

    name: str
    shaper: Shaper | None
    residual: float
    residual_off: float
    fits: bool
    tip_m: float | None
    settling_s: float | None

    @property
    def duration(self) -> float:
        """What it takes of the slew, in s."""
        return self.shaper.duration if self.shaper else 0.0


@dataclass(frozen=True)
class ProfileNeed:
    """What the rigid arm needs to follow a profile.

    Attributes
    ----------
    name : str
    torque : float
        In N·m.
    voltage : float or None
        In V, where there is a motor.
    least_s : float
        Shortest duration within the limits of motor and actuator; zero without any.
    """

    name: str
    torque: float
    voltage: float | None
    least_s: float


@dataclass(frozen=True, eq=False)
class Shaping(Tabular):
    """Shapers and profiles for one loop and one slew, side by side.

    Attributes
    ----------
    slew : Slew
        Without shaper and conditions.
    modes : tuple of Mode
        What the loop leaves ringing.
    commands : tuple of ShapedCommand
    profiles : tuple of ProfileNeed
    error : float
        Relative error of the frequencies behind `ShapedCommand.residual_off`.
    left_out : mapping of str to str
        Shapers that these modes have not got, and why.
    """

    slew: Slew
    modes: tuple[Mode, ...]
    commands: tuple[ShapedCommand, ...]
    profiles: tuple[ProfileNeed, ...]
    error: float
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def caption(self) -> str:
        """The slew, and the modes."""
        told = ", ".join(
            f"{mode.frequency / (2 * np.pi):.4g} Hz (ζ = {mode.ratio:.2g})" for mode in self.modes
        )
        return (
            f"a slew of {self.slew.angle_deg:g} degrees in {self.slew.duration_s:g} s, "
            f"shaped for {told}"
        )

    def rows(self) -> list[dict[str, object]]:
        """Return one row a shaper."""
        off = f"residual at ±{100 * self.error:g} %"
        return [
            {
                "shaper": c.name,
                "duration (s)": c.duration,
                "impulses": len(c.shaper.times) if c.shaper else 1,
                "residual": c.residual,
                off: c.residual_off,
                "tip left (m)": c.tip_m,
                "settled (s)": c.settling_s,
            }
            for c in self.commands
        ]

    def sensitivity(self, name: str) -> tuple[Array, Array]:
        """Return relative errors of all frequencies, and the worst residual of a shaper there.

        Parameters
        ----------
        name : str
            Of one of `commands`.
        """
        (command,) = (c for c in self.commands if c.name == name)
        off = np.linspace(-_SPREAD, _SPREAD, _CURVE)
        return off, _worst(command.shaper, self.modes, 1 + off)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the residual of each shaper against the error of the frequencies."""
        ax = axes_or_new(ax)
        for command in self.commands:
            if command.shaper is not None:
                off, left = self.sensitivity(command.name)
                ax.plot(100 * off, 100 * left, label=command.name)
        ax.set_xlabel("error of all frequencies (%)")
        ax.set_ylabel("residual (%)")
        ax.legend()
        return ax


def compare_commands(
    loop: Loop,
    slew: Slew,
    *,
    modes: int | None = None,
    error: float = 0.1,
    progress: Callable[[str], None] | None = None,
) -> Shaping:
    """Return shapers and profiles for a loop side by side, simulated on its model.

    Parameters
    ----------
    loop : Loop
        Stable; its model is what moves, linear and without limits.
    slew : Slew
        Its angle, duration and profile.
    modes : int, optional
        How many are shaped; by default as many as the slew says, or one.
    error : float
        Relative error of the frequencies that the robust shaper is made for, and that the
        table tells of.
    progress : callable, optional
        Called with a short text before each shaper is made, and before its slew.

    Returns
    -------
    Shaping

    Raises
    ------
    InputError
        If the drive cannot make the rigid arm follow the slew, with the time that works, or
        the loop has fewer modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> shaping = sc.compare_commands(loop, sc.Slew(30.0, 4.0))
    >>> [command.name for command in shaping.commands][:4]
    ['none', 'zv', 'mzv', 'zvd']
    """
    check_error(error, "error")
    plain = replace(slew, shaper=None, modes=None, conditions=Conditions())
    require_feasible(loop, plain)
    ringing = tuple(ringing_modes(loop, modes or slew.modes or 1))
    made: list[tuple[str, Shaper | None]] = [("none", None)]
    T = loop.sample_time if isinstance(loop, SampledLoop) else None
    makers: dict[str, Callable[[], Shaper]] = {
        kind: partial(shaper, kind, ringing) for kind in SHAPERS
    }
    if T is not None:
        makers["sampled"] = partial(sampled_shaper, ringing, T, order=2)
    makers[ROBUST] = partial(robust_shaper, bands_of(ringing, error), sample_time=T)
    left_out = {}
    said = progress or (lambda _: None)
    for name, make in makers.items():
        said(f"shaper {name}")
        try:
            made.append((name, make()))
        except InputError as refusal:  # such as a mode that is damped enough by itself
            left_out[name] = refusal.what
    commands = []
    for name, one in made:
        said(f"slew {name}")
        commands.append(_command(loop, plain, name, one, ringing, error))
    return Shaping(plain, ringing, tuple(commands), _profiles(loop, plain), error, left_out)


def _command(
    loop: Loop, slew: Slew, name: str, made: Shaper | None, modes: tuple[Mode, ...], error: float
) -> ShapedCommand:
    nominal, *off = _worst(made, modes, np.array([1.0, 1 - error, 1 + error])).tolist()
    fits = made is None or made.duration < slew.duration_s
    summary = simulate(loop, replace(slew, shaper=made)).summary if fits else None
    return ShapedCommand(
        name,
        made,
        nominal,
        max(off),
        fits,
        summary.residual_m if summary else None,
        summary.settling_time_s if summary else None,
    )


def _worst(made: Shaper | None, modes: tuple[Mode, ...], factors: Array) -> Array:
    if made is None:
        return np.ones(len(factors))
    left = [made.residual(mode.frequency * factors, mode.ratio) for mode in modes]
    return np.asarray(np.max(left, axis=0))


def _profiles(loop: Loop, slew: Slew) -> tuple[ProfileNeed, ...]:
    found = []
    for name in PROFILES:
        turn = replace(slew, profile=name)
        found.append(ProfileNeed(name, *rigid_needs(loop, turn), least_duration(loop, turn)))
    return tuple(found)
