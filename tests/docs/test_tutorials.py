"""The code of every tutorial is run, one block after another, and gives the output it shows."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(.*?)```(?:\n+```text\n(.*?)```)?", re.S)


PAGES = [
    *sorted((DOCS / "tutorials").glob("*.md")),
    DOCS / "measurements.md",
    DOCS / "commands.md",
    DOCS / "simulation.md",
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
