"""A slew step by step: the loop's states at the end of each step, and what was held over it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, BoolArray, IntArray
from slewctl.errors import AccuracyError, InputError, check_positive
from slewctl.loop.closed import Loop
from slewctl.loop.motion.exponential_steps import ExponentialSteps
from slewctl.loop.motion.pushed_arm import AT_MOTOR, PUSHES, Limits, PushedArm
from slewctl.loop.motion.slew_inputs import Slew
from slewctl.plant.signals import TORQUE

# A step takes at most this part of a period of the mode of this number …
_OF_A_PERIOD, _MODE = 20, 3
# … and of the slew, and so many at least see anything of it.
_OF_THE_SLEW, _AT_LEAST = 200, 20
# More steps than anybody waits for.
_MOST = 2_000_000
# Parts of a step by which two times of it may differ and are one.
_SAME = 1e-9


def longest_step(loop: Loop, slew: Slew) -> float:
    """Return how long a step may be in s."""
    omega = loop.model.omega
    period = 2 * math.pi / float(omega[min(_MODE, len(omega)) - 1])
    return min(period / _OF_A_PERIOD, slew.duration_s / _OF_THE_SLEW)


def check_step(step: float, slew: Slew) -> float:
    """Return a longest step in s; refuse one in which a slew would hardly be seen."""
    most = slew.duration_s / _AT_LEAST
    if check_positive(step, "step") > most:
        raise InputError(
            f"what happens is read at the ends of steps: {step:g} s are too long for a slew of "
            f"{slew.duration_s:g} s",
            where="step",
            remedy=f"give at most {most:.3g} s, or none",
        )
    return float(step)


@dataclass(frozen=True, eq=False)
class Times:
    """The times of a simulation, and what happens at each: its kind, and its number among them."""

    t: Array
    kind: IntArray
    number: IntArray

    @classmethod
    def of(cls, marks: Sequence[Array], end: float, longest: float) -> Times:
        """Return times with marks of each kind, cut into steps of at most `longest`.

        Parameters
        ----------
        marks : sequence of ndarray
            Times of each kind; of one time the first kind comes first.
        end : float
        longest : float
            In s.
        """
        if end / longest > _MOST:
            raise AccuracyError(
                f"{end:g} s are more than {_MOST} steps of {longest:.3g} s",
                where="simulate",
                remedy="simulate a shorter time (slew.horizon_s), or give a longer step",
            )
        fill = len(marks)
        each = [*marks, np.array([0.0, end])]
        t = np.concatenate(each)
        kind = np.concatenate([np.full(len(times), k) for k, times in enumerate(each)])
        number = np.concatenate([np.arange(len(times)) for times in each])
        kept = t <= end * (1 + _SAME)
        t, kind, number = t[kept], kind[kept], number[kept]
        order = np.lexsort((kind, np.round(t / (_SAME * longest))))
        t, kind, number = t[order], kind[order], number[order]
        parts = np.maximum(np.ceil(np.diff(t) / longest - _SAME).astype(int), 1)
        first = np.cumsum(parts) - parts
        size = int(parts.sum())
        within = np.arange(size) - np.repeat(first, parts)
        cut = np.repeat(t[:-1], parts) + within * np.repeat(np.diff(t) / parts, parts)
        whole = np.where(within == 0, np.repeat(kind[:-1], parts), fill)
        which = np.where(within == 0, np.repeat(number[:-1], parts), 0)
        return cls(np.append(cut, t[-1]), np.append(whole, kind[-1]), np.append(which, number[-1]))

    @property
    def spans(self) -> Array:
        """Length of the step after each time but the last; zero where two things fall together."""
        spans = np.diff(self.t)
        longest = spans.max()
        return np.where(spans > _SAME * longest, spans, 0.0)


@dataclass(frozen=True, eq=False)
class Track:
    """What happened: row i holds from t[i] to t[i + 1].

    Attributes
    ----------
    t : ndarray, shape (N,)
    states : ndarray, shape (N, n)
        Of the arm, lags and all, in modes and momenta.
    command, applied : ndarray, shape (N,)
        Of the controller, and of the drive.
    friction : ndarray, shape (N,)
        Torque of dry friction over the step, in N·m.
    """

    t: Array
    states: Array
    command: Array
    applied: Array
    friction: Array

    @classmethod
    def of(
        cls, times: Times, states: Array, command: Array, applied: Array, friction: Array
    ) -> Track:
        """Return what happened, of times at which several things do the last row alone."""
        last = np.append(times.spans > 0, True)
        rubbed = np.array(friction)
        rubbed[-1] = friction[:-1][last[:-1]][-1]
        return cls(times.t[last], states[last], command[last], applied[last], rubbed[last])

    @property
    def limited(self) -> BoolArray:
        """Whether the command became another."""
        size = np.maximum(np.abs(self.command), np.abs(self.applied))
        return np.asarray(np.abs(self.command - self.applied) > _SAME * size)


class Walk:
    """Steps of an arm, or of an arm with its controller, with friction that sticks exactly.

    Parameters
    ----------
    arm : PushedArm
    A, B : ndarray, shapes (m, m), (m, PUSHES)
        The first states are the arm's.
    times : Times
    """

    def __init__(self, arm: PushedArm, A: Array, B: Array, times: Times) -> None:
        self.arm, self.times, self.spans = arm, times, times.spans
        self.size = len(A)
        whole = np.zeros((self.size + PUSHES, self.size + PUSHES))
        whole[: self.size, : self.size], whole[: self.size, self.size :] = A, B
        self.whole = whole
        self.steps = ExponentialSteps(whole, float(self.spans.max()))
        self.limits = Limits(arm.loop, arm.conditions)
        self._slides, self._holds = arm.conditions.coulomb_friction, arm.conditions.breakaway
        self._stuck = True
        self._columns: dict[float, tuple[Array, float]] = {}
        self.disturbance = self._disturbed()

    def generator(self, number: int) -> np.random.Generator:
        """Return a stream of random numbers of its own for each purpose."""
        return np.random.default_rng([self.arm.conditions.seed or 0, number])

    def _disturbed(self) -> Array:
        """Return the disturbing torque of each step: white noise, held over it."""
        objective = self.arm.loop.objective
        if not self.arm.conditions.noise:
            return np.zeros(len(self.spans))
        drawn = self.generator(0).standard_normal(len(self.spans))
        density = objective.noise[TORQUE]
        return density * drawn / np.sqrt(np.where(self.spans > 0, self.spans, np.inf))

    def loads(self, t: Array) -> Array:
        """Return torque on the hub and force on the tip after each time, shape (N, 2)."""
        found = np.zeros((len(t), 2))
        for load in self.arm.conditions.loads:
            until = math.inf if load.until_s is None else load.until_s
            on = (t >= load.time_s - self._same) & (t < until - self._same)
            found[on] += (load.torque, load.tip_force)
        return found

    @property
    def _same(self) -> float:
        return _SAME * float(self.spans.max())

    def rub(self, z: Array, h: float) -> tuple[Array, float]:
        """Return states after a step in which dry friction acted too, and its torque.

        The friction that brings the end of the step to rest is taken where it is small enough:
        so the arm sticks, and slides in the wrong direction nowhere (Moreau's time stepping).
        """
        column, gain = self._pushed(h)
        free = self.arm.rotor_rate(z)
        if math.isnan(gain):
            gain = self.arm.rotor_rate(z + column) - free
        torque = -free / gain
        self._stuck = abs(torque) <= (self._holds if self._stuck else self._slides)
        if not self._stuck:
            torque = math.copysign(self._slides, torque)
        return z + torque * column, torque

    def _pushed(self, h: float) -> tuple[Array, float]:
        """Return what a unit torque adds to the states in a step, and to the rotor's rate.

        With large deflections that depends on where the arm is, and is not a number.
        """
        if h not in self._columns:
            column = self.steps.map(h)[:, self.size + AT_MOTOR]
            gain = math.nan if self.arm.equations else self.arm.rotor_rate(column)
            self._columns[h] = column, gain
        return self._columns[h]

    @property
    def rubs(self) -> bool:
        """Whether there is dry friction."""
        return self._holds > 0


def load_times(slew: Slew) -> Array:
    """Return when a load begins or ends."""
    found = [load.time_s for load in slew.conditions.loads]
    found += [load.until_s for load in slew.conditions.loads if load.until_s is not None]
    return np.array(found, dtype=float)
