"""The sums that a program forms every sample, term by term, in the numbers it runs with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.digital.fixed_point import LEAST_SHIFT
from slewctl.embedded.program import Program
from slewctl.errors import DesignError

# A reading beyond it is none; it is far from where single precision ends.
LARGEST_READING = 1e30
# What a sum is taken of: states, readings, the reference, and what was cut off the command.
STATE, READING, ANGLE, CUT = "x", "y", "angle", "cut"


@dataclass(frozen=True)
class Term:
    """A coefficient times a signal.

    Attributes
    ----------
    factor : float, numpy.float32 or int
    of : str
        `STATE`, `READING`, `ANGLE` or `CUT`.
    place : int
    shift : int
        Of whole numbers: the product is over 2^shift.
    """

    factor: Any
    of: str
    place: int
    shift: int = 0


@dataclass(frozen=True)
class Rows:
    """The sums of a program.

    Attributes
    ----------
    command : tuple of Term
    states : tuple of tuple of Term
        What is added to each state.
    start : tuple of Term
        Each state at rest, of the angle.
    at_rest : tuple of Term
        Each reading there.
    limit : float, numpy.float32, int or None
        Of the command, never above the program's.
    largest : float, numpy.float32 or int
        What is more is no reading.
    """

    command: tuple[Term, ...]
    states: tuple[tuple[Term, ...], ...]
    start: tuple[Term, ...]
    at_rest: tuple[Term, ...]
    limit: Any
    largest: Any


def rows_of(program: Program) -> Rows:
    """Return the sums of a program.

    Parameters
    ----------
    program : Program

    Raises
    ------
    DesignError
        If the start or what was cut off has a coefficient that overflows a word.
    """
    return _in_words(program) if program.words else _in_floats(program)


def _matrix(program: Program) -> Array:
    """Return [A − I, B, B_r, H; C, D, D_r, 0]."""
    system, reference = program.system, program.reference
    above = np.hstack([system.A - np.eye(system.nstates), system.B, reference.B,
                       program.windup[:, None]])  # fmt: skip
    return np.vstack([above, np.hstack([system.C, system.D, reference.D, [[0.0]]])])


def _signals(program: Program) -> list[tuple[str, int]]:
    states, readings = program.system.nstates, program.system.ninputs
    return [*((STATE, k) for k in range(states)), *((READING, k) for k in range(readings)),
            (ANGLE, 0), (CUT, 0)]  # fmt: skip


def _in_floats(program: Program) -> Rows:
    single = program.controller.arithmetic is not None
    kind = np.float32 if single else float
    signals = _signals(program)

    def terms(row: Array) -> tuple[Term, ...]:
        return tuple(
            Term(kind(factor), *signal)
            for factor, signal in zip(row, signals, strict=True)
            if kind(factor)
        )

    *states, command = (terms(row) for row in _matrix(program))
    limit = None
    if math.isfinite(program.limit):
        limit = kind(program.limit)
        if float(limit) > program.limit:
            limit = np.nextafter(limit, kind(0.0))
    return Rows(
        command,
        tuple(states),
        tuple(Term(kind(value), ANGLE, 0) for value in program.start),
        tuple(Term(kind(value), ANGLE, 0) for value in program.at_rest),
        limit,
        kind(LARGEST_READING),
    )


def _in_words(program: Program) -> Rows:
    words = program.words
    if words is None:
        raise TypeError("a program in words")
    n, m = program.system.nstates, program.system.ninputs
    columns = np.array([*words.states, *words.readings])
    out = [*words.states, words.command]
    signals = _signals(program)
    rows = []
    for row, bits, shift in zip(_matrix(program), out, words.shifts, strict=True):
        factors = np.ldexp(row[: n + m], bits - columns + shift)
        whole = [round(float(factor)) for factor in factors]
        terms = [Term(k, *signal, shift) for k, signal in zip(whole, signals, strict=False)]
        terms += [
            _scaled(row[n + m], bits - words.angle, ANGLE, 0, words.word),
            _scaled(row[n + m + 1], bits - words.command, CUT, 0, words.word),
        ]
        rows.append(tuple(term for term in terms if term.factor))
    limit = None
    if math.isfinite(program.limit):
        limit = min(math.floor(math.ldexp(program.limit, words.command)), words.largest)
    return Rows(
        rows[-1],
        tuple(rows[:-1]),
        tuple(_scaled(value, bits - words.angle, ANGLE, 0, words.word)
              for value, bits in zip(program.start, words.states, strict=True)),
        tuple(_scaled(value, bits - words.angle, ANGLE, 0, words.word)
              for value, bits in zip(program.at_rest, words.readings, strict=True)),
        limit,
        words.largest,
    )  # fmt: skip


def _scaled(value: float, bits: int, of: str, place: int, word: int) -> Term:
    """Return a term with a shift of its own that fills its word."""
    factor = math.ldexp(float(value), bits)
    if not factor:
        return Term(0, of, place)
    shift = min(word - 1 - math.frexp(factor)[1], 2 * word - 2)
    if round(math.ldexp(abs(factor), shift)) >= 2 ** (word - 1):
        shift -= 1
    if shift < LEAST_SHIFT:
        raise DesignError(
            f"a coefficient of {of} overflows words of {word} bits",
            where="word",
            remedy=f"give at least {word + LEAST_SHIFT - shift}",
        )
    return Term(round(math.ldexp(factor, shift)), of, place, shift)
