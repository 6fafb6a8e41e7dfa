"""The code that is written compiles without a word, and is the controller to the last bit."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import (
    KINDS,
    SANITIZED,
    STRICT,
    WITH_COMPILER,
    compiled,
    judged,
    program,
    run,
    written,
)

import slewctl as sc
from slewctl.compare import digital_loss
from slewctl.embedded import (
    CodeOptions,
    Program,
    Runner,
    compile_program,
    program_files,
    program_of,
    read_back,
)
from slewctl.embedded.rows import rows_of
from slewctl.embedded.runner import FAULT_NUMBER, FAULT_READING, FAULT_STUCK
from slewctl.embedded.trial import trial

pytestmark = WITH_COMPILER
STEPS = 40_000
# Reads inputs and writes command and fault of every sample, as they stand in memory.
HARNESS = """
#include <stdio.h>
#include "a_beam.h"
int main(void)
{
    static a_beam_controller c;
    a_beam_number in[A_BEAM_SENSORS + 2];
    a_beam_init(&c, 0);
    while (fread(in, sizeof in, 1, stdin) == 1) {
        const a_beam_number u = a_beam_step(&c, in, in[A_BEAM_SENSORS], in[A_BEAM_SENSORS + 1]);
        (void)fwrite(&u, sizeof u, 1, stdout);
        (void)putchar((int)c.fault);
        if (c.fault != 0u) {
            a_beam_init(&c, in[A_BEAM_SENSORS]);
        }
    }
    return 0;
}
"""


def letter(made: Program) -> str:
    """Return how `struct` calls a program's number."""
    if made.words:
        return "h" if made.words.word <= 16 else "i"
    return "f" if made.controller.arithmetic else "d"


def in_c(made: Program, inputs: list[list[Any]], folder: Path) -> list[tuple[Any, int]]:
    """Return what the compiled program commands, under sanitizers."""
    written(made, folder, **{"harness.c": HARNESS})
    built = run(["cc", *SANITIZED, "a_beam.c", "harness.c", "-o", "harness"], folder)
    assert built.returncode == 0, built.stderr.decode()
    flat = [value for row in inputs for value in row]
    ran = run(["./harness"], folder, struct.pack(f"={len(flat)}{letter(made)}", *flat))
    assert ran.returncode == 0, ran.stderr.decode()
    return list(struct.iter_unpack(f"={letter(made)}B", ran.stdout))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["double", "float", "16 bits", "32 bits"])
def test_every_command_is_that_of_python_to_the_last_bit(kind: str, tmp_path: Path) -> None:
    made = program(kind)
    ours = trial(made, STEPS if kind == "double" else STEPS // 10)
    theirs = in_c(made, [sample.inputs for sample in ours], tmp_path)
    assert [(sample.command, sample.fault) for sample in ours] == theirs
    commands = np.array([command for command, _ in theirs], dtype=float)
    limit = float(rows_of(made).limit)
    assert 0.1 < np.mean(np.abs(commands) == limit) < 0.6  # at its limit, and not


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(KINDS))
def test_compilers_have_nothing_to_say_and_the_test_program_holds(
    kind: str, tmp_path: Path
) -> None:
    made = program(kind)
    written(made, tmp_path, **{"Arduino.h": "#include <stdint.h>\nuint32_t micros(void);\n"})
    built = run(["cc", *STRICT, "a_beam.c", "a_beam_test.c", "-o", "test"], tmp_path)
    assert built.returncode == 0, built.stderr.decode()
    assert run(["./test"], tmp_path).returncode == 0
    in_cpp = ["g++", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c++"]
    for file, extra in (
        ("a_beam.c", []),
        ("a_beam_test.c", []),
        ("a_beam.ino", ["-include", "Arduino.h"]),
    ):
        told = run([*in_cpp, *extra, file], tmp_path)
        assert told.returncode == 0, told.stderr.decode()


def changed(made: Program) -> str:
    """Return the source with one coefficient of the command changed in a late digit."""
    text = program_files(made)["a_beam.c"]
    at = text.index("wanted = (") + len("wanted = (")
    end = text.index(" *", at)
    return f"{text[:at]}{float(text[at:end]) * (1 + 1e-9)!r}{text[end:]}"


def test_a_changed_coefficient_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = program()
    written(made, tmp_path, **{"a_beam.c": changed(made)})
    assert run(["cc", *STRICT, "a_beam.c", "a_beam_test.c", "-o", "test"], tmp_path).returncode == 0
    ran = run(["./test"], tmp_path)
    assert ran.returncode == 1
    assert ran.stdout.startswith(b"sample 1: ")
    monkeypatch.setattr("slewctl.embedded.compiled.source_text", changed)
    with pytest.raises(sc.AccuracyError, match=r"not the one that was written: in step 1"):
        read_back(made, compile_program(made))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "digits"), [("double", 1e-12), ("float", 1e-7), ("16 bits", 1e-12), ("32 bits", 1e-12)]
)
def test_what_is_read_out_is_the_controller(kind: str, digits: float) -> None:
    made = program(kind)
    read = read_back(made, compiled(kind))
    for name in "ABCD":
        own = getattr(made.system, name)
        assert getattr(read.linear, name) == pytest.approx(own, abs=digits * np.abs(own).max()), (
            name
        )
    assert read.reference is not None
    assert (
        pytest.approx(made.reference.B, abs=max(10 * digits, 1e-4 if made.words else 0))
        == read.reference.B
    )
    before = judged()
    loss = digital_loss(before, before.yardstick.judge(read, before.slew))
    assert loss.worst < max(20 * digits, 1e-3 if made.words else 0)


