"""The code of every tutorial is run, one block after another, and gives the output it shows."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from slewctl.cli.commands import cli
from slewctl.files import read_arm, read_design

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(.*?)```(?:\n+```text\n(.*?)```)?", re.S)


FIRST_STEPS = DOCS / "tutorials" / "first-ten-minutes.md"
TO_CODE = DOCS / "tutorials" / "from-log-to-code.md"
OWN_PID = DOCS / "tutorials" / "own-pid.md"
OWN_STUDY = DOCS / "tutorials" / "own-study.md"
# Their commands are followed instead.
FOLLOWED = (FIRST_STEPS, TO_CODE, OWN_PID, OWN_STUDY)
PAGES = [
    *sorted(page for page in (DOCS / "tutorials").glob("*.md") if page not in FOLLOWED),
    *(DOCS / f"{name}.md" for name in ("measurements", "commands", "simulation", "export")),
    *(DOCS / f"{name}.md" for name in ("idea", "choose-basis", "weights", "sampled-controllers")),
    *(DOCS / f"{name}.md" for name in ("dask", "truth", "hub-decides", "h2-by-lmis")),
]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_tutorial_shows_what_its_code_prints(page: Path) -> None:
    if page.stem == "dask":
        pytest.importorskip("distributed")
    names: dict[str, object] = {}
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    assert blocks
    for code, shown in blocks:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(code, str(page), "exec"), names)
        assert printed.getvalue() == shown, code


def commands_of(page: Path) -> list[str]:
    return re.findall(r"```sh\nslewctl (.*)\n```", page.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_first_steps_can_be_followed_in_an_empty_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = commands_of(FIRST_STEPS)
    assert len(commands) > 6
    commands.remove("recommend myarm.toml")  # has tests of its own
    for command in commands:
        said = CliRunner().invoke(cli, shlex.split(command), catch_exceptions=False)
        assert said.exit_code == 0, (command, said.output)
        assert said.output, command
        if command.startswith("check myarm"):
            # What the page says of ten times the torque.
            text = Path("myarm.toml").read_text()
            Path("fast.toml").write_text(text.replace("torque = 0.07", "torque = 0.7"))
            assert CliRunner().invoke(cli, ["check", "fast.toml"]).exit_code == 1
            Path("fast.toml").unlink()
    assert {path.name for path in tmp_path.iterdir()} == {"myarm.toml", "report", "k.json"}


@pytest.mark.slow
def test_a_log_leads_to_code_in_the_folder_of_the_rigs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "rigs"
    shutil.copytree(DOCS.parent / "designs" / "rigs", folder)
    monkeypatch.chdir(folder)
    commands = commands_of(TO_CODE)
    assert len(commands) == 7
    if not shutil.which("cc"):
        commands = [command for command in commands if "--compiled" not in command]
    # The page of the last one, from the fit of the first, has tests of its own.
    for command in commands[:-1]:
        said = CliRunner().invoke(cli, shlex.split(command), catch_exceptions=False)
        assert said.exit_code == 0, (command, said.output)
        if command.startswith("identify"):
            assert "through it the input makes 99.8% of the output" in said.output
            assert "zero 4.12" in said.output
    # The design holds the arm that is found anew.
    found = read_arm(Path("fit/fitted.toml"))
    arm = read_design(Path("lab-servo.toml")).case.arm
    np.testing.assert_allclose(found.hub.inertia, arm.hub.inertia, rtol=1e-3)
    np.testing.assert_allclose(
        float(found.beam.bending_stiffness), float(arm.beam.bending_stiffness), rtol=1e-3
    )


@pytest.mark.slow
def test_a_pid_is_taken_through_the_gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = commands_of(OWN_PID)
    assert len(commands) == 6
    for command in commands:
        said = CliRunner().invoke(cli, shlex.split(command), catch_exceptions=False)
        assert said.exit_code == 0, (command, said.output)
        if command.startswith("worst"):
            assert "[variations.worst]" in said.output
    # An edit that the requirements bear, and the baseline does not.
    text = Path("servo.toml").read_text(encoding="utf-8")
    Path("servo.toml").write_text(text.replace("delay = 0.001", "delay = 0.005"), encoding="utf-8")
    assert CliRunner().invoke(cli, ["check", "servo.toml"]).exit_code == 0
    said = CliRunner().invoke(cli, shlex.split(commands[-1]))
    assert said.exit_code == 1
    assert "worse" in said.output


@pytest.mark.slow
def test_a_study_of_ones_own_is_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = OWN_STUDY.read_text(encoding="utf-8")
    (written,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    Path("boom.toml").write_text(written, encoding="utf-8")
    for command in commands_of(OWN_STUDY):
        said = CliRunner().invoke(cli, [*shlex.split(command), "--workers", "1"])
        assert said.exit_code == 0, (command, said.output)
    rows = pd.read_csv("study/rows.csv.gz")
    assert len(rows) == 12
    lost = rows.groupby(["basis", "n"]).h2_loss.median()
    assert set(lost.index.get_level_values("basis")) == {"clamped-free", "slewing", "arm-matched"}
