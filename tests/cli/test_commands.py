"""The command line as a user meets it: output, exit status, and one line for a mistake."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
from command_line import slewctl

from slewctl import arms

ROOT = Path(__file__).parents[2]
FAST = """
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
hub = { inertia = 0.2 }
[model]
basis = "clamped-free"
n = 2
[controller]
method = "lqg"
limits = { tip = 0.03, torque = 1.0 }
noise = { torque = 0.1, theta = 0.01, theta_dot = 0.1 }
[slew]
angle_deg = 30
duration_s = 2
[truth]
modes = 6
[compare]
orders = [1, 2]
[requirements]
gain_margin_db = 6
"""


@pytest.mark.slow
def test_the_package_runs_as_a_module() -> None:
    command = [sys.executable, "-m", "slewctl", "modes", "paper-beam", "-n", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Invalid value" in done.stderr


@pytest.fixture
def design(tmp_path: Path) -> Path:
    path = tmp_path / "fast.toml"
    path.write_text(FAST, encoding="utf-8")
    return path


def test_check_says_ok_and_exits_with_zero(design: Path) -> None:
    done = slewctl("check", design)
    assert done.returncode == 0, done.stderr
    assert "all requirements hold" in done.stdout
    assert "gain_margin_db" in done.stdout
    assert done.stderr == ""  # quiet in a pipe


def test_check_fails_with_one(design: Path) -> None:
    design.write_text(FAST.replace("gain_margin_db = 6", "gain_margin_db = 60"))
    done = slewctl("check", design)
    assert done.returncode == 1
    assert "FAIL" in done.stdout


def test_check_names_an_unstable_loop(design: Path) -> None:
    # An aggressive controller on two cantilever modes of a beam without a hub.
    design.write_text(FAST.replace("inertia = 0.2", "inertia = 0.0"))
    done = slewctl("check", design)
    assert done.returncode == 1
    assert "unstable at" in done.stdout
    assert "Hz" in done.stdout


MISTAKES = [
    (["check", "nothing.toml"], "no such file or folder"),
    (["modes", "paper-bean"], "did you mean 'paper-beam'"),
    (["modes", "nothing.toml"], "cannot be read"),
    (["compare"], "Missing argument"),
    (["chek"], "No such command"),
    (["modes", "paper-beam", "-n", "0"], "Invalid value"),
]


@pytest.mark.parametrize(("arguments", "words"), MISTAKES, ids=[w for _, w in MISTAKES])
def test_mistakes_exit_with_two_and_say_why(arguments: list[str], words: str) -> None:
    done = slewctl(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_wrong_file_leaves_no_report(design: Path, tmp_path: Path) -> None:
    design.write_text(FAST.replace("n = 2", "n = -2"))
    done = slewctl("compare", design, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"{design}:8: model.n: -2" in done.stderr
    assert not (tmp_path / "out").exists()


def test_impossible_design_is_explained(design: Path) -> None:
    design.write_text(FAST.replace("tip = 0.03", "tip_deflection = 0.03"))
    done = slewctl("check", design)
    assert done.returncode == 2
    assert "the rigid-body rotation is not penalised" in done.stderr
    assert str(design) in done.stderr


@pytest.mark.slow
def test_a_killed_process_of_a_comparison_is_told_once(
    design: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many designs waited for it; nothing is written."""

    class Broken(ThreadPoolExecutor):
        def submit(self, *args: Any, **keys: Any) -> Future[Any]:
            gone: Future[Any] = Future()
            gone.set_exception(BrokenProcessPool("gone"))
            return gone

    monkeypatch.setattr("slewctl.cli.comparing.usable_cores", lambda: 2)
    monkeypatch.setattr("slewctl.cli.comparing.Processes", Broken)
    (tmp_path / "other.toml").write_text(FAST, encoding="utf-8")
    done = slewctl("compare", tmp_path, "--out", tmp_path / "out")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "ended from outside; compare fewer designs at once" in line
    assert not (tmp_path / "out").exists()


