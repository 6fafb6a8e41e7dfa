"""A continuous controller around the arm, limited, and under conditions."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design.anti_windup import anti_windup
from slewctl.loop.closed import Loop
from slewctl.loop.motion.continuous_motion import tracking_system
from slewctl.loop.motion.pushed_arm import AT_MOTOR, COMMAND, ON_HUB, PUSHES, PushedArm
from slewctl.loop.motion.slew_inputs import Slew, told
from slewctl.loop.motion.stepwise import Times, Track, Walk, load_times
from slewctl.trajectory.shapers import Shaper

# References at the ends of a step are taken this part of it inside, on its side of a jump.
_INSIDE = 1e-9


def continuous_track(loop: Loop, slew: Slew, step: float) -> Track:
    """Return what a continuous loop does during a slew.

    Parameters
    ----------
    loop : Loop
    slew : Slew
        With its shaper made.
    step : float
        The longest one in s.
    """
    arm = PushedArm(loop, slew.conditions)
    times = Times.of([load_times(slew), _kinks(slew)], slew.end, step)
    system = tracking_system(loop)
    B = np.zeros((len(system.A), PUSHES))
    B[: len(arm.A)] = arm.B
    walk = Walk(arm, system.A, B, times)
    return _Closed(walk, loop, slew, system.B).walked()


def _kinks(slew: Slew) -> Array:
    shifts = slew.shaper.times if isinstance(slew.shaper, Shaper) else (0.0,)
    return np.unique(np.add.outer(shifts, slew.turn.kinks))


class _Closed:
    """The loop with its references; the command that is taken from it is a push more."""

    def __init__(self, walk: Walk, loop: Loop, slew: Slew, entering: Array) -> None:
        self._walk, arm = walk, walk.arm
        n, m = len(arm.A), walk.size
        _, _, Ck, Dk = loop.controller.linear.matrices
        t, spans = walk.times.t[:-1], walk.spans
        within = np.array([_INSIDE, 0.5, 1 - _INSIDE])
        at = t[:, None] + spans[:, None] * within
        inputs = told(loop)
        references = np.asarray(slew.reference(at.ravel()))
        given = (inputs @ references).T.reshape(len(t), 3, -1)
        if slew.conditions.noise:
            size = [loop.objective.noise[name] for name in loop.controller.sensors]
            drawn = walk.generator(1).standard_normal((len(t), len(size)))
            held = drawn * np.array(size) / np.sqrt(np.where(spans > 0, spans, np.inf))[:, None]
            given[:, :, :-1] -= held[:, None]
        added = np.zeros((len(t), 3, m + PUSHES))
        added[:, :, :m] = given @ entering.T
        self._added = added
        self._row = np.concatenate([(Dk @ arm.C)[0], Ck[0]])
        self._of_references = given @ np.append(-Dk[0], 1.0)
        entry = anti_windup(loop.controller)[0]
        if not slew.conditions.anti_windup:
            entry = np.zeros_like(entry)
        self._lost = np.concatenate([arm.B[:, COMMAND], entry, np.zeros(PUSHES)])
        self._n, self._m = n, m

    def _command(self, z: Array, i: int, stage: int) -> tuple[float, float]:
        """Return what the law asks for, and what the drive makes of it."""
        n, m = self._n, self._m
        x = self._walk.arm.slowed(z[:n])
        row = self._row
        asked = float(row[:n] @ x + row[n:] @ z[n:m] + self._of_references[i, stage])
        return asked, self._walk.limits.held(asked, self._walk.arm.rotor_rate(z))

    def walked(self) -> Track:
        """Return the track."""
        walk, m = self._walk, self._m
        arm, t, spans = walk.arm, walk.times.t, walk.spans.tolist()
        size, loads = len(t), walk.loads(t)
        disturbance = walk.disturbance
        kept, commands, friction = np.zeros((size, m + PUSHES)), np.zeros((size, 2)), np.zeros(size)
        z = np.zeros(m + PUSHES)
        plain, limited = arm.linear, walk.limits.on
        i = 0

        def remainder(z: Array, stage: int) -> Array:
            found = self._added[i, stage]
            if not plain:
                found = found + arm.remainder(z, walk.whole)
            if limited:
                asked, held = self._command(z, i, stage)
                if held != asked:
                    found = found + self._lost * (held - asked)
            return np.asarray(found)

        for i in range(size - 1):
            z[m + ON_HUB :] = loads[i]
            z[m + AT_MOTOR] = disturbance[i]
            commands[i], kept[i] = self._command(z, i, 0), z
            h = spans[i]
            if not h:
                continue
            z = walk.steps.step(z, h, remainder)
            if walk.rubs:
                z, friction[i] = walk.rub(z, h)
        kept[-1] = z
        commands[-1] = self._command(z, size - 2, 2)
        asked, held = commands.T
        return Track.of(walk.times, kept[:, : self._n], asked, held, friction)
