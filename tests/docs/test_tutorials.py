"""The code of every tutorial is run, one block after another, and gives the output it shows."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from slewctl.cli.commands import cli

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(.*?)```(?:\n+```text\n(.*?)```)?", re.S)


FIRST_STEPS = DOCS / "tutorials" / "first-ten-minutes.md"
PAGES = [
    *sorted(page for page in (DOCS / "tutorials").glob("*.md") if page != FIRST_STEPS),
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


@pytest.mark.slow
def test_first_steps_can_be_followed_in_an_empty_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"```sh\nslewctl (.*)\n```", FIRST_STEPS.read_text(encoding="utf-8"))
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
