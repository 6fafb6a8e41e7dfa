"""The files that a program is shipped as."""

from __future__ import annotations

from slewctl.embedded.arduino import sketch_text
from slewctl.embedded.c_header import header_text
from slewctl.embedded.c_source import source_text
from slewctl.embedded.c_test import test_text
from slewctl.embedded.program import Program


def program_files(program: Program) -> dict[str, str]:
    """Return the files of a program in C: header, source, test program and Arduino sketch.

    Parameters
    ----------
    program : Program

    Returns
    -------
    dict of str to str
        Text by file name.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.embedded import CodeOptions, program_files, program_of
    >>> sorted(program_files(program_of(problem.judge(K), CodeOptions(), "arm")))
    ['arm.c', 'arm.h', 'arm.ino', 'arm_test.c']
    """
    name = program.name
    return {
        f"{name}.h": header_text(program),
        f"{name}.c": source_text(program),
        f"{name}_test.c": test_text(program),
        f"{name}.ino": sketch_text(program),
    }
