"""The gate: variations judged as a person would by hand, and nothing hidden by a broken file."""

from __future__ import annotations

import os
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from quick_design import QUICK

from slewctl import Hub, assemble, close, generalised_plant, lqg, truth
from slewctl.arm import vary
from slewctl.basis import create
from slewctl.check import NOMINAL, accept, to_annotations
from slewctl.check.baseline import Baseline
from slewctl.cli.commands import cli
from slewctl.compare import Judge
from slewctl.errors import DesignError
from slewctl.files import read_design
from slewctl.gate import check_designs, check_file, examine
from slewctl.gate.fingerprint import fingerprint

fingerprint_module = sys.modules[
    "slewctl.gate.fingerprint"
]  # the package has a function of that name

FAST = (
    QUICK
    + """\
h2_loss_max = 0.5
"""
)
VARIED = FAST + (
    "[variations.heavy]\npayload_mass = 0.1\n"
    "[variations.light-hub]\nhub_inertia = 0.05\n"
    "[variations.light-hub.requirements]\ndisk_margin = 0.9\n"
)


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_variation_is_the_nominal_controller_on_the_truth_of_the_varied_arm(
    tmp_path: Path,
) -> None:
    design = read_design(written(tmp_path, "x.toml", VARIED))
    result = examine(design)
    case = design.case
    model = assemble(case.arm, create(case.basis, case.n))
    controller = lqg(generalised_plant(model, case.objective))
    for name, arm in {
        NOMINAL: case.arm,
        "heavy": vary(case.arm, payload_mass=0.1),
        "light-hub": replace(case.arm, hub=Hub(0.05)),
    }.items():
        real = truth(arm, case.truth_modes)
        loop = close(real, case.objective, controller)
        best = lqg(generalised_plant(real, case.objective)).h2_cost
        values = {name: reading.value for name, reading in result.recorded[name].items()}
        margins = loop.margins
        # The worse of the values on this truth and on one of twice the modes, which agree.
        gain = min(margins.gain_db.value, margins.gain_reduction_db.value)
        for known, value in (
            (gain, values["gain_margin_db"]), (margins.disk.value, values["disk_margin"])
        ):  # fmt: skip
            assert value == pytest.approx(known, rel=1e-6)
            assert value <= known
        if name != "light-hub":
            assert values["h2_loss"] == pytest.approx(loop.h2.value / best - 1, rel=1e-2)
    asked = {
        arm: [f.verdict.requirement for f in result.findings if f.arm == arm]
        for arm in result.recorded
    }
    common = ["stable", "gain_margin_db", "h2_loss_max"]
    assert asked == {NOMINAL: common, "heavy": common, "light-hub": ["stable", "disk_margin"]}
    lines = [f.line for f in result.findings]
    assert lines == [17, 18, 19, 20, 18, 19, 24, 25]


def test_the_case_itself_is_a_variation_that_changes_nothing(tmp_path: Path) -> None:
    case = read_design(written(tmp_path, "x.toml", FAST)).case
    judge = Judge(case)
    own, same = judge.evaluate(*judge.chosen).judgement, judge.vary(case.arm)
    np.testing.assert_array_equal(own.poles, same.poles)
    assert own.margins.disk.value == same.margins.disk.value
    assert own.margins.phase_deg.value == same.margins.phase_deg.value
    assert own.finer.loss == same.finer.loss


def test_the_controller_is_designed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    designed = []
    design = Judge.design
    monkeypatch.setattr(Judge, "design", lambda *a: designed.append(a[1:]) or design(*a))
    examine(read_design(written(tmp_path, "x.toml", VARIED)))
    assert designed == [("clamped-free", 2)]


def test_a_broken_design_hides_nothing_of_the_others(tmp_path: Path) -> None:
    written(tmp_path, "a.toml", FAST.replace("n = 2", "n = -2"))
    written(tmp_path, "b.toml", "[arm")
    written(tmp_path, "c.toml", FAST.replace("tip = 0.03", "tip_deflection = 0.03"))
    written(tmp_path, "d.toml", FAST)
    (tmp_path / "e.toml").symlink_to(tmp_path / "nowhere")
    seen: list[str] = []
    results = check_designs([tmp_path], seen.append)
    assert [r.status for r in results] == ["broken", "broken", "broken", "passed", "broken"]
    assert [r.error_line for r in results[:3]] == [7, 1, 10]
    assert [r.name for r in results] == ["a", "b", "c", "d", "e"]
    for result in results:
        if result.error:
            assert result.error.startswith(str(result.file))
            assert result.error.count(str(result.file)) == 1
            assert "\n" not in result.error
    assert seen == [str(result.file) for result in results]


def test_each_fault_of_a_file_is_an_annotation_at_its_own_line(tmp_path: Path) -> None:
    path = written(tmp_path, "x.toml", FAST.replace("tip = 0.03", "tipp = 0.03") + "zz = 1\n")
    rows = path.read_text().split("\n")
    wanted = [next(k for k, row in enumerate(rows, 1) if word in row) for word in ("tipp", "zz")]
    result = check_file(path)
    assert [line for _, line in result.faults] == wanted
    assert "\n".join(text for text, _ in result.faults) == result.error
    annotations = to_annotations([result], tmp_path)
    assert [f"line={line}," in told for line, told in zip(wanted, annotations, strict=True)] == [
        True,
        True,
    ]
    assert all("%0A" not in told for told in annotations)


