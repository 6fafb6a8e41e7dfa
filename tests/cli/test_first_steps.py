"""From nothing to a design that passes the gate: ``init`` and ``explain``."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from slewctl.arm import catalogue
from slewctl.cli.commands import cli
from slewctl.errors import InputError
from slewctl.files import STARTERS, read_design, starter_files
from slewctl.gate import check_file

ORIGINS = (*STARTERS, *catalogue.names())


@pytest.mark.slow
@pytest.mark.parametrize("origin", ORIGINS)
def test_what_is_begun_with_passes_the_gate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, origin: str
) -> None:
    monkeypatch.chdir(tmp_path)
    said = CliRunner().invoke(cli, ["init", "mine.toml", "--from", origin])
    assert said.exit_code == 0
    assert "mine.toml" in said.output
    result = check_file(Path("mine.toml"))
    assert result.status == "passed", (result.error, result.failures)
    # A person finds out by what is beside each number, and which command is next.
    text = Path("mine.toml").read_text()
    assert "slewctl check mine.toml" in text
    assert text.count("#") > 8


@pytest.mark.parametrize("origin", ORIGINS)
def test_no_placeholder_is_left(origin: str) -> None:
    for text in starter_files(origin, "mine.toml").values():
        assert "{file}" not in text
        assert "{response}" not in text


def test_nothing_that_is_there_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text("measured for a day")
    with pytest.raises(InputError, match="is there already"):
        CliRunner().invoke(
            cli, ["init", str(tmp_path / "rig.toml"), "--from", "measured"],
            catch_exceptions=False,
        )  # fmt: skip
    assert [path.name for path in tmp_path.iterdir()] == ["rig.csv"]
    assert (tmp_path / "rig.csv").read_text() == "measured for a day"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [(["arm.txt"], "name it arm.toml"), (["arm.toml", "--from", "paper-bean"], "paper-beam")],
)
def test_a_wrong_name_is_told_the_right_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=told):
        CliRunner().invoke(cli, ["init", *arguments], catch_exceptions=False)
    assert not list(tmp_path.iterdir())


def test_explain_says_what_limits_a_design(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(starter_files("modal-data", "mine.toml")["mine.toml"])
    assert read_design(tmp_path / "mine.toml").variations
    said = CliRunner().invoke(cli, ["explain", str(tmp_path / "mine.toml")])
    assert said.exit_code == 0
    assert "The one with the least room is" in said.output
    assert "hange first" in said.output or "None of" in said.output
