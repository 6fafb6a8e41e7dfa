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


def test_readme_scripts_run_and_judge_on_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script, own_arm = re.findall(r"```python\n(.*?)```", readme, flags=re.S)
    said = run(["-c", script])
    assert "stable            on 20, 40, 80 modes" in said
    assert "verified by" in said
    monkeypatch.chdir(tmp_path)
    exec(own_arm, {})
    said = capsys.readouterr().out
    assert "stable            on 20, 40, 80 modes" in said
    assert (tmp_path / "k.json").stat().st_size > 0


TYPED = """
loop = sc.close(problem.truth, problem.objective, sc.lqg(K_plant, sample_time=0.01))
stable: bool = loop.stable
if isinstance(loop, sc.SampledLoop):
    period: float = loop.sample_time
else:
    assert_type(loop, sc.Loop)
assert_type(sc.close(problem.truth, problem.objective, K), sc.Loop | sc.SampledLoop)
"""


@pytest.mark.slow
def test_readme_script_and_a_sampled_loop_are_typed(
    tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    api = pytest.importorskip("mypy.api", reason="the extra dev is not installed")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script = re.findall(r"```python\n(.*?)```", readme, flags=re.S)[0]
    file = tmp_path / "script.py"
    plant = 'K_plant = problem.plant("clamped-free", n=2)\n'
    file.write_text(f"from typing import assert_type\n\n{script}{plant}{TYPED}", encoding="utf-8")
    # What mypy knows of numpy and slewctl, and has not changed, is kept from run to run.
    cache = getattr(pytestconfig, "cache", None)
    folder = cache.mkdir("mypy") if cache else tmp_path / "cache"
    said, errors, status = api.run(
        ["--strict", "--config-file", str(ROOT / "pyproject.toml"), "--cache-dir",
         str(folder), str(file)]
    )  # fmt: skip
    assert status == 0, said + errors


@pytest.mark.slow
def test_designs_script_writes_a_report(tmp_path: Path) -> None:
    said = run(["designs/compare_bases.py", str(tmp_path / "out")])
    assert said.strip().endswith("index.html")
    assert (tmp_path / "out" / "results.json").stat().st_size > 0
