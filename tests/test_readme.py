"""What the README promises is run: its script, and the script in designs/."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def run(code: list[str]) -> str:
    return subprocess.run(
        [sys.executable, *code], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout


def test_readme_script_runs_and_judges_on_the_truth() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", readme, flags=re.S)
    said = run(["-c", script])
    assert "stable            on 20, 40, 80 modes" in said
    assert "verified by" in said


@pytest.mark.slow
def test_designs_script_writes_a_report(tmp_path: Path) -> None:
    said = run(["designs/compare_bases.py", str(tmp_path / "out")])
    assert said.strip().endswith("index.html")
    assert (tmp_path / "out" / "results.json").stat().st_size > 0
