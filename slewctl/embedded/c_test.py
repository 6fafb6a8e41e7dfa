"""A test program beside the code: inputs, what is expected of them, and no library but stdio."""

from __future__ import annotations

from typing import Any

from slewctl.embedded.c_header import comment
from slewctl.embedded.dialect import Dialect
from slewctl.embedded.program import Program
from slewctl.embedded.trial import Sample, trial

# Samples that the test program takes: two with a reading that is none.
_STEPS = 120


def test_text(program: Program) -> str:
    """Return a program that steps the controller and compares every bit of its command."""
    name, guard, how = program.name, program.name.upper(), Dialect.of(program)
    m = len(program.sensors)
    shown = "%ld" if how.whole else "%.17g"
    cast = "(long)" if how.whole else "(double)"
    return "\n".join(
        [
            comment([f"Runs {name} for {_STEPS} samples and compares every command with what is "
                     "expected, bit for bit.", "Compile it with -ffp-contract=off."]),
            "#include <stdio.h>",
            f'#include "{name}.h"',
            "",
            "typedef struct {",
            f"    {name}_number y[{guard}_SENSORS];",
            f"    {name}_number angle;",
            f"    {name}_number feedforward;",
            f"    {name}_number command;",
            "    uint32_t fault;",
            "} sample;",
            "",
            f"static const sample samples[{_STEPS}] = {{",
            *(f"    {_sample(how, sample)}," for sample in trial(program, _STEPS)),
            "};",
            "",
            "int main(void)",
            "{",
            f"    {name}_controller c;",
            "    int k;",
            f"    {name}_reset(&c);",
            f"    for (k = 0; k < {_STEPS}; ++k) {{",
            "        const sample *const s = &samples[k];",
            f"        const {name}_number command =",
            f"            {name}_step(&c, s->y, s->angle, s->feedforward);",
            "        const int same = (command >= s->command) && (command <= s->command);",
            "        if ((same == 0) || (c.fault != s->fault)) {",
            f'            (void)printf("sample %d: {shown}, fault %lu; "',
            f'                "expected {shown}, fault %lu\\n",',
            f"                k, {cast}command, (unsigned long)c.fault, {cast}s->command,",
            "                (unsigned long)s->fault);",
            "            return 1;",
            "        }",
            "        if (c.fault != 0u) {",
            f"            {name}_init(&c, s->angle);",
            "        }",
            "    }",
            f'    (void)printf("{name}: all {_STEPS} samples as expected ({m} readings)\\n");',
            "    return 0;",
            "}",
            "",
        ]
    )  # fmt: skip


def _sample(how: Dialect, sample: Sample) -> str:
    *y, angle, feedforward = (_literal(how, value) for value in sample.inputs)
    numbers = ", ".join([angle, feedforward, how.literal(sample.command)])
    return f"{{ {{ {', '.join(y)} }}, {numbers}, {sample.fault}u }}"


def _literal(how: Dialect, value: Any) -> str:
    """Return a number as C has it; for what is none, one that is no reading."""
    return how.literal(value if value == value else 2e30)
