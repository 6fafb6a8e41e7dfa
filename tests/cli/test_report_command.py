"""``slewctl report``: one design from data sheet to code, on one page."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from slewctl.cli.reporting import Logged, report_design
from slewctl.embedded import compiled
from slewctl.errors import InputError

RIGS = Path(__file__).parents[2] / "designs" / "rigs"
SHEET = str(RIGS / "data-sheets" / "lab-servo.toml")
FREE = "beam.stiffness,hub.inertia,hub.friction,damping.1,delay,gain"
PLAIN = """
[arm]
damping_ratio = 0.01
[arm.beam]
length = 1.0
mass_per_length = 0.4
bending_stiffness = 2.0
[arm.hub]
inertia = 0.1
[controller]
method = "given"
pid = { kp = 0.3, kd = 0.4, filter_hz = 10.0 }
[requirements]
phase_margin_deg = 89.0
"""


@pytest.mark.slow
def test_the_whole_way_of_the_lab_servo(tmp_path: Path) -> None:
    logged = Logged(RIGS / "lab-servo.csv", FREE, counts=4096)
    assert report_design(RIGS / "lab-servo.toml", SHEET, logged, tmp_path) == 0
    page = (tmp_path / "index.html").read_text("utf-8")
    assert "The design's arm is the fitted one." in page
    assert "All requirements hold" in page
    assert 'class="slew-motion"' in page
    assert len(page) < 200_000
    for link in re.findall(r'href="([^"#:]+)"', page):
        assert (tmp_path / link).exists(), link
    results = json.loads((tmp_path / "results.json").read_text())
    rows = {row["property"]: row for row in results["arm"]}
    stiffness = rows["beam.bending_stiffness"]
    assert stiffness["changed"]
    assert stiffness["fitted"] == pytest.approx(1.046 * stiffness["sheet"], rel=1e-3)
    assert stiffness["design"] == pytest.approx(stiffness["fitted"], rel=1e-4)
    assert not rows["beam.length"]["changed"]
    assert rows["damping_ratio.2"]["sheet"] == rows["damping_ratio.2"]["design"] == 0.01
    assert results["explained"] > 0.99
    if shutil.which("cc"):
        assert any("Compiled here" in line for line in results["code"])


@pytest.mark.slow
def test_a_design_that_is_not_the_fitted_arm_is_told(tmp_path: Path) -> None:
    text = (RIGS / "lab-servo.toml").read_text("utf-8")
    other = tmp_path / "other.toml"
    text = re.sub(r"bending_stiffness = \S+", "bending_stiffness = 0.22", text)
    other.write_text(text[: text.index("[variations")], encoding="utf-8")
    logged = Logged(RIGS / "lab-servo.csv", "beam.stiffness,gain", counts=4096)
    report_design(other, SHEET, logged, tmp_path / "out")
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert re.search(r"not the fitted one:</b> they differ in [^<]*beam\.bending_stiffness", page)


def test_a_continuous_law_without_log_slew_or_luck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design = tmp_path / "plain.toml"
    design.write_text(PLAIN, encoding="utf-8")
    assert report_design(design, None, Logged(), tmp_path / "out") == 1
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert "give it a sample_time" in page
    assert "The file asks for no slew." in page
    assert "No log was given" in page
    assert "1 requirement fails" in page
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["index.html", "results.json"]
    assert "1 of 2 requirements fail" in capsys.readouterr().out


@pytest.mark.slow
def test_without_a_compiler_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    design = tmp_path / "plain.toml"
    clocked = 'filter_hz = 10.0 }\nsample_time = 0.01\ndiscretise = "tustin"'
    design.write_text(PLAIN.replace("filter_hz = 10.0 }", clocked), encoding="utf-8")

    def none(_: str) -> None:
        return None

    monkeypatch.setattr(compiled.shutil, "which", none)
    report_design(design, None, Logged(), tmp_path / "out")
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert "It was not compiled here: no C compiler is installed" in page
    assert (tmp_path / "out" / "plain.c").exists()


@pytest.mark.parametrize(
    ("logged", "sheet", "says"),
    [
        (Logged(RIGS / "lab-servo.csv", FREE), None, r"^--log: .*--sheet ARM and --free NAMES"),
        (Logged(RIGS / "lab-servo.csv"), SHEET, r"^--log: .*--sheet ARM and --free NAMES"),
        (Logged(None, FREE), SHEET, r"^--free: there is no log"),
        (Logged(None, counts=4096), SHEET, r"^--counts: there is no log"),
        (Logged(RIGS / "none.csv", FREE), SHEET, r"none\.csv: there is no such file"),
        (Logged(RIGS / "lab-servo.csv", "beam.stifness", counts=4096), SHEET, r"did you mean"),
    ],
)
def test_what_does_not_fit_together_is_told(
    tmp_path: Path, logged: Logged, sheet: str | None, says: str
) -> None:
    with pytest.raises(InputError, match=says):
        report_design(RIGS / "lab-servo.toml", sheet, logged, tmp_path / "out")
    assert not (tmp_path / "out").exists()
