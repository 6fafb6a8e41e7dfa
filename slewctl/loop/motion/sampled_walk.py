"""A sampled controller on its clock, late, limited and missing samples, and the arm between."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slewctl._types import Array
from slewctl.design.anti_windup import anti_windup
from slewctl.loop.motion.conditions import ANGLES
from slewctl.loop.motion.pushed_arm import AT_MOTOR, COMMAND, ON_HUB, PushedArm
from slewctl.loop.motion.sampled_motion import sampled_inputs
from slewctl.loop.motion.slew_inputs import Slew
from slewctl.loop.motion.stepwise import Times, Track, Walk, load_times
from slewctl.loop.sampled import SampledLoop
from slewctl.plant.sampled import split_delay

# What can happen at a time.
_SAMPLE, _ACT = range(2)
# The clock's jitter is a multiple of this part of a sample.
_TICKS = 64
# An instant this little before a sample is that sample, relative.
_ROUNDING = 1e-9


def sampled_track(loop: SampledLoop, slew: Slew, step: float) -> Track:
    """Return what a sampled loop does during a slew.

    Parameters
    ----------
    loop : SampledLoop
    slew : Slew
        With its shaper made.
    step : float
        The longest step between two samples in s.
    """
    T, conditions = loop.sample_time, slew.conditions
    arm = PushedArm(loop, conditions)
    count = math.floor((slew.end + loop.reading_late) / T * (1 + _ROUNDING)) + 1
    clock = T * np.arange(count) + _lateness(conditions.seed, conditions.jitter, T, count)
    split_delay(T, loop.late)
    # What is read at a sample is so much older; before the slew the arm is at rest.
    read = clock - loop.reading_late
    # What is left at the slew's end is looked at there, whatever the clock.
    others = np.append(load_times(slew), slew.duration_s)
    marks = [np.maximum(read, 0.0), read + loop.late, others]
    times = Times.of(marks, slew.end, step)
    walk = Walk(arm, arm.A, arm.B, times)
    return _walked(walk, _Law(loop, slew, walk, count))


def _lateness(seed: int | None, jitter: float, T: float, count: int) -> Array:
    most = math.floor(jitter / T * _TICKS * (1 + _ROUNDING))
    if not most:
        return np.zeros(count)
    drawn = np.random.default_rng([seed or 0, 3]).integers(0, most + 1, count)
    return np.asarray(T / _TICKS * drawn)


def _walked(walk: Walk, law: _Law) -> Track:
    arm, times, n = walk.arm, walk.times, walk.size
    t, kinds, numbers = times.t, times.kind.tolist(), times.number.tolist()
    spans, size = walk.spans.tolist(), len(times.t)
    loads, disturbance = walk.loads(t), walk.disturbance.tolist()
    z = np.zeros(len(walk.whole))
    kept, commands, friction = np.zeros((size, len(z))), np.zeros(size), np.zeros(size)
    pushed, rubs, smooth = bool(arm.conditions.loads), walk.rubs, arm.linear
    linear, limits = walk.steps.map, walk.limits
    held = asked = 0.0  # what the drive was sent, and what was asked for

    def remainder(z: Array, _: int) -> Array:
        return arm.remainder(z, walk.whole)

    def ahead(z: Array, h: float) -> Array:
        return linear(h) @ z if smooth else walk.steps.step(z, h, remainder)

    for i in range(size):
        kind = kinds[i]
        if kind == _SAMPLE:
            law.run(z[:n])
        elif kind == _ACT and numbers[i] < len(law.made):
            asked, _, held = law.made[numbers[i]]
            z[n + COMMAND] = held
        if limits.of_speed:
            z[n + COMMAND] = limits.held(held, arm.rotor_rate(z))
        if pushed:
            z[n + ON_HUB :] = loads[i]
        commands[i] = asked
        kept[i] = z
        h = spans[i] if i < size - 1 else 0.0
        if not h:
            continue
        z[n + AT_MOTOR] = disturbance[i]
        z, before = ahead(z, h), z
        if limits.of_speed:
            # What is had at the end is not what was had before: half of either.
            first, last = before[n + COMMAND], limits.held(held, arm.rotor_rate(z))
            if first != last:
                before[n + COMMAND] = 0.5 * (first + last)
                z = ahead(before, h)
        if rubs:
            z, friction[i] = walk.rub(z, h)
    return Track.of(times, kept[:, :n], commands, kept[:, n + COMMAND], friction)


class _Order(NamedTuple):
    """What the law asked for, what it was told to be left with, and what the drive is sent."""

    asked: float
    held: float
    sent: float


class _Law:
    """The law from reading to command."""

    def __init__(self, loop: SampledLoop, slew: Slew, walk: Walk, count: int) -> None:
        conditions, sensors = slew.conditions, loop.controller.sensors
        self._walk = walk
        A, B, C, D = loop.controller.linear.matrices
        # One product does a sample: from [states; readings] to [states; command].
        self._matrix, self._states = np.block([[A, B], [C, D]]), len(A)
        given = sampled_inputs(loop, slew)
        self._wanted, self._added = given[:, :-1], given[:, -1].tolist()
        entry = anti_windup(loop.controller)[0] if conditions.anti_windup else np.zeros(len(A))
        self._entry = entry if conditions.limited else None
        self._rate = (
            None if conditions.rate_limit is None else (conditions.rate_limit * loop.sample_time)
        )
        self._noise = np.zeros((count, len(sensors)))
        if conditions.noise:
            size = [loop.objective.noise[name] for name in sensors]
            drawn = walk.generator(1).standard_normal(self._noise.shape)
            self._noise = drawn * np.array(size) / math.sqrt(loop.sample_time)
        self._missed = walk.generator(2).random(count) < conditions.missed
        counts = conditions.encoder_counts
        steps = 0.0 if counts is None else 2 * math.pi / counts
        self._steps = [(i, steps) for i, name in enumerate(sensors) if steps and name in ANGLES]
        self._state = np.zeros(len(A))
        self.made: list[_Order] = []

    def run(self, x: Array) -> None:
        """Read, compute, and remember the command until it acts."""
        k = len(self.made)
        before = self.made[-1] if k else _Order(0.0, 0.0, 0.0)
        if self._missed[k]:
            self.made.append(before)
            return
        reading = self._walk.arm.readings(x) + self._noise[k]
        for i, step in self._steps:
            reading[i] = step * round(reading[i] / step)
        row = min(k, len(self._added) - 1)
        found = self._matrix @ np.concatenate([self._state, reading - self._wanted[row]])
        asked = held = sent = float(found[-1]) + self._added[row]
        if self._entry is None:
            self._state = found[:-1]
        else:
            limits = self._walk.limits
            held = limits.held(asked, self._walk.arm.rotor_rate(x))
            if self._rate is not None:
                low, high = before.held - self._rate, before.held + self._rate
                held, sent = min(max(held, low), high), min(max(sent, low), high)
            self._state = found[:-1] + self._entry * (held - asked)
            if not limits.of_speed:
                sent = held
        self.made.append(_Order(asked, held, sent))
