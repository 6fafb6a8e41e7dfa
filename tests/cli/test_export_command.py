"""The command that writes what runs, and the check of what it compiles to."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from command_line import slewctl as command
from scipy.io import loadmat

import slewctl as sc
from slewctl.compare import Judge
from slewctl.files import DesignFile, read_design
from slewctl.gate import examine
from slewctl.gate.compiled_design import judge_of_compiled

COMPILER = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler is installed")
DESIGN = """\
[arm]
catalogue = "quanser-flexible-link"
damping_ratio = 0.01
[controller]
method = "given"
pid = { kp = 14.0, ki = 2.0, kd = 0.6, filter_hz = 40.0 }
output = "voltage"
sample_time = 0.002
discretise = "tustin"
[truth]
modes = 4
[requirements]
gain_margin_db = 6.0
"""


def design(folder: Path, text: str = DESIGN) -> Path:
    path = folder / "06-a servo.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_code_is_written_and_says_where_it_comes_from(tmp_path: Path) -> None:
    path = design(tmp_path)
    texts = []
    for folder in ("one", "two"):
        run = command("export", path, "--out", tmp_path / folder)
        assert run.returncode == 0, run.stderr
        files = sorted((tmp_path / folder).iterdir())
        assert [file.name for file in files] == ["a_servo.c", "a_servo.h", "a_servo.ino", "a_servo_test.c"]  # fmt: skip
        texts.append([file.read_text("ascii") for file in files])
    assert texts[0] == texts[1]  # nothing of when
    whole = "".join(texts[0])
    assert str(tmp_path) not in whole  # and of no machine
    margin = re.search(r"gain margin ([\d.]+) dB", run.stdout)
    assert margin
    head = " ".join(texts[0][1][:1500].replace("\n *", " ").split())
    for said in ("06-a servo", "sha256:", "every 0.002 s", f"gain margin {margin[1]} dB"):
        assert said in head, said


@pytest.mark.parametrize("form", ["mat", "npz", "json"])
def test_data_is_the_controller_to_the_last_bit(tmp_path: Path, form: str) -> None:
    run = command("export", design(tmp_path), "--format", form, "--out", tmp_path)
    assert run.returncode == 0, run.stderr
    file = tmp_path / f"a_servo.{form}"
    K = sc.given(file=file)
    assert (K.sample_time, K.sensors) == (0.002, ("theta",))
    own = sc.given(
        pid={"kp": 14.0, "ki": 2.0, "kd": 0.6, "filter_hz": 40.0}, output="voltage",
        sample_time=0.002, discretise="tustin",
    )  # fmt: skip
    for name in "ABCD":
        assert (getattr(K.linear, name) == getattr(own.linear, name)).all()
    if form == "mat":
        held = loadmat(file, simplify_cells=True)
        assert "plus sign" in held["sign"]
        assert held["input_units"] == "rad"
        assert held["output_unit"] == "V"
        assert np.asarray(held["sample_time"]) == 0.002
    if form == "json":
        assert json.loads(file.read_text())["feedback"] == "positive"


@pytest.mark.slow
@COMPILER
@pytest.mark.parametrize(
    "table",
    ["", '[export]\narithmetic = "fixed"\nword = 20\n[slew]\nangle_deg = 30.0\nduration_s = 2.0\n'],
)
def test_the_compiled_code_is_judged_like_the_design(tmp_path: Path, table: str) -> None:
    path = design(tmp_path, DESIGN + "[variations.softer]\nstiffness_factor = 0.9\n" + table)
    values = []
    for options in ([], ["--compiled"]):
        out = tmp_path / "verdicts.json"
        run = command("check", path, "--json", out, *options)
        assert run.returncode == 0, run.stderr + run.stdout
        found = json.loads(out.read_text())["designs"][0]
        told = [row for arm in found["arms"] for row in arm["requirements"]]
        values.append([row["value"] for row in told if row["requirement"] != "stable"])
    assert "compiled" in run.stdout
    assert len(values[0]) == 2
    assert values[1] == pytest.approx(values[0], rel=1e-3 if table else 1e-9)


@pytest.mark.slow
@COMPILER
def test_the_worst_arm_of_a_box_is_the_compiled_codes(tmp_path: Path) -> None:
    box = "[uncertainty]\nbox = { stiffness_factor = [0.8, 1.2] }\nsamples = 0\nsearches = 0\n"
    words = (
        '[export]\narithmetic = "fixed"\nword = 14\n[slew]\nangle_deg = 30.0\nduration_s = 2.0\n'
    )
    file = read_design(design(tmp_path, DESIGN + box + words))
    made, stepped = examine(file), examine(file, compiled=True)
    told = []
    for result in (made, stepped):
        (worst,) = (note for note in result.notes if note.startswith("worst of"))
        told.append((float(re.search(r"disk_margin ([\d.]+)", worst)[1]), worst))  # type: ignore[index]
    (before, _), (after, said) = told
    assert before != after
    loop = sc.close(sc.truth(sc.vary(file.case.arm, stiffness_factor=float(
        re.search(r"stiffness_factor = ([\d.]+)", said)[1])), 4),  # type: ignore[index]
        file.case.objective, _compiled_controller(file))  # fmt: skip
    assert after == pytest.approx(loop.margins.disk.value, rel=1e-3)


def _compiled_controller(file: DesignFile) -> sc.Controller:
    judging = Judge(file.case)
    judge_of_compiled(judging, file.export, file.case.name)
    return judging.own[1]


def test_an_unstable_loop_fails_compiled_as_it_does_otherwise(tmp_path: Path) -> None:
    path = design(tmp_path, DESIGN.replace("kp = 14.0", "kp = -14.0"))
    for options in ([], ["--compiled"]):
        run = command("check", path, *options)
        assert run.returncode == 1, run.stderr
        assert "FAIL" in run.stdout
    assert "nothing was compiled: a program is made of a stable loop alone" in run.stdout


def test_a_machine_without_a_compiler_says_so_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    run = command("check", design(tmp_path), "--compiled")
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert "no C compiler is installed (no-such-compiler)" in run.stderr


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("sample_time = 0.002\ndiscretise", "# discretise"), r"06-a servo.toml:\d+: .*add sample_time and discretise = \"tustin\" .*, such as sample_time = (0\.\d+), "),
        (("kp = 14.0", "kp = -14.0"), r"unstable at .* not to be run; see what to change"),
        (("[truth]", '[export]\narithmetic = "quad"\n[truth]'), r":\d+: export.arithmetic: unknown name 'quad'"),
        (("[truth]", "[export]\nword = 16\n[truth]"), r"export.word: double has no word"),
        (("[truth]", '[export]\narithmetic = "fixed"\nword = 16\n[truth]'), r":\d+: slew: missing: words of fixed point hold what the slew comes to"),
        (("[truth]", '[export]\narithmetic = "fixed"\nword = 40\n[truth]'), r"export.word: words of 40 bits; give 4 to 32"),
        (("[truth]", '[export]\nreversed = ["tip"]\n[truth]'), r"export.reversed.0: unknown name 'tip'"),
        (("[truth]", '[export]\nreversed = ["theta"]\n[truth]'), r":\d+: export.reversed.0: theta has no raw units here, in whose function its sign is turned; give counts_per_turn too"),
        (("[truth]", '[export]\nreversed = ["voltage"]\ncounts_per_turn = 4096\n[truth]'), r"export.reversed.0: voltage has no raw units here.*; give steps_per_unit too"),
        (("[truth]", "[export]\ncounts_per_turn = 0\n[truth]"), r"export.counts_per_turn"),
        (("[truth]", '[export]\narithmetic = "fixed"\nword = 16\nfraction = 17\n[slew]\nangle_deg = 30.0\nduration_s = 2.0\n[truth]'), r":\d+: export.fraction: 17 of 16 bits behind the point overflow: voltage comes to 1.3; give at most 14, or a word of 19 bits"),
    ],
)  # fmt: skip
def test_what_cannot_run_is_refused_in_one_line(
    tmp_path: Path, change: tuple[str, str], match: str
) -> None:
    path = design(tmp_path, DESIGN.replace(*change))
    run = command("export", path, "--out", tmp_path / "out")
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert re.search(match, run.stderr), run.stderr
    assert not (tmp_path / "out").exists()


def test_the_sample_time_that_is_told_keeps_nine_tenths_of_the_margins(tmp_path: Path) -> None:
    continuous = DESIGN.replace('sample_time = 0.002\ndiscretise = "tustin"\n', "")
    told = command("export", design(tmp_path, continuous), "--out", tmp_path / "out").stderr
    T = re.search(r"sample_time = ([\d.e-]+),", told)
    assert T, told
    run = command(
        "export", design(tmp_path, DESIGN.replace("0.002", T[1])), "--out", tmp_path / "out"
    )
    pairs = re.findall(r"margin ([\d.]+) instead of ([\d.]+)", run.stdout)
    assert len(pairs) >= 3
    assert all(float(after) >= 0.89 * float(before) for after, before in pairs)


def test_options_that_mean_nothing_together(tmp_path: Path) -> None:
    run = command("check", design(tmp_path), "--compiled", "--baseline", tmp_path / "b.json", "--changed-only")  # fmt: skip
    assert run.returncode == 2
    assert "--changed-only means nothing with --compiled" in run.stderr


@COMPILER
def test_the_design_in_words_is_shipped_as_it_is_judged(tmp_path: Path) -> None:
    path = Path(__file__).parents[2] / "designs" / "rigs" / "servo-in-words.toml"
    assert command("export", path, "--out", tmp_path).returncode == 0
    flags = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run(
        ["cc", *flags, "servo_in_words.c", "servo_in_words_test.c", "-o", "run"],
        cwd=tmp_path, check=True,
    )  # fmt: skip
    assert subprocess.run([tmp_path / "run"], check=False).returncode == 0


def test_the_lab_servos_code_is_its_designs(tmp_path: Path) -> None:
    """What stands beside the design is what is exported of it, but for the last digits."""
    rigs = Path(__file__).parents[2] / "designs" / "rigs"
    run = command("export", rigs / "lab-servo.toml", "--out", tmp_path)
    assert run.returncode == 0, run.stderr
    kept = sorted((rigs / "lab-servo-code").iterdir())
    assert [file.name for file in kept] == sorted(file.name for file in tmp_path.iterdir())
    number = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")
    for file in kept:
        old, new = file.read_text("ascii"), (tmp_path / file.name).read_text("ascii")
        # All but numbers is the same, the design's hash among it.
        assert number.sub("#", old) == number.sub("#", new), file.name
        values = [[float(text) for text in number.findall(each)] for each in (old, new)]
        np.testing.assert_allclose(values[0], values[1], rtol=1e-6, atol=1e-9)