@pytest.mark.parametrize("kind", list(KINDS))
def test_it_starts_at_any_angle_without_a_jump(kind: str) -> None:
    made = program(kind, limit=None)
    one = compiled(kind, limit=None)
    angle: Any = 0.4
    readings: list[Any] = [0.4 * at_rest for at_rest in made.at_rest]
    step = 1e-9 if kind == "double" else 1e-5
    if made.words:
        bits = made.words
        step = 12.0  # words, of which the command has thousands
        readings = [round(y * 2**k) for y, k in zip(readings, bits.readings, strict=True)]
        angle = round(angle * 2**bits.angle)
    one.init(angle)
    assert max(abs(one.step(readings, angle, 0)) for _ in range(200)) <= step


@pytest.mark.parametrize("none", [np.nan, np.inf, -np.inf, 2e30])
def test_what_is_no_reading_is_replaced_by_the_last_for_as_long_as_the_margin_lasts(
    none: float,
) -> None:
    made = program()
    one, held = compiled(), compiled()
    margin = judged().margins.delay_s.value
    assert made.most_missed == int(margin / 0.02) > 0
    for runner in (one, held):
        runner.step([0.01, 0.0], 0.0, 0.0)
    for _ in range(made.most_missed):
        assert one.step([none, 0.001], 0.0, 0.0) == held.step([0.01, 0.001], 0.0, 0.0) != 0
        assert one.fault == 0
    assert one.step([none, 0.001], 0.0, 0.0) == 0
    assert one.fault == FAULT_READING
    assert one.step([0.01, 0.001], 0.0, 0.0) == 0  # for good
    one.init(0.0)
    assert one.fault == 0
    assert one.step([0.01, 0.0], 0.0, 0.0) != 0


def test_one_good_reading_in_time_is_enough() -> None:
    made, one = program(), compiled()
    for k in range(50):
        good = k % (made.most_missed + 1) == made.most_missed
        one.step([0.01 if good else np.nan, 0.0], 0.0, 0.0)
    assert one.fault == 0


def test_a_reading_that_stands_still_at_full_command_is_stuck() -> None:
    made, one = program(), compiled()
    first_mode = judged().loop.model.frequencies_hz[0]
    assert made.most_still == int(np.ceil(1 / first_mode / 0.02))
    one.step([0.0, 0.0], 3.0, 0.0)
    moving = 0.0
    for _ in range(10 * made.most_still):  # it moves, if by little
        moving += 1e-9
        assert abs(one.step([moving, moving], 3.0, 0.0)) == 0.4
    for _ in range(made.most_still - 1):
        assert one.step([moving, moving], 3.0, 0.0) != 0
    one.step([moving, moving], 3.0, 0.0)
    assert one.fault == FAULT_STUCK
    assert one.step([moving, moving], 3.0, 0.0) == 0
    one.init(0.0)
    for _ in range(10 * made.most_still):  # at rest nothing moves, and nothing is wrong
        one.step([0.0, 0.0], 0.0, 0.0)
    assert one.fault == 0


def test_a_command_that_is_no_number_is_none() -> None:
    one = compiled(limit=None)
    assert one.step([1e30, 1e30], 0.0, 0.0) == 0
    assert one.fault == FAULT_NUMBER


def test_the_states_know_of_a_command_that_was_cut_off() -> None:
    """After a minute at its limit the command leaves it as soon as the arm is where it should."""

    def stays(windup: float) -> int:
        made = program()
        runner = Runner(Program(**{**vars(made), "windup": windup * made.windup, "most_still": 0}))
        for _ in range(3000):
            assert runner.step([0.0, 0.0], 1.0, 0.0) == 0.4
        return sum(runner.step([0.0, 0.0], 0.0, 0.0) == 0.4 for _ in range(1000))

    assert stays(1.0) == 0
    assert stays(0.0) > 900


