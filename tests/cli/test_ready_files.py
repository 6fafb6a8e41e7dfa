"""What users copy, the pre-commit hook and the workflow, asks for options that exist."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import pytest

import slewctl
from slewctl.cli.commands import check_command

ROOT = Path(__file__).parents[2]
OPTIONS = {name for parameter in check_command.params for name in parameter.opts}


def asked(text: str) -> set[str]:
    """Return the long options in what follows ``slewctl check`` or is kept for it."""
    calls = re.findall(r"(?:slewctl check|options\+?=\()(.*)", text)
    return {option for call in calls for option in re.findall(r"--[a-z-]+", call)}


def test_the_hook_takes_designs_and_nothing_else() -> None:
    text = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    assert re.search(r"^- id: slewctl-check$", text, re.M)
    assert re.search(r"^  types: \[toml\]$", text, re.M)
    (pattern,) = re.findall(r"^  files: (.*)$", text, re.M)
    taken = ["designs/01.toml", "designs/deep/er/x.toml"]
    left = ["pyproject.toml", "old-designs/x.toml", "designs/x.toml.bak", "a/designs/x.toml"]
    assert [name for name in taken + left if re.search(pattern, name)] == taken
    assert asked(text) == {"--quiet"} <= OPTIONS


def test_the_workflow_asks_for_what_there_is() -> None:
    text = (ROOT / ".github" / "workflows" / "slewctl-gate.yml").read_text(encoding="utf-8")
    assert asked(text) == {"--github", "--junit", "--json", "--baseline", "--tolerance"}
    assert asked(text) <= OPTIONS
    # Inputs reach the shell as variables and never as text of a command.
    for script in re.findall(r"^ +run: (?:\|\n((?: {10,}.*\n)+)|(.*))", text, re.M):
        assert "${{" not in "".join(script)


def action_script() -> str:
    """Return the last script of action.yml, which judges the designs."""
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    return textwrap.dedent(text.rpartition("run: |\n")[2])


@pytest.mark.skipif(os.name == "nt" or not shutil.which("bash"), reason="bash runs the action")
@pytest.mark.parametrize("baseline", ["", "accepted.json"])
def test_the_action_judges_the_designs_it_is_given(tmp_path: Path, baseline: str) -> None:
    said = tmp_path / "said"
    program = tmp_path / "slewctl"
    program.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {said}\n')
    program.chmod(0o755)
    given = {"DESIGNS": "designs more/arm.toml", "BASELINE": baseline, "TOLERANCE": "0.05"}
    subprocess.run(
        ["bash", "-euo", "pipefail", "-c", action_script()], check=True,
        env={"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}", **given},
    )  # fmt: skip
    against = ["--baseline", "accepted.json", "--tolerance", "0.05"] if baseline else []
    assert said.read_text().split() == [
        "check", "designs", "more/arm.toml", "--github", *against
    ]  # fmt: skip
    assert asked(action_script()) <= OPTIONS


def test_the_action_names_its_inputs_as_the_guide_does() -> None:
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    declared = re.findall(
        r"^  ([a-z]+):$", text.partition("inputs:\n")[2].partition("runs:")[0], re.M
    )
    told = re.findall(
        r"^\| `([a-z]+)` \|", (ROOT / "docs/gate.md").read_text(encoding="utf-8"), re.M
    )
    assert declared == told == ["designs", "baseline", "tolerance", "python"]
    assert set(re.findall(r"inputs\.([a-z]+)", text)) == set(declared)


def test_what_is_published_is_of_one_version_and_asks_for_the_same_packages() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = (ROOT / ".ci/conda/recipe.yaml").read_text(encoding="utf-8")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f'version: "{slewctl.__version__}"' in recipe
    assert f"version: {slewctl.__version__}\n" in citation
    run = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    packages = {line.strip("- ").replace(" ", "") for line in run.splitlines()}
    assert packages == {f"python{project['requires-python']}", *project["dependencies"]}


@pytest.mark.parametrize(
    "path", [*ROOT.glob(".github/**/*.yml"), ROOT / ".pre-commit-config.yaml", ROOT / "action.yml"],
    ids=lambda path: path.name,
)  # fmt: skip
def test_what_others_read_is_yaml(path: Path) -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    assert yaml.safe_load(path.read_text(encoding="utf-8"))


def test_a_registrys_page_finds_picture_and_pages(tmp_path: Path) -> None:
    for file in ("README.md", ".ci/registry_readme.py"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / file, tmp_path / file)
    subprocess.run(
        [sys.executable, str(tmp_path / ".ci/registry_readme.py"), "some/where", "v1.2.3"],
        check=True,
    )
    text = (tmp_path / "README.md").read_text(encoding="utf-8")
    addresses = re.findall(r"]\(([^)]*)\)", text)
    picture = "https://raw.githubusercontent.com/some/where/v1.2.3/reports/picture.png"
    assert addresses[0] == picture
    pages = "https://github.com/some/where/blob/v1.2.3/"
    own = [address for address in addresses if address != picture]
    assert len(own) > 5
    for address in own:
        assert (ROOT / address.removeprefix(pages)).exists(), address
    assert "    pip install slewctl\n" in text
    assert "OWNER" not in text
