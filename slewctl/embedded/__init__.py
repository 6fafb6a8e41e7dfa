"""What runs on the controller: a program of a judged design, in C, compiled and read back."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.embedded.compiled import Compiled, compile_program, find_compiler
    from slewctl.embedded.data import controller_data
    from slewctl.embedded.files import program_files
    from slewctl.embedded.fmu import fmu_bytes
    from slewctl.embedded.options import CodeOptions
    from slewctl.embedded.origin import provenance
    from slewctl.embedded.program import Program, program_of
    from slewctl.embedded.runner import Runner
    from slewctl.embedded.step_answers import read_back

__all__ = [
    "CodeOptions",
    "Compiled",
    "Program",
    "Runner",
    "compile_program",
    "controller_data",
    "find_compiler",
    "fmu_bytes",
    "program_files",
    "program_of",
    "provenance",
    "read_back",
]

__getattr__, __dir__ = attach(__name__, __file__)
