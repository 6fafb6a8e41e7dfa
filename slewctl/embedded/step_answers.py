"""The controller that a compiled program is: read out of it, and compared with it step by step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.design.reference import Reference
from slewctl.embedded.compiled import Compiled
from slewctl.embedded.program import Program
from slewctl.embedded.rows import ANGLE, READING, STATE, rows_of
from slewctl.embedded.trial import trial
from slewctl.errors import AccuracyError
from slewctl.numerics.linear_system import LinearSystem

# Steps in which a program and its compiled form must agree in every bit.
_STEPS = 2000
# Halvings after which an input would be too small for any limit.
_MOST_HALVINGS = 200
# Numbers from a half to one over which rounding is averaged.
_PARTS = 256


def read_back(program: Program, compiled: Compiled) -> Controller:
    """Return the controller that a compiled program is.

    Its A, B, C and D are read by stepping it from unit states and with unit inputs, where no
    limit is met.  What a limit and the states behind it do is compared step by step, and so is
    the answer to readings that are none.

    Parameters
    ----------
    program : Program
    compiled : Compiled

    Returns
    -------
    Controller

    Raises
    ------
    AccuracyError
        If the compiled program does not do what the program does, to the last bit.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.embedded import CodeOptions, compile_program, program_of, read_back
    >>> program = program_of(problem.judge(K), CodeOptions(), "arm")
    >>> problem.judge(read_back(program, compile_program(program))).stable  # doctest: +SKIP
    True
    """
    compare_steps(program, compiled)
    n, m = program.system.nstates, program.system.ninputs
    columns = [_column(program, compiled, k) for k in range(n + m + 1)]
    whole = np.array(columns).T
    A, B, Br = whole[:n, :n], whole[:n, n : n + m], whole[:n, n + m :]
    C, D, Dr = whole[n:, :n], whole[n:, n : n + m], whole[n:, n + m :]
    given = program.system
    read = LinearSystem(
        A, B, C, D, given.dt, inputs=given.input_labels, outputs=given.output_labels,
        states=given.state_labels, name=given.name,
    )  # fmt: skip
    return replace(program.controller, system=read, reference=Reference(Br, Dr))


def _column(program: Program, compiled: Compiled, k: int) -> Array:
    """Return what becomes of one state, reading or reference angle, per unit of it."""
    words = program.words
    if words is None:
        return _of_numbers(program, compiled, k)
    bits = [*words.states, *words.readings, words.angle]
    out = np.array([*words.states, words.command])
    return np.asarray(np.ldexp(_of_words(program, compiled, k), bits[k] - out))


def _answer(program: Program, compiled: Compiled, k: int, value: Any) -> list[Any]:
    """Return the next states and the command from one state, or one input, and all else zero."""
    n, m = program.system.nstates, program.system.ninputs
    compiled.init(0)
    states, inputs = [0] * n, [0] * (m + 1)
    if k < n:
        states[k] = value
    else:
        inputs[k - n] = value
    compiled.x = states
    command = compiled.step(inputs[:m], inputs[m], 0)
    return [*compiled.x, command]


def _small(program: Program, at: Callable[[Any], list[Any]], value: Any, half: Any) -> Any:
    """Return a value that is small enough for the command to be short of its limit."""
    limit = rows_of(program).limit
    for _ in range(_MOST_HALVINGS):
        command = abs(at(value)[-1])
        if command < (limit if limit is not None else math.inf) and value:
            return value
        value = half(value)
    raise _different("it is at its limit whatever it reads")


def _of_numbers(program: Program, compiled: Compiled, k: int) -> Array:
    def at(value: float) -> list[Any]:
        return _answer(program, compiled, k, value)

    n, unit = program.system.nstates, _small(program, at, 1.0, lambda size: size / 2)
    # A power of two changes no digit.  A state that is added to is rounded, in single precision
    # by more than its coefficient is: by how much differs from number to number.
    tried = [unit]
    if k < n and program.controller.arithmetic is not None:
        tried = [unit * (1 - part / (2 * _PARTS)) for part in range(_PARTS)]
    found = np.array([at(value) for value in tried], dtype=float)
    return np.asarray(np.array(tried) @ found / np.sum(np.square(tried)))


def _of_words(program: Program, compiled: Compiled, k: int) -> Array:
    """Return a column of factors between words, to more digits than one step shows.

    An answer is a product rounded to the nearest: where it changes from one word to the next
    the product is half between them.  A factor that was written, and is where the answers say,
    is that factor: so many steps agreed with it in every bit.
    """
    n = program.system.nstates
    words = program.words
    if words is None:
        raise TypeError("a program in words")

    def at(value: int) -> list[int]:
        found = _answer(program, compiled, k, value)
        return [found[i] - (value if i == k else 0) for i in range(n)] + [found[-1]]

    largest = _small(program, at, words.largest // 2, lambda size: size // 2)
    found = at(largest)
    written = _written(program, k)
    factors = np.zeros(n + 1)
    for i, answer in enumerate(found):
        low, high = 0, largest  # the answer is not reached at low, and it is at high
        while answer and high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if at(middle)[i] == answer else (middle, high)
        # Between these is the factor's size.
        least = (abs(answer) - 0.5) / high if answer else 0.0
        most = (abs(answer) - 0.5) / low if answer and low else 0.5 / largest
        factors[i] = math.copysign((least + most) / 2, answer) if answer else 0.0
        if least <= abs(written[i]) <= most and written[i] * answer >= 0:
            factors[i] = written[i]
    if k < n:
        factors[k] += 1.0
    return factors


def _written(program: Program, k: int) -> Array:
    """Return the factors of one state or input in the rows, between words."""
    rows, n = rows_of(program), program.system.nstates
    of, place = [*((STATE, i) for i in range(n)),
                 *((READING, i) for i in range(program.system.ninputs)), (ANGLE, 0)][k]  # fmt: skip
    return np.array(
        [
            sum(
                math.ldexp(term.factor, -term.shift)
                for term in row
                if term.of == of and term.place == place
            )
            for row in (*rows.states, rows.command)
        ]
    )


def compare_steps(program: Program, compiled: Compiled, steps: int = _STEPS) -> None:
    """Refuse a compiled program that does not agree with the program, bit for bit.

    Parameters
    ----------
    program : Program
    compiled : Compiled
    steps : int

    Raises
    ------
    AccuracyError
    """
    compiled.init(0)
    for k, sample in enumerate(trial(program, steps)):
        *y, angle, feedforward = sample.inputs
        command = compiled.step(y, angle, feedforward)
        if command != sample.command or tuple(compiled.x) != sample.states:
            raise _different(f"in step {k} it commands {command!r} and not {sample.command!r}")
        if compiled.fault != sample.fault:
            raise _different(f"in step {k} its fault is {compiled.fault} and not {sample.fault}")
        if sample.fault:
            compiled.init(angle)


def _different(how: str) -> AccuracyError:
    return AccuracyError(
        f"the compiled program is not the one that was written: {how}",
        where="--compiled",
        remedy="compile without optimisations that change numbers, such as -ffast-math",
    )
