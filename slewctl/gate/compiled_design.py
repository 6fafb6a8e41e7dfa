"""A design judged as the code that runs: compiled, read back, and taken for the controller."""

from __future__ import annotations

from dataclasses import fields

from slewctl.compare import Judge, Judgement
from slewctl.embedded import Program, compile_program, program_of, read_back
from slewctl.embedded.options import CodeOptions
from slewctl.errors import SlewctlError

# Where what is wrong with the options of a design file stands in it.
_OPTIONS = tuple(field.name for field in fields(CodeOptions))


def design_program(
    judgement: Judgement, options: CodeOptions, name: str, notes: tuple[str, ...] = ()
) -> Program:
    """Return what a computer runs of a design file; what is wrong is told at its place there.

    Parameters
    ----------
    judgement, options, name, notes
        As for `slewctl.embedded.program_of`.
    """
    try:
        return program_of(judgement, options, name, notes)
    except SlewctlError as error:
        if error.where.partition(".")[0] in _OPTIONS:
            raise error.within("export", ".") from error
        raise


def judge_of_compiled(judging: Judge, options: CodeOptions, name: str) -> tuple[str, ...]:
    """Let a judge take what was read out of the compiled code for the design; return what to say.

    Parameters
    ----------
    judging : Judge
        From here on its own controller is the compiled one.
    options : CodeOptions
    name : str

    Raises
    ------
    InputError
        For a continuous controller, or where nothing compiles.
    AccuracyError
        If the compiled code does not do what was written.
    """
    model, controller = judging.own
    judged = judging.judge(controller)
    if not judged.stable:
        return ("nothing was compiled: a program is made of a stable loop alone",)
    program = design_program(judged, options, name)
    compiled = read_back(program, compile_program(program))
    vars(judging)["own"] = model, compiled  # where the cached property keeps it
    said = "; ".join(program.notes)
    return (
        f"compiled, its A, B, C and D read by stepping it, limits compared step by step; {said}",
    )
