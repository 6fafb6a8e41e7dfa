"""How numbers and sums of a program are written in C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from slewctl.embedded.program import Program
from slewctl.embedded.rows import ANGLE, CUT, READING, STATE, Term

_WIDTH = 96  # of a line


@dataclass(frozen=True)
class Dialect:
    """The types of a program, and how its numbers are written.

    Attributes
    ----------
    number : str
        Type of a signal.
    wide : str
        Type of a sum of products.
    literal : callable
        From a number to its text, from which a compiler reads the same number.
    """

    number: str
    wide: str
    literal: Callable[[Any], str]

    @classmethod
    def of(cls, program: Program) -> Dialect:
        """Return how a program is written."""
        if program.words:
            short = program.words.word <= 16
            return cls(*(("int16_t", "int32_t") if short else ("int32_t", "int64_t")), _whole)
        if program.controller.arithmetic is not None:
            return cls("float", "float", lambda value: f"{_decimal(float(value), 9)}F")
        return cls("double", "double", double_literal)

    @property
    def whole(self) -> bool:
        """Whether its numbers are whole."""
        return self.number != self.wide

    def product(self, term: Term, angle: str) -> str:
        """Return a coefficient times its signal."""
        named = {STATE: f"x[{term.place}]", READING: f"y[{term.place}]", ANGLE: angle, CUT: "cut"}
        factor = self.literal(term.factor)
        if not self.whole:
            return f"({factor} * {named[term.of]})"
        factor = f"({factor})" if term.factor < 0 else factor
        return f"(({self.wide}){factor} * ({self.wide}){named[term.of]})"

    def total(self, row: Sequence[Term], angle: str = "angle") -> list[str]:
        """Return the lines of a sum, from the left; every part of words with its own shift."""
        if not self.whole:
            products = [self.product(term, angle) for term in row]
            return _wrapped(products or [self.literal(0.0)])
        main = [term for term in row if term.of in (STATE, READING)]
        alone = [[term] for term in row if term.of in (ANGLE, CUT)]
        parts = []
        for group in [*([main] if main else []), *alone]:
            inner = _wrapped([self.product(term, angle) for term in group])
            shift = group[0].shift
            parts.append([f"rounded({inner[0]}", *inner[1:]] if shift else inner)
            parts[-1][-1] += f", {shift})" if shift else ""
        if not parts:
            return ["0"]
        lines = parts[0]
        for part in parts[1:]:
            lines = [*lines[:-1], f"{lines[-1]}", f"+ {part[0]}", *part[1:]]
        return lines


def _whole(value: Any) -> str:
    return str(int(value))


def double_literal(value: Any) -> str:
    """Return a number in C from which a compiler reads the same double."""
    return _decimal(float(value), 17)


def _decimal(value: float, digits: int) -> str:
    text = f"{value:.{digits}g}"
    return text if any(mark in text for mark in ".e") else f"{text}.0"


def _wrapped(products: list[str]) -> list[str]:
    """Return products with plus signs between, in lines of a bearable length."""
    lines = [products[0]]
    for product in products[1:]:
        if len(lines[-1]) + len(product) + 3 > _WIDTH - 20:
            lines.append(f"+ {product}")
        else:
            lines[-1] += f" + {product}"
    return lines


def statement(left: str, lines: Sequence[str], indent: int = 4) -> str:
    """Return ``left = …;`` with what does not fit in a line below."""
    pad = " " * indent
    below = f"\n{pad}    ".join(lines)
    return f"{pad}{left} = {below};"
