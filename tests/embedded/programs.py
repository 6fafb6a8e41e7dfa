"""Programs that the tests compile."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

import slewctl as sc
from slewctl.compare import Judgement
from slewctl.embedded import (
    CodeOptions,
    Compiled,
    Program,
    compile_program,
    program_files,
    program_of,
)

WITH_COMPILER = pytest.mark.skipif(
    not (shutil.which("cc") and shutil.which("g++")), reason="no C and C++ compiler is installed"
)
STRICT = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow",
          "-Werror", "-ffp-contract=off"]  # fmt: skip
SANITIZED = [*STRICT, "-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
RAW = {"counts_per_turn": 4096, "steps_per_unit": 200.0}
KINDS = {
    "double": CodeOptions(**RAW),
    "float": CodeOptions("float", **RAW, reversed=("theta",)),
    "16 bits": CodeOptions("fixed", word=16, **RAW, reversed=("theta", "torque")),
    "20 bits": CodeOptions("fixed", word=20, **RAW),
    "32 bits": CodeOptions("fixed", word=32),
}


@cache
def judged(limit: float | None = 0.4, **options: float) -> Judgement:
    """Return a sampled controller of a beam, with integral action, on the truth."""
    drive = sc.Actuator(torque_limit=limit) if limit else None
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01, actuator=drive)
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, noise, truth_modes=5)
    options = {"sample_time": 0.02, "integral_limit": 0.5, **options}
    return problem.judge(sc.lqg(problem.plant("clamped-free", n=1), **options))


@cache
def program(kind: str = "double", limit: float | None = 0.4) -> Program:
    """Return its program in one of `KINDS`."""
    return program_of(judged(limit), KINDS[kind], "06-a beam", ("Made for a test.",))


@cache
def library(kind: str, limit: float | None) -> Compiled:
    return compile_program(program(kind, limit))


def compiled(kind: str = "double", limit: float | None = 0.4) -> Compiled:
    """Return that program as compiled once, with a state of its own."""
    return Compiled(program(kind, limit), library(kind, limit).library)


def written(made: Program, folder: Path, **changed: str) -> None:
    """Write a program's files, some with other text."""
    for name, text in {**program_files(made), **changed}.items():
        (folder / name).write_text(text, encoding="ascii")


def run(command: list[str], folder: Path, given: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    """Run a compiler, or what it made, in a folder."""
    return subprocess.run(command, cwd=folder, input=given, capture_output=True, check=False)
