"""The numbers that a computer runs a controller with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array


@dataclass(frozen=True)
class Arithmetic:
    """Single precision, or words of whole numbers with a fraction each.

    A word s of a signal with f fraction bits stands for s·2^(−f) of the signal's unit.  The
    rows of [A − I, B; C, D], in words, are whole numbers over 2^shift; every row is summed up
    in a word of twice the length, which cannot overflow, and rounded once.

    Attributes
    ----------
    kind : {"float", "fixed"}
    word : int
        Bits of a word, the sign included; zero for single precision.
    readings, states : tuple of int
        Fraction bits of each.
    command, angle : int
        Fraction bits of the command and of the reference angle.
    shifts : tuple of int
        Of each row, the command's last.
    """

    kind: Literal["float", "fixed"]
    word: int = 0
    readings: tuple[int, ...] = ()
    states: tuple[int, ...] = ()
    command: int = 0
    angle: int = 0
    shifts: tuple[int, ...] = ()

    def __str__(self) -> str:
        if self.kind == "float":
            return "single precision"
        return f"words of {self.word} bits"

    @property
    def largest(self) -> int:
        """The largest whole number of a word; the smallest is its negative."""
        return int(2 ** (self.word - 1) - 1)

    @property
    def noise(self) -> tuple[Array, Array, float] | None:
        """Variances that rounding adds: to the readings, the states and the command.

        Those of a uniform error of one step; None of single precision, whose steps are relative.
        """
        if self.kind == "float":
            return None
        steps = [np.ldexp(1.0, -np.array(bits, dtype=int)) ** 2 / 12
                 for bits in (self.readings, self.states, [self.command])]  # fmt: skip
        return steps[0], steps[1], float(steps[2][0])
