"""A program tried: inputs that bring it to its limit and off it again, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl.embedded.program import Program
from slewctl.embedded.runner import Runner

# A start for the inputs: any will do.
_SEED = 1
# How far beyond its limit the command is wanted; it is cut off in a sixth of the samples.
_BEYOND = 1.2
# The reference's phase moves by as much in a sample at most, in rad.
_TURN = 0.05
# Samples by which inputs are chosen, and the part of their size below which none help.
_FIRST, _LEAST_PART = 200, 1e-6
# One in so many samples has a reading that is none.
_NONE_EVERY = 50


@dataclass(frozen=True)
class Sample:
    """One step: what goes in, and what comes out.

    Attributes
    ----------
    inputs : list
        Readings, reference angle and feedforward in the numbers of the program.
    command
    fault : int
        After it the program was started again, at the reference angle.
    states : tuple
    at_limit : bool
    """

    inputs: list[Any]
    command: Any
    fault: int
    states: tuple[Any, ...]
    at_limit: bool


def trial(program: Program, steps: int) -> list[Sample]:
    """Return what a program answers from rest, step by step.

    Parameters
    ----------
    program : Program
    steps : int
    """
    part = 1.0
    while part > _LEAST_PART:
        first = _tried(program, min(steps, _FIRST), part)
        if sum(sample.at_limit for sample in first) <= len(first) / 2:
            break
        part /= 2  # open loop it would stay at its limit
    return _tried(program, steps, part)


def _tried(program: Program, steps: int, part: float) -> list[Sample]:
    """Return the answers to a reference that moves, and readings that differ by noise from it."""
    rng = np.random.default_rng(_SEED)
    sizes, m = program.amplitudes, len(program.sensors)
    angles = np.sin(np.cumsum(rng.uniform(0, _TURN, steps))) * sizes[m] * part
    noise = rng.standard_normal((steps, m)) / 4 * sizes[:m] * part
    wanted = rng.uniform(-_BEYOND, _BEYOND, steps) * sizes[-1]
    runner, samples = Runner(program), []
    for k in range(steps):
        row = np.append(program.at_rest * angles[k] + noise[k], angles[k])
        *y, angle = _numbers(program, row)
        feedforward = _feedforward(program, wanted[k], runner.law(y, angle))
        if k % _NONE_EVERY == _NONE_EVERY - 1:
            y[-1] = -program.words.largest - 1 if program.words else float("nan")
        command = runner.step(y, angle, feedforward)
        samples.append(
            Sample([*y, angle, feedforward], command, runner.fault, tuple(runner.x), runner.full)
        )
        if runner.fault:
            runner.init(angle)
    return samples


def _numbers(program: Program, row: Any) -> list[Any]:
    words = program.words
    if words is None:
        kind = np.float32 if program.controller.arithmetic is not None else np.float64
        return [kind(value).item() for value in row]
    whole = np.rint(np.ldexp(row, np.array([*words.readings, words.angle])))
    return [int(value) for value in np.clip(whole, -words.largest, words.largest)]


def _feedforward(program: Program, target: float, law: Any) -> Any:
    words = program.words
    if words is None:
        kind = np.float32 if program.controller.arithmetic is not None else np.float64
        return kind(kind(target) - kind(law)).item()
    word = round(float(np.ldexp(target, words.command))) - law
    return int(min(max(word, -words.largest), words.largest))