def test_compare_writes_everything(design: Path, tmp_path: Path) -> None:
    out = tmp_path / "a" / "b"
    done = slewctl("compare", design, "--out", out, "--parquet")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    short, long = {"truths", "designs"}, {"ladders", "poles", "loops", "slews", "shapes"}
    assert {p.name for p in out.iterdir()} == {
        "index.html", "index.md", "results.json", *(f"{t}.csv" for t in short),
        *(f"{t}.csv.gz" for t in long), *(f"{t}.parquet" for t in short | long),
    }  # fmt: skip
    results = json.loads((out / "results.json").read_text())
    with (out / "designs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(results["cases"][0]["evaluations"]) == 4
    assert {(r["basis"], r["n"]) for r in rows if r["chosen"] == "True"} == {("clamped-free", "2")}
    for row, evaluation in zip(rows, results["cases"][0]["evaluations"], strict=True):
        assert float(row["h2_cost"]) == evaluation["quantities"]["h2_cost"]["value"]


def test_ladder_tells_where_a_design_is_lost(design: Path) -> None:
    kept = slewctl("ladder", design)
    assert kept.returncode == 0, kept.stderr
    first, heading, *rungs = kept.stdout.strip().splitlines()
    assert "is stable with N = 2 to 6 modes" in first
    assert "modes N" in heading
    assert [int(line.split()[0]) for line in rungs] == list(range(2, 7))
    design.write_text(FAST.replace("inertia = 0.2", "inertia = 0.0"))
    lost = slewctl("ladder", design, "-n", "1")
    assert "is lost at N = 2: mode 1 at 2.927 Hz (kept)" in lost.stdout
    assert "unstable at" in lost.stdout


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--basis", "slewin", "did you mean 'slewing'"),
        ("-n", "7", "keep at least 14 modes"),
        ("-n", "70", "a model of 70 functions is larger than any truth"),
    ],
)
def test_impossible_ladders_are_explained(design: Path, option: str, value: str, told: str) -> None:
    """The option is at fault, and no line of the file."""
    done = slewctl("ladder", design, option, value)
    assert done.returncode == 2
    assert done.stderr.startswith(f"slewctl: {option}: ")
    assert done.stderr.count("\n") == 1
    assert told in done.stderr


@pytest.mark.parametrize(
    "command",
    [["ladder", "{study}"], ["study", "{design}", "--out", "out"]],
    ids=["a study for a ladder", "a design for a study"],
)
def test_a_study_and_a_design_are_told_apart(
    design: Path, tmp_path: Path, command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One sentence with the command for what the file is, and no list of its tables."""
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text('[arm]\ncatalogue = "paper-beam"\n[[grid]]\norders = [1]\n')
    done = slewctl(*(word.format(study=study, design=design) for word in command))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr in (
        f"slewctl: {study}:3: a study, no design; run it with slewctl study\n",
        f"slewctl: {design}:9: a design, no study; judge it with slewctl check, or give [[grid]] "
        "tables and no controller\n",
    )
    assert not (tmp_path / "out").exists()


def test_modes_prints_each_basis_and_the_truth() -> None:
    done = slewctl("modes", "paper-beam", "-n", "5", "-m", "2")
    assert done.returncode == 0
    for printed in ("3.854694", "2.927607", "8.760392", "2.927294", "8.760107"):
        assert printed in done.stdout
    assert "converged to" in done.stdout


def test_modes_with_the_hub_held_are_those_of_the_data_sheet() -> None:
    done = slewctl("modes", "two-wing-satellite", "--locked")
    assert done.returncode == 0
    for printed in ("0.250000", "1.567000", "4.387000", "with its hub held"):
        assert printed in done.stdout


def test_modes_takes_a_design_file(design: Path) -> None:
    assert "truth" in slewctl("modes", design, "-n", "2").stdout


def test_arms_lists_the_catalogue_and_tells_about_one() -> None:
    listed = slewctl("arms")
    assert listed.returncode == 0
    for name in arms.names():
        assert name in listed.stdout
    one = slewctl("arms", "quanser-flexible-link")
    assert "source: Quanser" in one.stdout
    assert "uncertain: " in one.stdout
    assert "damping ratio to design with: 0.01 (assumed: " in one.stdout
    assert re.search(r"hub-locked +1 +4\.029\d* +4\.12 +-2\.20%", one.stdout)
    wrong = slewctl("arms", "quanser")
    assert wrong.returncode == 2
    assert "did you mean 'quanser-flexible-link'" in wrong.stderr or "known:" in wrong.stderr


def test_brackets_in_names_are_no_markup(design: Path, tmp_path: Path) -> None:
    odd = tmp_path / "[red]x[b].toml"
    odd.write_text(
        FAST.replace('catalogue = "paper-beam"', 'catalogue = "paper-beam"\nname = "link [/A] 2"')
    )
    checked = slewctl("check", odd)
    assert checked.returncode == 0, checked.stderr
    assert "[red]x[b]" in checked.stdout
    assert "link [/A] 2" in slewctl("modes", odd, "-n", "1").stdout


@pytest.mark.slow
def test_reports_do_not_depend_on_the_number_of_threads(design: Path, tmp_path: Path) -> None:
    """Neither in this process, where BLAS has one, nor in one that is told to have two."""
    assert slewctl("compare", design, "--out", tmp_path / "1").returncode == 0
    environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}
    command = [sys.executable, "-m", "slewctl", "compare", design, "--out", tmp_path / "2"]
    subprocess.run(command, env=environment, check=True, capture_output=True)
    for path in (tmp_path / "1").iterdir():
        assert path.read_bytes() == (tmp_path / "2" / path.name).read_bytes(), path.name
