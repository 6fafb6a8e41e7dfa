"""The commands that simulate a design's slew and compare its commands, and slews in the gate."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from slewctl.cli.shaping import shape_design
from slewctl.cli.simulating import simulate_design
from slewctl.compare import Judge
from slewctl.errors import InputError
from slewctl.files import read_design
from slewctl.gate import check_file

SERVO = """
[arm]
damping_ratio = 0.008
beam = { length = 0.38, mass_per_length = 0.17, bending_stiffness = 0.2128 }
hub = { inertia = 0.00245, friction = 0.021 }
actuator = { torque_limit = 0.12 }

[controller]
method = "given"
pid = { kp = 0.3, kd = 0.03, filter_hz = 30.0 }
sample_time = 0.005
discretise = "tustin"

[truth]
modes = 3

[slew]
angle_deg = 60.0
duration_s = 0.6
horizon_s = 1.1
"""
REQUIRED = """
[requirements]
settling_time_max = 0.9
torque_peak_max = 0.12

[variations.softer]
stiffness_factor = 0.7
"""


def write(folder: Path, slew: str = "", rest: str = REQUIRED, servo: str = SERVO) -> Path:
    path = folder / "servo.toml"
    path.write_text(servo + slew + rest)
    return path


@pytest.mark.slow
def test_requirements_are_judged_on_the_slew_as_it_happens(tmp_path: Path) -> None:
    ideal = check_file(write(tmp_path))
    notes = [f.verdict.note for f in ideal.findings if not f.verdict.passed]
    assert notes
    assert all("the actuator has 0.12" in note for note in notes)
    met = check_file(write(tmp_path, "saturate = true\n"))
    peaks = [f.verdict for f in met.findings if f.verdict.requirement == "torque_peak_max"]
    assert [verdict.value for verdict in peaks] == [0.12, 0.12]
    assert all(f.verdict.passed for f in met.findings)
    stuck = check_file(
        write(tmp_path, "saturate = true\n[slew.conditions]\ncoulomb_friction = 0.03\n")
    )
    assert not all(f.verdict.passed for f in stuck.findings)


def test_variations_meet_the_command_of_the_files_own_arm(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, 'shaper = "zvd"\nprofile = "versine"\n'))
    judge = Judge(design.case)
    own, varied = judge.evaluate("", 0).judgement, judge.vary(design.variations[0].arm)
    assert own.slew.shaper.times == varied.slew.shaper.times
    assert own.finer.slew == own.slew
    assert own.response.summary.residual_m < varied.response.summary.residual_m


def test_simulate_prints_measures_and_writes_all_signals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, "saturate = true\n[slew.conditions]\nnoise = false\nmissed = 0.01\n")
    simulate_design(path, None, None, tmp_path / "out")
    printed = capsys.readouterr().out
    for name in ("settling_time", "torque_peak", "slew_energy", "saturation_time", "seed"):
        assert name in printed
    with (tmp_path / "out" / "signals.csv").open() as file:
        rows = list(csv.DictReader(file))
    judged = Judge(read_design(path).case).evaluate("", 0).judgement
    assert max(abs(float(row["torque"])) for row in rows) == judged.response.summary.peak_torque
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert results["summary"]["peak_torque"] == 0.12
    assert "<svg" in (tmp_path / "out" / "index.html").read_text()
    simulate_design(path, "softer", 0.001, None)
    assert "0.001 s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("slew", "line", "told"),
    [
        ("saturate = 1\n", 21, "give true or false"),
        ('profile = "scurve"\n', 21, "'s-curve'"),
        ('shaper = "zvdd"\n', 21, "'zvd'"),
        ("modes = 2\n", 21, "modes of no shaper"),
        ('shaper = "ei3"\nmodes = 3\n', 21, "sample every 0.00328 s"),
        ("[slew.conditions]\njitter = 0.004\n", 22, "at most 0.0025 s"),
        ("[slew.conditions]\nfriction = 0.1\n", 22, "unknown key"),
        ("[slew.conditions]\nbacklash_deg = 1.0\n", 22, "no joint"),
        ("[slew.conditions]\nseed = 1\n", 22, "nothing is random"),
        ("[slew.conditions]\nnoise = true\n", 22, "controller.limits and noise"),
        ("[[slew.conditions.loads]]\ntime_s = 0.1\n", 21, "a torque or a tip_force"),
        ("[[slew.conditions.loads]]\ntime_s = -0.1\ntorque = 1.0\n", 22, "greater"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(
    tmp_path: Path, slew: str, line: int, told: str
) -> None:
    result = check_file(write(tmp_path, slew))
    assert result.status == "broken"
    assert told in result.error
    assert f"servo.toml:{line}: slew" in result.error


def test_a_value_of_an_option_is_told_at_the_option(tmp_path: Path) -> None:
    path = write(tmp_path)
    for step in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match=r"^--step: "):
            simulate_design(path, None, step, None)
    for error in (0.0, 1.5, float("nan")):
        with pytest.raises(InputError, match=r"^--error: "):
            shape_design(path, None, error, None)


def test_a_variation_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--variation.*softer"):
        simulate_design(write(tmp_path), "soft", None, None)
    path = write(tmp_path, rest="")
    with pytest.raises(InputError, match="has no variations"):
        simulate_design(path, "soft", None, None)


def test_shape_prints_and_writes_what_each_shaper_costs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape_design(write(tmp_path, servo=SERVO.replace("0.6", "0.8")), None, 0.1, tmp_path / "out")
    printed = capsys.readouterr().out
    for name in ("zvd", "ei3", "sampled", "robust", "versine"):
        assert name in printed
    with (tmp_path / "out" / "sensitivity.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert all(float(r["robust"]) <= 0.05 for r in rows if abs(float(r["error"])) <= 0.1)
    assert "<svg" in (tmp_path / "out" / "index.html").read_text()


@pytest.mark.parametrize(
    ("servo", "told"),
    [
        (SERVO.replace("0.6", "0.15"), r":19: slew\.duration_s: .*take at least 0\.\d+ s"),
        (SERVO.replace("[slew]", "[other]"), "slew: missing"),
    ],
)
def test_shape_refuses_with_what_would_work(tmp_path: Path, servo: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        shape_design(write(tmp_path, servo=servo), None, 0.1, None)


def test_a_slew_that_the_equations_cannot_describe_fails_with_the_reason(tmp_path: Path) -> None:
    servo = SERVO.replace("angle_deg = 60.0", "angle_deg = 170.0").replace("0.6", "0.12")
    servo = servo.replace("stiffness = 0.2128", "stiffness = 0.01")
    result = check_file(write(tmp_path, "nonlinear = true\n", servo=servo))
    assert result.status == "failed"
    notes = [f.verdict.note for f in result.findings if f.verdict.quantity.kind == "slew"]
    assert notes
    assert all("slew more gently" in note for note in notes)
