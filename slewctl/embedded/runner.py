"""A program run in Python, every operation in the order in which the compiled one does it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slewctl.embedded.program import Program
from slewctl.embedded.rows import ANGLE, CUT, READING, STATE, Term, rows_of

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
        self.init(self.number(0))

    def init(self, angle: Any) -> None:
        """Start at rest at an angle, in rad or a word of it."""
        angle = self.number(angle)
        self.x = [self._sum((term,), angle=angle) for term in self.rows.start]
        self.held = [self._sum((term,), angle=angle) for term in self.rows.at_rest]
        if self.words:
            self.x = [self._word(x) for x in self.x]
            self.held = [self._word(y) for y in self.held]
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
        self.full = limit is not None and not -limit < command < limit
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

    def _answer(self) -> Any:
        *y, angle, feedforward = self.held
        wanted = self._sum(self.rows.command, y=y, angle=angle) + feedforward
        if self.words:
            wanted = self._word(wanted)
        elif not -self.rows.largest <= wanted <= self.rows.largest:
            self.fault |= FAULT_NUMBER
            return self.number(0)
        limit = self.rows.limit
        command = wanted if limit is None else min(max(wanted, -limit), limit)
        cut = command - wanted
        added = [self._sum(row, y=y, angle=angle, cut=cut) for row in self.rows.states]
        self.x = [x + more for x, more in zip(self.x, added, strict=True)]
        if self.words:
            self.x = [self._word(x) for x in self.x]
        return command

    def _sum(self, row: Sequence[Term], y: Sequence[Any] = (), angle: Any = 0, cut: Any = 0) -> Any:
        """Return a sum of products from the left; of words, of each part with its own shift."""
        if self.words:
            main = [term for term in row if term.of in (STATE, READING)]
            alone = [[term] for term in row if term.of in (ANGLE, CUT)]
            return sum(
                self._shifted(
                    sum(term.factor * self._signal(term, y, angle, cut) for term in part),
                    part[0].shift,
                )
                for part in ([main] if main else []) + alone
            )
        products = [term.factor * self._signal(term, y, angle, cut) for term in row]
        total = products[0] if products else self.number(0)
        for product in products[1:]:
            total = total + product
        return total

    def _signal(self, term: Term, y: Sequence[Any], angle: Any, cut: Any) -> Any:
        if term.of == STATE:
            return self.x[term.place]
        if term.of == READING:
            return y[term.place]
        return angle if term.of == ANGLE else cut

    @staticmethod
    def _shifted(value: int, shift: int) -> int:
        """Return value/2^shift, rounded to the nearest and from the middle away from zero."""
        if not shift:
            return value
        half = 1 << (shift - 1)
        return (value + half) >> shift if value >= 0 else -((half - value) >> shift)

    def _word(self, value: int) -> int:
        return int(min(max(value, -self.rows.largest), self.rows.largest))
