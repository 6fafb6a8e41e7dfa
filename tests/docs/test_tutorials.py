"""The code of every tutorial is run, one block after another, and gives the output it shows."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from slewctl.cli.commands import cli
from slewctl.files import read_arm, read_design

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(.*?)```(?:\n+```text\n(.*?)```)?", re.S)


FIRST_STEPS = DOCS / "tutorials" / "first-ten-minutes.md"
TO_CODE = DOCS / "tutorials" / "from-log-to-code.md"
PAGES = [
    *sorted(
        page for page in (DOCS / "tutorials").glob("*.md") if page not in (FIRST_STEPS, TO_CODE)
    ),
    *(DOCS / f"{name}.md" for name in ("measurements", "commands", "simulation", "export")),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_tutorial_shows_what_its_code_prints(page: Path) -> None:
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
            assert "makes 99.8% of what the output moves by" in said.output
            assert "zero 4.12" in said.output
    # The design holds the arm that is found anew.
    found = read_arm(Path("fit/fitted.toml"))
    arm = read_design(Path("lab-servo.toml")).case.arm
    np.testing.assert_allclose(found.hub.inertia, arm.hub.inertia, rtol=1e-3)
    np.testing.assert_allclose(
        float(found.beam.bending_stiffness), float(arm.beam.bending_stiffness), rtol=1e-3
    )
