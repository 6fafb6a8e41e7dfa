"""A program compiled by the system's compiler and loaded, so that it can be stepped and read."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from slewctl.embedded.c_header import header_text
from slewctl.embedded.c_source import source_text
from slewctl.embedded.dialect import Dialect
from slewctl.embedded.program import Program
from slewctl.errors import InputError

# Every product and sum as it is written, and nothing that a careful compiler would mind.
FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
_SECONDS = 120  # that a compiler may take
_KINDS: dict[str, Any] = {
    "double": ctypes.c_double, "float": ctypes.c_float, "int16_t": ctypes.c_int16,
    "int32_t": ctypes.c_int32,
}  # fmt: skip
# What lets the inside of a running program be seen, whatever its layout in memory.
_PROBE = """\
#include "{name}.h"
#include <stddef.h>

size_t probe_size(void) {{ return sizeof({name}_controller); }}
{name}_number *probe_states({name}_controller *c) {{ return {states}; }}
uint32_t probe_fault(const {name}_controller *c) {{ return c->fault; }}
"""


def find_compiler() -> str:
    """Return the C compiler: that of the variable CC, or the first of cc, gcc and clang.

    Returns
    -------
    str

    Raises
    ------
    InputError
        Where there is none.

    Examples
    --------
    >>> from slewctl.embedded import find_compiler
    >>> find_compiler()  # doctest: +SKIP
    '/usr/bin/cc'
    """
    named = os.environ.get("CC", "").strip()
    for name in [named] if named else ["cc", "gcc", "clang"]:
        found = shutil.which(name)
        if found:
            return found
    raise InputError(
        f"no C compiler is installed ({named or 'cc, gcc, clang'})",
        where="CC",
        remedy="install one, or name it in the variable CC",
    )


class Compiled:
    """A loaded program with one state, called as `slewctl.embedded.Runner` is.

    Parameters
    ----------
    program : Program
    library : ctypes.CDLL
    """

    def __init__(self, program: Program, library: ctypes.CDLL) -> None:
        kind = _KINDS[Dialect.of(program).number]
        self.words = program.words
        self.library = library
        self._readings = (kind * len(program.sensors))()
        library.probe_size.restype = ctypes.c_size_t
        self._memory = ctypes.create_string_buffer(library.probe_size())
        self._of = ctypes.cast(self._memory, ctypes.c_void_p)
        library.probe_states.restype = ctypes.POINTER(kind)
        library.probe_fault.restype = ctypes.c_uint32
        self._states = library.probe_states(self._of)
        self._count = program.system.nstates
        self._step = getattr(library, f"{program.name}_step")
        self._step.restype = kind
        self._step.argtypes = [ctypes.c_void_p, ctypes.c_void_p, kind, kind]
        self._init = getattr(library, f"{program.name}_init")
        self._init.argtypes = [ctypes.c_void_p, kind]
        self.init(0)

    @property
    def x(self) -> list[Any]:
        """The states."""
        return self._states[: self._count] if self._count else []

    @x.setter
    def x(self, values: Sequence[Any]) -> None:
        for k, value in enumerate(values):
            self._states[k] = value

    @property
    def fault(self) -> int:
        """Zero, or why it commands nothing any more."""
        return int(self.library.probe_fault(self._of))

    def init(self, angle: Any) -> None:
        """Start at rest at an angle."""
        self._init(self._of, angle)

    def step(self, readings: Sequence[Any], angle: Any, feedforward: Any) -> Any:
        """Return the command."""
        for k, value in enumerate(readings):
            self._readings[k] = value
        return self._step(self._of, self._readings, angle, feedforward)


def compile_program(program: Program) -> Compiled:
    """Return a program as the system's compiler makes it.

    Parameters
    ----------
    program : Program

    Returns
    -------
    Compiled

    Raises
    ------
    InputError
        Where there is no compiler, or it refuses the code.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.embedded import CodeOptions, compile_program, program_of
    >>> program = program_of(problem.judge(K), CodeOptions(), "arm")
    >>> compile_program(program).step([0.1], 0.0, 0.0) < 0  # doctest: +SKIP
    True
    """
    compiler, name = find_compiler(), program.name
    states = "c->x" if program.system.nstates else "(void)c, NULL"
    with tempfile.TemporaryDirectory(prefix="slewctl-") as folder:
        place = Path(folder)
        for file, text in {
            f"{name}.h": header_text(program),
            f"{name}.c": source_text(program),
            "probe.c": _PROBE.format(name=name, states=states),
        }.items():
            (place / file).write_text(text, encoding="ascii")
        library = place / "program.so"
        run_compiler(
            [compiler, *FLAGS, "-shared", "-fPIC", f"{name}.c", "probe.c", "-o", str(library)],
            place,
        )
        return Compiled(program, ctypes.CDLL(str(library)))


def run_compiler(command: Sequence[str], folder: Path) -> None:
    """Run a compiler in a folder.

    Raises
    ------
    InputError
        If it refuses, with the first line of what it says.
    """
    try:
        told = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(
            f"the compiler {command[0]} does not run: {error}",
            where="CC",
            remedy="name another in the variable CC",
        ) from error
    if told.returncode:
        lines = [line for line in told.stderr.splitlines() if "error" in line] or ["no reason"]
        raise InputError(
            f"the compiler {command[0]} refuses the code: {lines[0].strip()}",
            where="CC",
            remedy="use one that knows C11 and the options of gcc",
        )
