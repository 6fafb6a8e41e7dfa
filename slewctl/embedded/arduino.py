"""An Arduino sketch that runs a program, as a place to begin."""

from __future__ import annotations

from slewctl.embedded.c_header import comment
from slewctl.embedded.c_units import angles
from slewctl.embedded.program import UNITS, Program


def sketch_text(program: Program) -> str:
    """Return a sketch that steps the controller on the clock of the board."""
    name, guard = program.name, program.name.upper()
    micros = round(1e6 * program.controller.sample_time)
    reads = [_read(program, k) for k in range(len(program.sensors))]
    unit = f"{'words of ' if program.words else ''}{UNITS[program.actuator]}"
    command, put = "command", f"{name}_number"
    if program.options.steps_per_unit:
        put = "int32_t"
        command, unit = f"{name}_steps_of_command(command)", "converter steps"
    return "\n".join(
        [
            comment([f"Runs {name} every {micros} us. Fill in what is marked: how the sensors are "
                     f"read and the {program.actuator} is put out.",
                     f"{name}.h and {name}.c stand beside this file."]),
            f'#include "{name}.h"',
            "",
            f"static {name}_controller controller;",
            "static uint32_t due;",
            "",
            *(line for k, _ in enumerate(reads) for line in _reader(program, k)),
            f"/* TO DO: put out the {program.actuator}, in {unit}. */",
            f"static void put_out({put} value)",
            "{",
            "    (void)value;",
            "}",
            "",
            "/* TO DO: where the arm is to go. */",
            f"static {name}_number reference_angle(void)",
            "{",
            "    return 0;",
            "}",
            "",
            "void setup()",
            "{",
            f"    {name}_init(&controller, {_first_angle(program, reads)});",
            "    due = micros();",
            "}",
            "",
            "void loop()",
            "{",
            "    if ((int32_t)(micros() - due) >= 0) {",
            f"        {name}_number y[{guard}_SENSORS];",
            f"        {name}_number command;",
            f"        due += {micros}UL;",
            *(f"        y[{k}] = {read};" for k, read in enumerate(reads)),
            f"        command = {name}_step(&controller, y, reference_angle(), 0);",
            f"        put_out({command});",
            "    }",
            "}",
            "",
        ]
    )  # fmt: skip


def _counted(program: Program, k: int) -> bool:
    return bool(program.options.counts_per_turn) and k in angles(program)


def _read(program: Program, k: int) -> str:
    called = f"read_{program.identifiers[k]}()"
    if _counted(program, k):
        return f"{program.name}_{program.identifiers[k]}_of_counts({called})"
    return called


def _reader(program: Program, k: int) -> list[str]:
    kind, unit = f"{program.name}_number", program.units[k]
    if _counted(program, k):
        kind, unit = "int32_t", "counts"
    elif program.words:
        unit = f"words of 2^-{program.words.readings[k]} {unit}"
    return [
        f"/* TO DO: {program.sensors[k]}, in {unit}. */",
        f"static {kind} read_{program.identifiers[k]}(void)",
        "{",
        "    return 0;",
        "}",
        "",
    ]


def _first_angle(program: Program, reads: list[str]) -> str:
    """Return the measured angle; zero where none is measured, or in words of its own."""
    words = program.words
    for k in angles(program):
        if words is None or words.readings[k] == words.angle:
            return reads[k]
    return "0"
