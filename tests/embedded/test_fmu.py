"""The FMU is valid, says what it holds, and commands what the program does, when it is due."""

from __future__ import annotations

import io
import sys
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu
from programs import KINDS, STRICT, WITH_COMPILER, judged, program, run

from slewctl.embedded import CodeOptions, Program, Runner, fmu_bytes, program_of
from slewctl.embedded.runner import FAULT_READING
from slewctl.errors import InputError

pytestmark = WITH_COMPILER
T = 0.02
LATE = 0.007


@cache
def late_program() -> Program:
    return program_of(judged(delay=LATE), CodeOptions(), "late")


class Unit:
    """An FMU that is loaded, its variables by name."""

    def __init__(self, made: Program, folder: Path) -> None:
        file = folder / "unit.fmu"
        file.write_bytes(fmu_bytes(made))
        assert validate_fmu(str(file)) == []
        told = fmpy.read_model_description(str(file))
        self.names = {each.name: each for each in told.modelVariables}
        self.slave = FMU2Slave(
            guid=told.guid,
            unzipDirectory=fmpy.extract(str(file), str(folder / "unit")),
            modelIdentifier=told.coSimulation.modelIdentifier,
        )
        self.slave.instantiate()

    def start(self, angle: float = 0.0, at: float = 0.0) -> None:
        self.slave.setupExperiment(startTime=at)
        self.slave.enterInitializationMode()
        self.set(start_angle=angle)
        self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        names = [self.names[name].valueReference for name in values]
        self.slave.setReal(names, list(values.values()))

    def command(self) -> float:
        return float(self.slave.getReal([self.names["torque"].valueReference])[0])

    def fault(self) -> int:
        return int(self.slave.getInteger([self.names["fault"].valueReference])[0])


@pytest.fixture
def loaded(tmp_path: Path) -> Iterator[Any]:
    units: list[Unit] = []

    def load(made: Program) -> Unit:
        units.append(Unit(made, tmp_path / f"{len(units)}"))
        return units[-1]

    for k in range(3):
        (tmp_path / f"{k}").mkdir()
    yield load
    for unit in units:
        unit.slave.terminate()
        unit.slave.freeInstance()


