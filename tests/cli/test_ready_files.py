"""What users copy, the pre-commit hook and the workflow, asks for options that exist."""

from __future__ import annotations

import re
from pathlib import Path

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