def test_a_variation_that_cannot_be_judged_keeps_what_was_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise DesignError("no optimum", where="plant", remedy="change it")

    monkeypatch.setattr("slewctl.gate.run.on_other_arm", refuse)
    result = check_file(written(tmp_path, "x.toml", VARIED))
    assert result.status == "broken"
    assert "no optimum; change it" in result.error
    assert [f.verdict.requirement for f in result.findings] == [
        "stable",
        "gain_margin_db",
        "h2_loss_max",
    ]


@pytest.mark.parametrize(
    "error",
    [np.linalg.LinAlgError("SVD did not converge"), ZeroDivisionError("x"), ValueError("a\nb")],
)
def test_a_breakdown_of_arithmetic_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(Judge, "evaluate", fail)
    result = check_file(written(tmp_path, "x.toml", FAST))
    assert result.status == "broken"
    assert "the computation broke down" in result.error
    assert type(error).__name__ in result.error
    assert "\n" not in result.error


def test_unchanged_designs_are_skipped_and_only_those(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, "x.toml", FAST)
    empty = Baseline(tmp_path / "b.json", {})
    first = check_file(path, baseline=empty, changed_only=True)
    assert first.status == "passed"
    (unmarked,) = check_designs([path], marked=False)
    assert unmarked == replace(first, fingerprint="", seconds=unmarked.seconds)
    baseline, _ = accept(empty, [first])
    again = check_file(path, baseline=baseline, changed_only=True)
    assert (again.status, again.findings) == ("unchanged", ())
    path.write_text(FAST + "# a comment\n")
    assert check_file(path, baseline=baseline, changed_only=True).status == "passed"
    path.write_text(FAST)
    monkeypatch.setattr(fingerprint_module, "_programs", lambda: "slewctl 0.0.1")
    assert check_file(path, baseline=baseline, changed_only=True).status == "passed"


def test_fingerprints_cover_text_and_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    programs = fingerprint_module._programs()
    for name in ("python ", "slewctl ", "numpy ", "scipy ", "control "):
        assert name in programs
    assert fingerprint("a") == fingerprint("a") != fingerprint("b")
    before = fingerprint("a")
    monkeypatch.setattr(fingerprint_module, "_programs", lambda: programs + "x")
    assert fingerprint("a") != before


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="needs links")
def test_one_design_under_two_names_is_judged_once(tmp_path: Path) -> None:
    path = written(tmp_path, "x.toml", "[arm")
    (tmp_path / "y.toml").symlink_to(path)
    assert len(check_designs([tmp_path])) == 1


def test_every_fault_of_a_file_is_an_annotation_at_its_own_line(tmp_path: Path) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(
        '[arm]\ncatalogue = "paper-beam"\ndamping_ratio = 0.005\n[model]\nbasis = "slewing"\n'
        'n = 1\n[controller]\nmethod = "lqg"\nlimits = { tip = 0.1, torque = 1.0 }\n'
        "noise = { torque = 0.1, theta = 0.01 }\n[requirements]\ngain_margin = 6\n"
        '"phase.margin" = 3\nrequirements = 1\n[variations.a]\npayload_mas = 1\n',
        encoding="utf-8",
    )
    (result,) = check_designs([path])
    lines = [line for _, line in result.faults]
    assert lines == [12, 13, 14, 16]
    annotations = to_annotations([result], tmp_path)
    assert [int(re.findall(r"line=(\d+)", text)[0]) for text in annotations] == lines
    assert all(text.startswith("::error file=faults.toml,") for text in annotations)


def test_what_nobody_reads_is_not_looked_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of thousands of faults twenty are told, and only for those a name is suggested."""
    asked: list[str] = []
    monkeypatch.setattr(
        "slewctl.errors.get_close_matches", lambda word, *_, **__: asked.append(word) or []
    )
    path = tmp_path / "many.toml"
    path.write_text("[requirements]\n" + "".join(f"key{k} = {k}\n" for k in range(1900)))
    (result,) = check_designs([path])
    assert len(result.faults) == 20
    assert "more faults" in result.error
    assert len(asked) <= 100


@pytest.mark.slow
def test_an_arm_without_damping_is_judged_and_fails(tmp_path: Path) -> None:
    """A mode that feedback moves by 5e-13 of its frequency: on which side nothing can prove."""
    path = tmp_path / "undamped.toml"
    assert CliRunner().invoke(cli, ["init", str(path)]).exit_code == 0
    path.write_text(re.sub(r"damping_ratio = .*", "damping_ratio = 0.0", path.read_text()))
    checked = CliRunner().invoke(cli, ["check", str(path)])
    assert checked.exit_code == 1
    assert "nothing is certain of the loop" in checked.output
    assert "BROKEN" not in checked.output
    climbed = CliRunner().invoke(cli, ["ladder", str(path)])
    assert climbed.exit_code in (0, 1)
    assert "not proved" in climbed.output