def words_of(made: Program, values: list[float]) -> list[Any]:
    """Return readings, reference angle and feedforward as the program takes them."""
    words = made.words
    if words is None:
        return values
    bits = [*words.readings, words.angle, words.command]
    return [int(np.floor(np.ldexp(v, b) + 0.5)) for v, b in zip(values, bits, strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_it_commands_what_the_program_does(loaded: Any, kind: str) -> None:
    made = program(kind)
    unit, runner = loaded(made), Runner(made)
    unit.start(0.3, at=1.0)
    runner.init(words_of(made, [0.0, 0.0, 0.3, 0.0])[2])
    names = [*made.sensors, "angle", "feedforward"]
    rng = np.random.default_rng(1)
    for k in range(200):
        values = (rng.uniform(-1, 1, 4) * made.amplitudes).tolist()
        unit.set(**dict(zip(names, values, strict=True)))
        *y, angle, feedforward = words_of(made, values)
        expected = float(runner.step(y, angle, feedforward))
        if made.words:
            expected = float(np.ldexp(expected, -made.words.command))
        # Due at once: there before the step, and held after it.
        assert unit.command() == expected
        unit.slave.doStep(1.0 + T * k, T)
        assert unit.fault() == runner.fault == 0


def test_between_samples_it_is_held_and_comes_when_it_is_due(loaded: Any) -> None:
    made = late_program()
    unit, runner = loaded(made), Runner(made)
    unit.start()
    step, commands, held = 0.001, [], 0.0
    for k in range(200):
        t = step * k
        unit.set(theta=np.sin(3 * t), theta_dot=3 * np.cos(3 * t), angle=0.0)
        if k % 20 == 0:
            commands.append((t + LATE, runner.step([np.sin(3 * t), 3 * np.cos(3 * t)], 0.0, 0.0)))
        unit.slave.doStep(t, step)
        while commands and commands[0][0] <= t + step + 1e-9:
            held = commands.pop(0)[1]
        assert unit.command() == held, k


def test_steps_of_any_length_take_the_same_samples(loaded: Any) -> None:
    one, many = loaded(late_program()), loaded(late_program())
    for unit in (one, many):
        unit.start()
        unit.set(theta=0.4)
    one.slave.doStep(0.0, 0.2)
    t, rng = 0.0, np.random.default_rng(3)
    cuts = np.sort(rng.uniform(0, 0.2, 37))
    for end in [*cuts, 0.2]:
        many.slave.doStep(t, end - t)
        t = end
    assert one.command() == many.command() != 0.0


@pytest.mark.parametrize("began", [0.0, 86_400.0, 1.7e9])
def test_a_master_that_adds_its_steps_up_meets_every_sample(loaded: Any, began: float) -> None:
    made = program()
    unit, runner = loaded(made), Runner(made)
    unit.start(at=began)
    t = began
    for k in range(12_000):
        theta = float(np.sin(0.37 * k))
        unit.set(theta=theta)
        expected = runner.step([theta, 0.0], 0.0, 0.0)
        assert unit.command() == expected, k
        unit.slave.doStep(t, T)
        t += T
        # Until the inputs of the new time are known it is what was commanded.
        assert unit.command() == expected


def test_before_it_runs_and_what_it_refuses(loaded: Any) -> None:
    unit = loaded(program())
    unit.slave.setupExperiment()
    with pytest.raises(FMICallException):
        unit.slave.doStep(0.0, T)
    unit.slave.enterInitializationMode()
    unit.set(start_angle=1.0, theta=1.0, angle=1.0)
    assert abs(unit.command()) < 1e-9  # at rest where it starts
    unit.slave.exitInitializationMode()
    assert abs(unit.command()) < 1e-9
    with pytest.raises(FMICallException):
        unit.set(start_angle=0.5)
    for step in (float("inf"), float("nan"), -T):
        with pytest.raises(FMICallException):
            unit.slave.doStep(0.0, step)
    unit.slave.doStep(0.0, T)
    with pytest.raises(FMICallException):
        unit.slave.doStep(5 * T, T)  # not where it is


def test_states_are_kept_and_a_reset_begins_anew(loaded: Any) -> None:
    unit = loaded(late_program())
    unit.start()
    unit.set(theta=0.4)
    unit.slave.doStep(0.0, 0.1)
    kept = unit.slave.getFMUState()
    after = []
    for _ in range(2):
        unit.slave.setFMUState(kept)
        unit.slave.doStep(0.1, 0.1)
        after.append(unit.command())
    assert after[0] == after[1]
    unit.slave.freeFMUState(kept)
    unit.slave.reset()
    unit.start()
    unit.set(theta=0.4)
    unit.slave.doStep(0.0, 0.2)
    assert unit.command() == after[0]


def test_a_reading_that_is_none_ends_in_a_fault(loaded: Any) -> None:
    for kind in ("double", "16 bits"):
        unit = loaded(program(kind))
        unit.start()
        unit.set(theta=float("nan"))
        for k in range(1100):
            unit.slave.doStep(T * k, T)
        assert unit.fault() == FAULT_READING
        assert unit.command() == 0.0


def test_the_same_program_gives_the_same_bytes_without_a_machines_path() -> None:
    first, second = fmu_bytes(program()), fmu_bytes(program())
    assert first == second
    assert fmu_bytes(program("float")) != first
    with zipfile.ZipFile(io.BytesIO(first)) as archive:
        names = archive.namelist()
        assert names[0] == "modelDescription.xml"
        assert {"sources/a_beam.c", "sources/a_beam.h", "sources/a_beam_fmi2.c"} <= set(names)
        assert all(b"/tmp" not in archive.read(name) for name in names)
        root = ET.fromstring(archive.read("modelDescription.xml"))
    # Other platforms' binaries are built of these.
    files = {
        f"sources/{each.get('name')}" for each in root.iterfind("CoSimulation/SourceFiles/File")
    }
    assert files == {name for name in names if name.endswith(".c")}


@pytest.mark.parametrize("kind", ["double", "float", "16 bits"])
def test_its_sources_are_strict_c(tmp_path: Path, kind: str) -> None:
    with zipfile.ZipFile(io.BytesIO(fmu_bytes(program(kind)))) as archive:
        archive.extractall(tmp_path)
    done = run(["cc", *STRICT, "-c", "a_beam_fmi2.c", "-o", "fmi2.o"], tmp_path / "sources")
    assert done.returncode == 0, done.stderr.decode()


def test_a_machine_without_a_name_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "sunos5")
    with pytest.raises(InputError, match=r"^--format: FMI 2\.0 has no name for .* on sunos5"):
        fmu_bytes(program())


def test_every_variable_has_its_unit() -> None:
    with zipfile.ZipFile(io.BytesIO(fmu_bytes(program()))) as archive:
        text = archive.read("modelDescription.xml").decode()
    root = ET.fromstring(text)
    told = {each.get("name"): each[0].get("unit") for each in root.iter("ScalarVariable")}
    units = dict(zip(program().sensors, program().units, strict=True))
    expected = {**units, "angle": "rad", "feedforward": "N·m", "torque": "N·m",
                "start_angle": "rad", "fault": None}  # fmt: skip
    assert told == expected
    (outputs,) = root.iter("Outputs")
    assert outputs[0].get("dependencies") == "1 2 3 4"
    with zipfile.ZipFile(io.BytesIO(fmu_bytes(late_program()))) as archive:
        late = ET.fromstring(archive.read("modelDescription.xml"))
    assert [each.get("dependencies") for each in late.iter("Unknown")] == [""] * 4
