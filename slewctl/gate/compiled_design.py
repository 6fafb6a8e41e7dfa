"""A design judged as the code that runs: compiled, read back, and taken for the controller."""

from __future__ import annotations

from slewctl.compare import Judge
from slewctl.embedded import compile_program, program_of, read_back
from slewctl.embedded.options import CodeOptions


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
    UnstableLoopError
        If the loop is not stable to begin with.
    AccuracyError
        If the compiled code does not do what was written.
    """
    model, controller = judging.own
    program = program_of(judging.judge(controller), options, name)
    compiled = read_back(program, compile_program(program))
    vars(judging)["own"] = model, compiled  # where the cached property keeps it
    said = "; ".join(program.notes)
    return (
        f"compiled, its A, B, C and D read by stepping it, limits compared step by step; {said}",
    )
