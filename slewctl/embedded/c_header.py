"""The header of a program in C: what it is, where it comes from, how it is called."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable

from slewctl.embedded.c_units import declarations
from slewctl.embedded.dialect import Dialect
from slewctl.embedded.program import UNITS, Program

# Letters of comments that a compiler for a small processor may not know.
_ASCII = str.maketrans({
    "·": "*", "²": "^2", "√": "sqrt ", "−": "-", "–": "-", "θ": "theta", "σ": "sigma",
    "×": "x", "≤": "<=", "≥": ">=", "ω": "omega", "ζ": "zeta", "∞": "inf", "χ": "chi",
    "ẋ": "x'", "τ": "tau", "‖": "|",
})  # fmt: skip


def comment(lines: Iterable[str]) -> str:
    """Return lines as a comment that no text can end, in ASCII.

    Examples
    --------
    >>> print(comment(["1 N·m */"]))
    /*
     * 1 N*m * /
     */
    """
    body = []
    for line in lines:
        plain = line.translate(_ASCII).replace("\u0302", "")
        plain = plain.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *")
        body += textwrap.wrap(plain, 92, subsequent_indent="  ") or [""]
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in body), " */"])


def header_text(program: Program) -> str:
    """Return the header file of a program."""
    name, guard, how = program.name, program.name.upper(), Dialect.of(program)
    n, m = program.system.nstates, len(program.sensors)
    states = [f"    {name}_number x[{guard}_STATES]; /* modal sections */"] if n else []
    return "\n".join(
        [
            comment([f"{name}: the controller of a slewing arm.", "", *program.notes, "",
                     *_usage(program)]),
            f"#ifndef {guard}_H",
            f"#define {guard}_H",
            "",
            "#include <stdint.h>",
            "",
            "#ifdef __cplusplus",
            'extern "C" {',
            "#endif",
            "",
            f"#define {guard}_STATES {n}",
            f"#define {guard}_SENSORS {m}",
            f"#define {guard}_SAMPLE_TIME_S {program.controller.sample_time!r}",
            "",
            "/* Why it commands nothing any more, until it is started again. */",
            f"#define {guard}_FAULT_READING 1u /* readings missing for longer than it bears */",
            f"#define {guard}_FAULT_STUCK 2u   /* a reading stands still at full command */",
            f"#define {guard}_FAULT_NUMBER 4u  /* the command is no number */",
            "",
            f"typedef {how.number} {name}_number;",
            "",
            "typedef struct {",
            *states,
            f"    {name}_number held[{guard}_SENSORS + 2]; "
            "/* last readings, reference angle, feedforward */",
            f"    uint32_t still[{guard}_SENSORS]; /* samples without a change at full command */",
            "    uint32_t missed;   /* samples in a row with a reading missing */",
            "    uint32_t fault;    /* zero, or why it commands nothing */",
            "    uint32_t full;     /* whether the last command was at its limit */",
            f"}} {name}_controller;",
            "",
            "/* Start at rest at an angle, without a jump of the command. */",
            f"void {name}_init({name}_controller *c, {name}_number angle);",
            "",
            "/* Start at rest at angle zero. */",
            f"void {name}_reset({name}_controller *c);",
            "",
            "/* Return the command; call it once every sample. */",
            f"{name}_number {name}_step({name}_controller *c,",
            f"    const {name}_number y[{guard}_SENSORS], {name}_number angle,",
            f"    {name}_number feedforward);",
            "",
            *declarations(program),
            "#ifdef __cplusplus",
            "}",
            "#endif",
            "",
            f"#endif /* {guard}_H */",
            "",
        ]
    )  # fmt: skip


def _usage(program: Program) -> list[str]:
    """Return what goes in and out, and what happens where something is wrong."""
    words = program.words
    bits = [*words.readings, words.angle, words.command] if words else []

    def unit(text: str, k: int) -> str:
        return f"words of 2^{-bits[k]} {text}" if words else text

    m = len(program.sensors)
    out = UNITS[program.actuator]
    read = enumerate(zip(program.sensors, program.units, strict=True))
    lines = [f"y[{k}]  {sensor}, in {unit(of, k)}" for k, (sensor, of) in read]
    lines += [
        f"angle  reference of the hub's angle, in {unit('rad', m)}",
        f"feedforward  added to the command, in {unit(out, m + 1)}: that of the time when it acts;"
        " zero without one",
        f"returns  the {program.actuator}, in {unit(out, m + 1)}; it acts with a plus sign",
        "",
        f"Every {program.controller.sample_time:g} s; the command is due "
        f"{program.controller.delay:g} s after the readings.",
        f"A reading that is {_none(program)} is replaced by the last good one, for at most "
        f"{program.most_missed} samples in a row (what the delay margin forgives); then the "
        "command is zero and fault says so.",
    ]
    if program.most_still:
        lines.append(
            f"A reading that does not change at all for {program.most_still} samples of full "
            "command is stuck: the command is zero and fault says so."
        )
    elif math.isfinite(program.limit):
        lines.append("A stuck reading is not looked for.")
    else:
        lines.append("A stuck reading is not looked for: there is no full command.")
    lines.append("After a fault, init or reset starts it again.")
    if not words:
        lines.append("Compile it without -ffast-math, which takes away what is no number.")
    return lines


def _none(program: Program) -> str:
    if program.words:
        return f"not within +-{program.words.largest}"
    return "not a number, infinite or beyond 1e30"
