"""Dry friction at the hub of a log: its size is linear, its sign that of a rate nobody measured.

The sign comes from the rig itself, simulated with the friction known so far and led by the log as
a Kalman filter does: differences of a noisy, rounded angle have the wrong one wherever the hub is
slow, and noise in common with the angle.  Friction that changes within a sample counts as it acts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.measured.rig_model import HeldRig, Modes, equations, hold
from slewctl.numerics.discrete_equations import solve_discrete_riccati
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.statespace import Actuator

STEPS = 6
"""Steps of a sample in which dry friction is held."""
RUBBED = "theta_dot"
"""The rate whose sign dry friction has."""
# What the filter doubts: so much of the friction, from sample to sample anew.
_DOUBT = 0.1


def at_the_drive(arm: Arm, actuator: Actuator, sensor: str, modes: Modes) -> Array:
    """Return the column of B of what acts where the actuator does, without its lags, shape (n,).

    Of `equations`, whose states are the arm's, the actuator's lags and the sensor's.
    """
    system = equations(arm, actuator, sensor, modes)
    lags = len(arm.drive.lags[0])
    if not lags:
        return system.B[:, 0]
    direct = equations(replace(arm, actuator=None), actuator, sensor, modes).B[:, 0]
    return np.insert(direct, [len(direct) - len(arm.sensor(sensor).lags[0])] * lags, 0.0)


def pushes(system: LinearSystem, column: Array, sample_time: float) -> Array:
    """Return what one in each step of a sample makes of the state at its end, shape (n, steps).

    Parameters
    ----------
    system : LinearSystem
    column : ndarray, shape (n,)
        Of B, where friction acts.
    sample_time : float
    """
    across, last = hold(system.A, column, sample_time / STEPS)
    found = [last]
    for _ in range(STEPS - 1):
        found.append(across @ found[-1])
    return np.column_stack(found[::-1])


@dataclass(frozen=True, eq=False)
class Rubbing:
    """A rig in discrete steps with dry friction that stops its hub and does no more.

    Attributes
    ----------
    whole, fine : HeldRig
        Over a sample, and over a step of one.
    rate : ndarray, shape (n,)
        Row of the hub's rate.
    push, nudge : ndarray, shape (n,)
        What a friction of one makes of the state over a sample, and over a step.
    gain : ndarray, shape (n,)
        Of the filter: what an error of the reading moves.
    """

    whole: HeldRig
    fine: HeldRig
    rate: Array
    push: Array
    nudge: Array
    gain: Array

    @classmethod
    def of(
        cls, system: LinearSystem, column: Array, sample_time: float, delay: float,
        dry: float, noise: float,
    ) -> Rubbing:  # fmt: skip
        """Return the rig of a continuous system whose last output is the hub's rate.

        Parameters
        ----------
        system : LinearSystem
        column : ndarray, shape (n,)
            Of B, where friction acts.
        sample_time, delay : float
            In s.
        dry, noise : float
            Friction, which is not known well, and the deviation of the reading.

        Raises
        ------
        AccuracyError
            If there is no filter to working precision, as beside readings without noise.
        """
        h = sample_time / STEPS
        whole = HeldRig.of(system, sample_time, delay)
        each = pushes(system, column, sample_time)
        push = each.sum(axis=1)
        gain = _filter(whole, push * (_DOUBT * dry), noise)
        return cls(whole, HeldRig.of(system, h, delay), system.C[-1], push, each[:, -1], gain)

    def signs(self, told: Array, read: Array, dry: float) -> Array:
        """Return the friction in each step over its largest, -1 to 1, shape (n, steps).

        Parameters
        ----------
        told, read : ndarray, shape (n,)
            Input, its gain included, and reading.
        dry : float
            Largest friction, in the actuator's unit.
        """
        return self._moved(told, dry, read)[1]

    def simulated(self, told: Array, dry: float) -> tuple[Array, Array]:
        """Return readings without noise, from rest, and the friction in each step as `signs` does.

        Parameters
        ----------
        told : ndarray, shape (n,)
            Input, its gain included.
        dry : float
            Largest friction, in the actuator's unit.
        """
        return self._moved(told, dry, None)

    def _moved(self, told: Array, dry: float, read: Array | None) -> tuple[Array, Array]:
        d, late = self.whole.whole, self.fine.whole
        u = np.concatenate([np.zeros(d + 1), told])
        v = np.concatenate([np.zeros(late + 1), np.repeat(told, STEPS)])
        stops, halts = dry * float(self.rate @ self.push), dry * float(self.rate @ self.nudge)
        x = np.zeros(len(self.rate))
        found, seen = np.empty((len(told), STEPS)), np.empty(len(told))
        for k in range(len(told)):
            seen[k] = self.whole.output @ x
            if read is not None:
                x = x + self.gain * (read[k] - seen[k])
            free = self.whole.transition @ x + self.whole.now * u[k + 1] + self.whole.before * u[k]
            before, after = self.rate @ x, self.rate @ free
            if abs(after) >= stops and before * after > 0:
                found[k] = np.sign(after)
                x = free - self.push * (dry * np.sign(after))
                continue
            for m in range(STEPS):
                at = STEPS * k + m
                before = self.rate @ x
                x = self.fine.transition @ x + self.fine.now * v[at + 1] + self.fine.before * v[at]
                found[k, m] = mean_sign(float(before), float(self.rate @ x), halts)
                x = x - self.nudge * (dry * found[k, m])
        return seen, found


def mean_sign(before: float, free: float, halts: float) -> float:
    """Return the mean of dry friction over a step, -1 to 1.

    Parameters
    ----------
    before, free : float
        Rate at its start, and at its end if there were no friction.
    halts : float
        The rate that friction takes in a step.
    """
    side = 1.0 if before > 0 or (before == 0 and free > 0) else -1.0
    slope = side * (free - before)
    if side * free >= halts:
        return side
    # It stands after this part of the step; then it stays, or turns back.
    part = side * before / (halts - slope)
    return side * (part + (1 - part) * min(max(slope / halts, -1.0), 1.0))


def _filter(rig: HeldRig, push: Array, noise: float) -> Array:
    """Return the gain of the stationary Kalman filter of a rig that is pushed by white noise."""
    C, w = rig.output[None], push / noise  # in units in which the noise is one
    P = solve_discrete_riccati(rig.transition.T, C.T, np.outer(w, w), np.ones((1, 1))).X
    return np.asarray((P @ C.T / (C @ P @ C.T + 1))[:, 0])
