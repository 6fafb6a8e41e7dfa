"""The shaper of a slew, made for what the loop itself would leave vibrating.

A loop answers its reference with its own poles.  Of those that oscillate a shaper is made for
the ones that move the tip most when the reference steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slewctl.errors import InputError, check_count
from slewctl.loop.closed import Loop
from slewctl.loop.motion.continuous_motion import tracking_system
from slewctl.loop.motion.slew_inputs import ROBUST, TIP, WATCHED, Slew, signals, told
from slewctl.loop.sampled import SampledLoop
from slewctl.plant import arm_signals
from slewctl.trajectory.robust_shaper import bands_of, robust_shaper
from slewctl.trajectory.sampled_shaper import sampled_shaper
from slewctl.trajectory.shapers import Mode, Shaper, shaper

# How far off frequencies may be for a robust shaper that nobody asked more of.
_ERROR = 0.1
# Damping ratio beyond which nothing rings that a shaper could help.
_RINGING = 0.5
# Least of a mode's share of the largest that is more than rounding.
_SHARE = 1e-9


def shaped(slew: Slew, loop: Loop) -> Slew:
    """Return a slew with its shaper made for a loop; one that needs none as it is.

    Parameters
    ----------
    slew : Slew
    loop : Loop
        Stable.

    Returns
    -------
    Slew

    Raises
    ------
    InputError
        If the loop has fewer modes that vibrate, its clock is too slow for one of them, or the
        shaper takes longer than the slew.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> len(shaped(sc.Slew(30.0, 4.0, shaper="zv"), loop).shaper.times)
    2
    """
    if not isinstance(slew.shaper, str):
        return slew
    modes = ringing_modes(loop, slew.modes or 1)
    T = loop.sample_time if isinstance(loop, SampledLoop) else 0.0
    fastest = min(modes, key=lambda mode: mode.half_period)
    if fastest.half_period / 2 < T:
        raise InputError(
            f"{T:g} s is too slow a clock to shape a mode of {fastest.damped / (2 * np.pi):.4g} Hz",
            where="slew.shaper",
            remedy=f"sample every {0.999 * fastest.half_period / 2:.3g} s, or shape fewer modes",
        )
    made: Shaper
    if slew.shaper == "sampled":
        if not T:
            raise InputError(
                "a continuous law has no clock to put impulses on",
                where="slew.shaper",
                remedy="give the controller a sample_time, or take another shaper",
            )
        made = sampled_shaper(modes, T, order=2)
    elif slew.shaper == ROBUST:
        error = _ERROR if slew.frequency_error is None else slew.frequency_error
        made = robust_shaper(bands_of(modes, error), sample_time=T or None)
    else:
        made = shaper(slew.shaper, modes)
    return replace(slew, shaper=made, modes=None, frequency_error=None)


def ringing_modes(loop: Loop, count: int) -> list[Mode]:
    """Return the modes of a loop that a step of its reference leaves ringing most.

    Parameters
    ----------
    loop : Loop
        Stable.
    count : int

    Returns
    -------
    list of Mode
        Slowest first.

    Raises
    ------
    InputError
        If there are not so many, or the loop is unstable.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> len(ringing_modes(loop, 2))
    2
    """
    check_count(count, "slew.modes")
    loop.require_stable("modes to shape a command for")
    tip = signals(loop)[TIP]
    step = told(loop)[:, 0]
    if isinstance(loop, SampledLoop):
        A, K = loop.closed.A, loop.controller.linear
        added = float(step[-1] - K.D[0] @ step[:-1])
        entering = np.concatenate([loop.sampled.B[:, 0] * added, -K.B @ step[:-1]])
        watched = arm_signals(loop.plant, WATCHED)
        row = np.zeros(len(A))
        row[: watched.nstates] = tip @ watched.C
        away = 1.0
    else:
        system = tracking_system(loop)
        A, entering, row, away = system.A, system.B @ step, tip @ system.C, 0.0
    poles, vectors = np.linalg.eig(A)
    shares = (row @ vectors) * np.linalg.solve(vectors, entering.astype(complex))
    shares = np.abs(shares / (poles - away))
    if isinstance(loop, SampledLoop):
        same = np.abs(poles[:, None] - loop.closed.poles).argmin(axis=1)
        poles = loop.equivalents[same]
        shares, poles = shares[np.isfinite(poles)], poles[np.isfinite(poles)]
    ratios = -poles.real / np.abs(poles)
    floor = _SHARE * shares.max()
    found = np.flatnonzero((poles.imag > 0) & (ratios < _RINGING) & (shares > floor))
    if len(found) < count:
        raise InputError(
            f"of the loop {len(found)} modes ring when it is turned, not {count}",
            where="slew.modes",
            remedy=f"shape {len(found)} of them" if len(found) else "leave the shaper out",
        )
    chosen = poles[found[np.argsort(-shares[found])][:count]]
    chosen = chosen[np.argsort(np.abs(chosen))]
    return [Mode(float(abs(pole)), float(max(-pole.real / abs(pole), 0.0))) for pole in chosen]
