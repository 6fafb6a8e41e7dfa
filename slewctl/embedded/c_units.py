"""Raw units: what makes readings of an encoder's counts, and a converter's steps of the command."""

from __future__ import annotations

import math

from slewctl.embedded.dialect import Dialect
from slewctl.embedded.program import Program
from slewctl.plant.signals import signal

# Bits of a factor that counts of 32 bits are multiplied with in 64.
_FACTOR_BITS = 30
# A converter's steps fit 32 bits.
_MOST_STEPS = 2147483647


def angles(program: Program) -> list[int]:
    """Return which readings are angles, which an encoder counts."""
    return [k for k, name in enumerate(program.sensors) if signal(name).unit == "rad"]


def declarations(program: Program) -> list[str]:
    """Return the functions of raw units that a header declares."""
    name, lines = program.name, []
    if program.options.counts_per_turn:
        for k in angles(program):
            lines += [
                f"/* {program.sensors[k]} of an encoder's counts"
                f"{_turned(program, program.sensors[k])}. */",
                f"{name}_number {name}_{program.identifiers[k]}_of_counts(int32_t counts);",
                "",
            ]
    if program.options.steps_per_unit:
        lines += [
            f"/* A converter's steps of the command{_turned(program, program.actuator)}. */",
            f"int32_t {name}_steps_of_command({name}_number command);",
            "",
        ]
    return lines


def _turned(program: Program, signal_name: str) -> str:
    return ", which runs the other way round" if signal_name in program.options.reversed else ""


def definitions(program: Program) -> list[str]:
    """Return the functions themselves."""
    lines: list[str] = []
    counts, steps = program.options.counts_per_turn, program.options.steps_per_unit
    if counts:
        for k in angles(program):
            lines += _of_counts(program, k, 2 * math.pi / counts * _sign(program, k))
    if steps:
        lines += _of_command(program, steps)
    return lines


def _sign(program: Program, k: int) -> float:
    return -1.0 if program.sensors[k] in program.options.reversed else 1.0


def _of_counts(program: Program, k: int, factor: float) -> list[str]:
    name, how = program.name, Dialect.of(program)
    head = [
        f"{name}_number {name}_{program.identifiers[k]}_of_counts(int32_t counts)",
        "{",
    ]
    words = program.words
    if words is None:
        literal = how.literal(factor)
        return [*head, f"    return {literal} * ({how.number})counts; /* rad */", "}", ""]
    scaled = math.ldexp(factor, words.readings[k])
    shift = max(min(_FACTOR_BITS - math.frexp(scaled)[1], 62), 0)
    whole = round(math.ldexp(scaled, shift))
    return [
        *head,
        f"    int64_t value = (int64_t){_bracketed(whole)} * (int64_t)counts;",
        *_rounding(shift),
        f"    if ((value > {words.largest}) || (value < -{words.largest})) {{",
        f"        value = -{words.largest} - 1; /* no reading */",
        "    }",
        f"    return ({how.number})value;",
        "}",
        "",
    ]


def _of_command(program: Program, steps: float) -> list[str]:
    name, how = program.name, Dialect.of(program)
    factor = -steps if program.actuator in program.options.reversed else steps
    head = [f"int32_t {name}_steps_of_command({name}_number command)", "{"]
    words = program.words
    if words is None:
        half, zero = how.literal(0.5), how.literal(0.0)
        most = how.literal(2147483520.0)
        return [
            *head,
            f"    {how.number} steps = {how.literal(factor)} * command;",
            f"    steps = (steps >= {zero}) ? (steps + {half}) : (steps - {half});",
            f"    if (steps > {most}) {{",
            f"        steps = {most};",
            f"    }} else if (steps < -{most}) {{",
            f"        steps = -{most};",
            "    } else {",
            "        /* within the converter's range */",
            "    }",
            "    return (int32_t)steps;",
            "}",
            "",
        ]
    scaled = math.ldexp(factor, -words.command)
    shift = max(min(_FACTOR_BITS - math.frexp(scaled)[1], 62), 0)
    whole = round(math.ldexp(scaled, shift))
    return [
        *head,
        f"    int64_t value = (int64_t){_bracketed(whole)} * (int64_t)command;",
        *_rounding(shift),
        f"    if (value > {_MOST_STEPS}) {{",
        f"        value = {_MOST_STEPS};",
        f"    }} else if (value < -{_MOST_STEPS}) {{",
        f"        value = -{_MOST_STEPS};",
        "    } else {",
        "        /* within the converter's range */",
        "    }",
        "    return (int32_t)value;",
        "}",
        "",
    ]


def _bracketed(value: int) -> str:
    return f"({value})" if value < 0 else str(value)


def _rounding(shift: int) -> list[str]:
    if not shift:
        return []
    half = 1 << (shift - 1)
    return [
        f"    value = (value >= 0) ? ((value + INT64_C({half})) / INT64_C({2 * half}))",
        f"                        : ((value - INT64_C({half})) / INT64_C({2 * half}));",
    ]
