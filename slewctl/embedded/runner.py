"""A program run in Python, every operation in the order in which the compiled one does it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from slewctl.embedded.program import Program
from slewctl.embedded.rows import ANGLE, CUT, READING, STATE, Term, rows_of

# Factors with the places of their signals, and the shift of their sum.
_Part: TypeAlias = tuple[list[tuple[Any, int]], int]
# Why a program gives nothing any more.
FAULT_READING, FAULT_STUCK, FAULT_NUMBER = 1, 2, 4


class Runner:
    """The state of a running program.

    Parameters
    ----------
    program : Program

    Attributes
    ----------
    x : list
        States, as the program has them.
    fault : int
        Zero, or `FAULT_READING`, `FAULT_STUCK` or `FAULT_NUMBER`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.embedded import CodeOptions, Runner, program_of
    >>> runner = Runner(program_of(problem.judge(K), CodeOptions(), "arm"))
    >>> runner.init(0.5)
    >>> abs(runner.step([0.5], 0.5, 0.0)) < 1e-9
    True
    """

    def __init__(self, program: Program) -> None:
        self.rows = rows_of(program)
        self.words = program.words
        single = self.words is None and program.controller.arithmetic is not None
        self.number: Any = int if self.words else np.float32 if single else float
        self._most_missed, self._most_still = program.most_missed, program.most_still
        n, m = program.system.nstates, program.system.ninputs
        self._places = {STATE: 0, READING: n, ANGLE: n + m, CUT: n + m + 1}
        self._command = self._parts(self.rows.command)
        self._states = [self._parts(row) for row in self.rows.states]
        self.init(self.number(0))

    def init(self, angle: Any) -> None:
        """Start at rest at an angle, in rad or a word of it."""
        angle = self.number(angle)
        self.x = [self._at_rest(term, angle) for term in self.rows.start]
        self.held = [self._at_rest(term, angle) for term in self.rows.at_rest]
        self.held += [angle, self.number(0)]
        self.still = [0] * (len(self.held) - 2)
        self.missed, self.fault = 0, 0
        self.full = False

    def step(self, readings: Sequence[Any], angle: Any, feedforward: Any) -> Any:
        """Return the command, in the actuator's unit or a word of it."""
        command = self.number(0)
        if not self.fault:
            self._take([*(self.number(y) for y in readings), self.number(angle),
                        self.number(feedforward)])  # fmt: skip
        if not self.fault:
            command = self._answer()
        limit = self.rows.limit
        self.full = bool(limit is not None and not -limit < command < limit)
        return command

    def _take(self, inputs: list[Any]) -> None:
        """Hold what is a reading, and count what is none or stands still."""
        missing = False
        for k, value in enumerate(inputs):
            if -self.rows.largest <= value <= self.rows.largest:
                if k < len(self.still):
                    same = self.full and value == self.held[k]
                    self.still[k] = self.still[k] + 1 if same else 0
                    if self._most_still and self.still[k] >= self._most_still:
                        self.fault |= FAULT_STUCK
                self.held[k] = value
            else:
                missing = True
        self.missed = self.missed + 1 if missing else 0
        if self.missed > self._most_missed:
            self.fault |= FAULT_READING

    def law(self, readings: Sequence[Any], angle: Any) -> Any:
        """Return what the next command would be, whole and without a feedforward."""
        return self._sum(self._command, [*self.x, *readings, angle, self.number(0)])

    def _answer(self) -> Any:
        *y, angle, feedforward = self.held
        wanted = self.law(y, angle) + feedforward
        if not self.words and not -self.rows.largest <= wanted <= self.rows.largest:
            self.fault |= FAULT_NUMBER
            return self.number(0)
        limit = self.rows.limit
        if limit is None and self.words:
            limit = self.rows.largest
        command = wanted if limit is None else min(max(wanted, -limit), limit)
        cut = command - wanted
        signals = [*self.x, *y, angle, self._word(cut) if self.words else cut]
        self.x = [x + self._sum(row, signals) for x, row in zip(self.x, self._states, strict=True)]
        if self.words:
            self.x = [self._word(x) for x in self.x]
        return command

    def _parts(self, row: Sequence[Term]) -> list[_Part]:
        """Return a row as sums with a shift each; in words reference and cut stand alone."""
        alone = (ANGLE, CUT) if self.words else ()
        main = [term for term in row if term.of not in alone]
        groups = [[term] for term in row if term.of in alone]
        return [
            ([(term.factor, self._places[term.of] + term.place) for term in group], group[0].shift)
            for group in ([main] if main else []) + groups
        ]

    def _sum(self, parts: Sequence[_Part], signals: Sequence[Any]) -> Any:
        """Return a sum of products, from the left."""
        whole = self.number(0)
        for k, (products, shift) in enumerate(parts):
            (factor, place), *others = products
            total = factor * signals[place]
            for factor, place in others:
                total += factor * signals[place]
            if self.words:
                total = self._shifted(total, shift)
            whole = total if not k else whole + total
        return whole

    def _at_rest(self, term: Term, angle: Any) -> Any:
        product = term.factor * angle
        return self._word(self._shifted(product, term.shift)) if self.words else product

    @staticmethod
    def _shifted(value: int, shift: int) -> int:
        """Return value/2^shift, rounded to the nearest and from the middle away from zero."""
        if not shift:
            return value
        half = 1 << (shift - 1)
        return (value + half) >> shift if value >= 0 else -((half - value) >> shift)

    def _word(self, value: int) -> int:
        return int(min(max(value, -self.rows.largest), self.rows.largest))
