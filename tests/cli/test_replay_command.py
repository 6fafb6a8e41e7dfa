"""``slewctl replay``: a log of a slew beside what its design predicts."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import slewctl as sc
from slewctl.cli.commands import cli
from slewctl.compare import Judge
from slewctl.files import read_design

DESIGN = """
[arm]
name = "servo"
damping_ratio = 0.008
[arm.beam]
length = 0.38
mass_per_length = 0.17
bending_stiffness = 0.2128
[arm.hub]
inertia = 0.00245
friction = 0.021
[truth]
modes = 5
[controller]
method = "given"
pid = { kp = 0.3, kd = 0.03, filter_hz = 30.0 }
inputs = ["theta"]
output = "torque"
sample_time = 0.005
discretise = "tustin"
[slew]
angle_deg = 60.0
duration_s = 0.5
"""


def written(folder: Path, *, name: str = "theta_deg") -> tuple[Path, Path]:
    """A design, and the log of its slew, which begins after 0.4 s."""
    design, log = folder / "servo.toml", folder / "slew.csv"
    design.write_text(DESIGN)
    judging = Judge(read_design(design).case)
    judged = judging.evaluate(*judging.chosen).judgement
    made = sc.simulate(judged.loop, judged.slew)
    t = 0.005 * np.arange(380)
    torque = np.interp(t - 0.4 + 0.0025, made.t, made.signals["torque"], left=0.0)
    theta = np.degrees(np.interp(t - 0.4, made.t, made.signals["theta"]))
    with log.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", "torque", name])
        rows.writerows(zip(t.tolist(), torque.tolist(), theta.tolist(), strict=True))
    return design, log


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["replay", *map(str, arguments)], catch_exceptions=False)


def test_a_log_of_the_designs_own_slew_agrees(tmp_path: Path) -> None:
    design, log = written(tmp_path)
    said = run(log, design, "--out", tmp_path / "report")
    assert said.exit_code == 0
    assert "from 0.4 s" in said.output
    assert "theta: fit 100.0 %" in said.output
    assert "parts nowhere" in said.output
    assert "margins: " in said.output
    assert {path.name for path in (tmp_path / "report").iterdir()} == {
        "index.html", "signals.csv", "results.json"
    }  # fmt: skip
    page = (tmp_path / "report/index.html").read_text()
    assert "beside its prediction" in page


def test_what_is_wrong_is_told(tmp_path: Path) -> None:
    design, log = written(tmp_path, name="enc")
    with pytest.raises(sc.InputError, match="enc"):
        run(log, design)
    assert run(log, design, "--column", "theta_deg=enc").exit_code == 0
    with pytest.raises(sc.InputError, match="--column"):
        run(log, design, "--column", "theta_deg")
    with pytest.raises(sc.InputError, match=r"nowhere\.csv"):
        run(tmp_path / "nowhere.csv", design)
    (tmp_path / "still.toml").write_text(DESIGN.partition("[slew]")[0])
    with pytest.raises(sc.InputError, match="slew"):
        run(log, tmp_path / "still.toml", "--column", "theta_deg=enc")
