"""A program in C11 that is C++ too: no allocation, no library, the state in a struct."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.embedded.c_header import comment
from slewctl.embedded.c_units import definitions
from slewctl.embedded.dialect import Dialect, statement
from slewctl.embedded.program import Program
from slewctl.embedded.rows import ANGLE, READING, STATE, Rows, Term, rows_of


def source_text(program: Program) -> str:
    """Return the source file of a program."""
    how, rows, name = Dialect.of(program), rows_of(program), program.name
    parts = [
        comment([f"{name}: see {name}.h."]),
        f'#include "{name}.h"',
        "",
        *_constants(program, rows, how),
        *_helpers(program, rows, how),
        *_init(program, rows, how),
        *_take(program, how),
        *_answer(program, rows, how),
        *_step(program, rows, how),
        *definitions(program),
    ]
    return "\n".join(parts)


def _constants(program: Program, rows: Rows, how: Dialect) -> list[str]:
    lines = [f"#define MOST_READING {how.literal(rows.largest)}"]
    if rows.limit is not None:
        unit = "" if program.words else f" /* {program.limit:g} of the command's unit */"
        lines.append(f"#define LIMIT {how.literal(rows.limit)}{unit}")
    lines.append(f"#define MOST_MISSED {program.most_missed}u")
    if program.most_still:
        lines.append(f"#define MOST_STILL {program.most_still}u")
    return [*lines, ""]


def _helpers(program: Program, rows: Rows, how: Dialect) -> list[str]:
    name = program.name
    above = " && (value <= MOST_READING)"
    if program.words and program.words.word in (16, 32):
        above = ""  # its type ends there
    lines = [
        "/* False of what is no number, too. */" if not how.whole else "/* False of no word. */",
        f"static int is_reading({name}_number value)",
        "{",
        f"    return (value >= -MOST_READING){above};",
        "}",
        "",
    ]
    if not how.whole:
        return lines
    every = [*rows.command, *rows.start, *rows.at_rest, *(t for row in rows.states for t in row)]
    if any(term.shift for term in every):
        lines += [
            "/* value / 2^shift to the nearest, from the middle away from zero */",
            f"static {how.wide} rounded({how.wide} value, int shift)",
            "{",
            f"    const {how.wide} half = ({how.wide})(({how.wide})1 << (shift - 1));",
            "    return (value >= 0) ? ((value + half) >> shift) : -((half - value) >> shift);",
            "}",
            "",
        ]
    return [
        *lines,
        "/* A word, at its end where the value is beyond. */",
        f"static {name}_number word({how.wide} value)",
        "{",
        f"    {how.wide} kept = value;",
        "    if (kept > MOST_READING) {",
        "        kept = MOST_READING;",
        "    } else if (kept < -MOST_READING) {",
        "        kept = -MOST_READING;",
        "    } else {",
        "        /* it fits */",
        "    }",
        f"    return ({name}_number)kept;",
        "}",
        "",
    ]


def _init(program: Program, rows: Rows, how: Dialect) -> list[str]:
    name, guard, m = program.name, program.name.upper(), len(program.sensors)

    def of_angle(term: Term) -> list[str]:
        lines = how.total([term] if term.factor else [])
        return [f"word({' '.join(lines)})"] if how.whole else lines

    zero = how.literal(0)
    used = any(term.factor for term in (*rows.start, *rows.at_rest))
    return [
        f"void {name}_init({name}_controller *c, {name}_number angle)",
        "{",
        "    int k;",
        *([] if used else ["    (void)angle;"]),
        *(statement(f"c->x[{k}]", of_angle(term)) for k, term in enumerate(rows.start)),
        *(statement(f"c->held[{k}]", of_angle(term)) for k, term in enumerate(rows.at_rest)),
        f"    c->held[{m}] = angle;",
        f"    c->held[{m + 1}] = {zero};",
        f"    for (k = 0; k < {guard}_SENSORS; ++k) {{",
        "        c->still[k] = 0u;",
        "    }",
        "    c->missed = 0u;",
        "    c->fault = 0u;",
        "    c->full = 0u;",
        "}",
        "",
        f"void {name}_reset({name}_controller *c)",
        "{",
        f"    {name}_init(c, {zero});",
        "}",
        "",
    ]


def _take(program: Program, how: Dialect) -> list[str]:
    name, guard = program.name, program.name.upper()
    still = [
        f"            if (k < {guard}_SENSORS) {{",
        "                const int same = (c->full != 0u) && (in[k] >= c->held[k])",
        "                    && (in[k] <= c->held[k]);",
        "                c->still[k] = (same != 0) ? (c->still[k] + 1u) : 0u;",
        "                if (c->still[k] >= MOST_STILL) {",
        f"                    c->fault |= {guard}_FAULT_STUCK;",
        "                }",
        "            }",
    ]
    return [
        "/* Hold what is a reading; count what is none, and what stands still. */",
        f"static void take({name}_controller *c, const {name}_number in[{guard}_SENSORS + 2])",
        "{",
        "    int missing = 0;",
        "    int k;",
        f"    for (k = 0; k < ({guard}_SENSORS + 2); ++k) {{",
        "        if (is_reading(in[k])) {",
        *(still if program.most_still else []),
        "            c->held[k] = in[k];",
        "        } else {",
        "            missing = 1;",
        "        }",
        "    }",
        "    c->missed = (missing != 0) ? (c->missed + 1u) : 0u;",
        "    if (c->missed > MOST_MISSED) {",
        f"        c->fault |= {guard}_FAULT_READING;",
        "    }",
        "}",
        "",
    ]


def _answer(program: Program, rows: Rows, how: Dialect) -> list[str]:
    name, m = program.name, len(program.sensors)
    every = [*rows.command, *(term for row in rows.states for term in row)]
    used = {term.of for term in every}
    added = f"({how.wide})c->held[{m + 1}]" if how.whole else f"c->held[{m + 1}]"
    less = "word(command - wanted)" if how.whole else "command - wanted"
    cut = any(term.of == "cut" for row in rows.states for term in row)
    return [
        "/* The law itself: command and next states of what is held. */",
        f"static {name}_number answer({name}_controller *c)",
        "{",
        *([f"    const {name}_number *const x = c->x;"] if STATE in used else []),
        *([f"    const {name}_number *const y = c->held;"] if READING in used else []),
        *([f"    const {name}_number angle = c->held[{m}];"] if ANGLE in used else []),
        f"    {name}_number command;",
        *([f"    {how.wide} added[{program.name.upper()}_STATES];"] if rows.states else []),
        *([f"    {how.wide} cut;"] if cut else []),
        f"    {how.wide} wanted;",
        *(["    int k;"] if rows.states else []),
        "",
        statement("wanted", [*how.total(rows.command), f"+ {added}"]),
        *_limited(program, rows, how),
        *([f"    cut = {less};"] if cut else []),
        *_states(program, rows, how),
        "    return command;",
        "}",
        "",
    ]


def _limited(program: Program, rows: Rows, how: Dialect) -> list[str]:
    guard, lines = program.name.upper(), []
    if not how.whole:
        lines = [
            "    if (!is_reading(wanted)) {",
            f"        c->fault |= {guard}_FAULT_NUMBER;",
            f"        return {how.literal(0.0)};",
            "    }",
        ]
        if rows.limit is None:
            return [*lines, "    command = wanted;"]
    limit = "MOST_READING" if rows.limit is None else "LIMIT"
    kept = f"({program.name}_number)wanted" if how.whole else "wanted"
    return [
        *lines,
        f"    if (wanted > {limit}) {{",
        f"        command = {limit};",
        f"    }} else if (wanted < -{limit}) {{",
        f"        command = -{limit};",
        "    } else {",
        f"        command = {kept};",
        "    }",
    ]


def _states(program: Program, rows: Rows, how: Dialect) -> list[str]:
    lines: list[str] = []
    said = _sections(program)
    for k, row in enumerate(rows.states):
        if k in said:
            lines += ["", f"    /* {said[k]} */"]
        lines.append(statement(f"added[{k}]", how.total(row)))
    if not rows.states:
        return lines
    new = f"word(({how.wide})c->x[k] + added[k])" if how.whole else "c->x[k] + added[k]"
    return [
        *lines,
        "",
        f"    for (k = 0; k < {program.name.upper()}_STATES; ++k) {{",
        f"        c->x[k] = {new};",
        "    }",
    ]


def _sections(program: Program) -> dict[int, str]:
    """Return what each section is, by its first state."""
    found: dict[int, str] = {}
    labels = [label.rpartition("_")[0] for label in program.system.state_labels]
    for first in dict.fromkeys(labels):
        own = [k for k, label in enumerate(labels) if label == first]
        A = program.system.A[np.ix_(own, own)]
        found[own[0]] = _described(A, program.controller.sample_time)
    return found


def _described(A: Array, T: float) -> str:
    z = np.linalg.eigvals(A).astype(complex)
    if len(z) > 2:
        return f"{len(z)} states whose poles lie together"
    pole = z[0]
    if abs(pole) <= np.finfo(float).eps:
        return "gone after a sample"
    if pole.imag == 0:
        if abs(pole - 1) <= 1e-9:
            return "an integrator"
        if pole.real < 0:
            return f"a pole at z = {pole.real:.4g}"
        time = -T / float(np.log(pole.real))
        return f"time constant {time:.4g} s"
    s = np.log(pole) / T
    return f"{abs(s) / (2 * np.pi):.4g} Hz, damping ratio {-s.real / abs(s):.3g}"


def _step(program: Program, rows: Rows, how: Dialect) -> list[str]:
    name, guard, m = program.name, program.name.upper(), len(program.sensors)
    full = "    c->full = 0u;"
    if rows.limit is not None:
        full = "    c->full = ((command >= LIMIT) || (command <= -LIMIT)) ? 1u : 0u;"
    return [
        f"{name}_number {name}_step({name}_controller *c,",
        f"    const {name}_number y[{guard}_SENSORS], {name}_number angle,",
        f"    {name}_number feedforward)",
        "{",
        f"    {name}_number in[{guard}_SENSORS + 2];",
        f"    {name}_number command = {how.literal(0)};",
        "    int k;",
        f"    for (k = 0; k < {guard}_SENSORS; ++k) {{",
        "        in[k] = y[k];",
        "    }",
        f"    in[{m}] = angle;",
        f"    in[{m + 1}] = feedforward;",
        "    if (c->fault == 0u) {",
        "        take(c, in);",
        "    }",
        "    if (c->fault == 0u) {",
        "        command = answer(c);",
        "    }",
        full,
        "    return command;",
        "}",
        "",
    ]