@pytest.mark.parametrize("kind", ["double", "float", "16 bits", "20 bits"])
def test_raw_units(kind: str) -> None:
    made = program(kind)
    one = compiled(kind)
    library = one.library
    of_counts, steps = library.a_beam_theta_of_counts, library.a_beam_steps_of_command
    of_counts.restype, steps.argtypes = one._step.restype, [one._step.restype]
    other_way = -1 if "theta" in made.options.reversed else 1
    pushed = -1 if "torque" in made.options.reversed else 1
    for counts in (-40, 0, 1, 33):
        angle = other_way * counts * 2 * np.pi / 4096
        unit = 2.0 ** -made.words.readings[0] if made.words else 1.0
        assert of_counts(counts) * unit == pytest.approx(angle, abs=0.51 * unit, rel=1e-6)
    for torque in (-0.3, 0.0, 0.123):
        unit = 2.0**-made.words.command if made.words else 1.0
        command = round(torque / unit) if made.words else torque
        wanted = pushed * command * unit * 200.0
        assert abs(steps(command) - wanted) <= 0.5 + 1e-4
    if made.words:  # an angle for which there is no word is no reading
        assert of_counts(2**31 - 1) == -made.words.largest - 1
    else:
        assert steps(1e20) == -steps(-1e20) > 2**31 - 200


LAWS: dict[str, dict[str, Any]] = {
    "gains alone": {"D": [[-2.0, -1.0]]},
    "a state that nothing moves": {"A": [[0.5]], "B": [[0.0, 0.0]], "C": [[1.0]], "D": [[-2.0, -1.0]]},
    "a state that nothing sees": {"A": [[0.5]], "B": [[1.0, 2.0]], "C": [[0.0]], "D": [[-2.0, -1.0]]},
    "a double pole": {"A": [[0.6, 0.1], [0.0, 0.6]], "B": [[0.0, 0.1], [0.1, 0.0]], "C": [[1.0, -2.0]],
                      "D": [[-2.0, -1.0]]},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "options"),
    [("gains alone", CodeOptions()), *((law, CodeOptions("fixed", word=16)) for law in LAWS)],
)
def test_laws_of_any_shape(law: str, options: CodeOptions) -> None:
    K = sc.given(**LAWS[law], inputs=["theta", "theta_dot"], feedback="positive", sample_time=0.005)
    before = judged().yardstick.judge(K, judged().slew)
    made = program_of(before, options, "a beam")
    read = read_back(made, compile_program(made))
    assert digital_loss(before, before.yardstick.judge(read, before.slew)).worst < 2e-3


def test_python_runs_the_law_as_it_stands_in_its_matrices() -> None:
    made = program("double", limit=None)
    A, B, C, D = made.system.matrices
    inputs = np.array([one.inputs for one in trial(made, 400) if np.isfinite(one.inputs).all()])
    runner, x = Runner(made), np.zeros(len(A))
    for row in inputs:
        y, angle, feedforward = row[:-2], row[-2], row[-1]
        expected = C @ x + D @ y + made.reference.D[0] * angle + feedforward
        x = A @ x + B @ y + made.reference.B[:, 0] * angle
        found = runner.step(list(y), angle, feedforward)
        assert found == pytest.approx(float(expected[0]), rel=1e-9, abs=1e-9)


def test_single_precision_is_double_within_the_bound_of_rounding() -> None:
    """A sum of k terms errs by at most k·ε of the sum of their sizes, and the law passes it on."""
    made = program("float", limit=None)
    exact = Program(**{**vars(made), "controller": made.controller.__class__(
        **{**{k: v for k, v in vars(made.controller).items() if not k.startswith("_")},
           "system": made.system, "arithmetic": None})})  # fmt: skip
    single, double = Runner(made), Runner(exact)
    system, n = made.system, made.system.nstates
    sizes = np.abs(np.block([[np.eye(n), np.zeros((n, 4))],
                             [np.zeros((1, n + 4))]]))  # fmt: skip
    whole = np.block([[system.A - np.eye(n), system.B, made.reference.B, np.zeros((n, 1))],
                      [system.C, system.D, made.reference.D, np.ones((1, 1))]])  # fmt: skip
    eps, terms = 2.0**-24, n + 5
    carried = np.zeros(n)  # bound of the error of the states
    for row in (sample.inputs for sample in trial(made, 2000)):
        if not np.isfinite(row).all():
            continue
        seen = np.abs([*map(float, double.x), *row])
        local = 1.01 * terms * eps * ((np.abs(whole) + sizes) @ seen)
        allowed = np.abs(system.C[0]) @ carried + local[-1]
        found = [float(one.step(row[:-2], row[-2], row[-1])) for one in (single, double)]
        assert abs(found[0] - found[1]) <= allowed
        growth = np.abs(system.A) @ carried
        carried = growth * (1 + terms * eps) + local[:-1]
