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
    """

    inputs: list[Any]
    command: Any
    fault: int
    states: tuple[Any, ...]


def trial(program: Program, steps: int) -> list[Sample]:
    """Return what a program answers from rest, step by step.

    Parameters
    ----------
    program : Program
    steps : int
    """
    rng = np.random.default_rng(_SEED)
    walk = np.cumsum(rng.standard_normal((steps, len(program.amplitudes) - 1)), axis=0)
    # Slow and of the size that the loop has.
    signals = np.tanh(walk / 8) * program.amplitudes[:-1]
    wanted = rng.uniform(-_BEYOND, _BEYOND, steps) * program.amplitudes[-1]
    runner, samples = Runner(program), []
    for k, (row, target) in enumerate(zip(signals, wanted, strict=True)):
        *y, angle = _numbers(program, row)
        # Open loop the law would drift to its limit and stay there: the feedforward leads it.
        feedforward = _feedforward(program, target, runner.law(y, angle))
        if k % _NONE_EVERY == _NONE_EVERY - 1:
            y[-1] = -program.words.largest - 1 if program.words else float("nan")
        command = runner.step(y, angle, feedforward)
        samples.append(Sample([*y, angle, feedforward], command, runner.fault, tuple(runner.x)))
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
