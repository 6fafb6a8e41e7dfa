"""The built guide opens without a network."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOADED = re.compile(r"""<(?:script|img|iframe|link)[^>]*(?:src|href)=["'](?:https?:)?//""")


@pytest.mark.slow
def test_built_pages_load_nothing_from_a_network(tmp_path: Path) -> None:
    for name in ("sphinx", "numpydoc", "myst_parser", "pydata_sphinx_theme", "latex2mathml"):
        pytest.importorskip(name, reason="the extra docs is not installed")
    subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "-q", str(ROOT / "docs"), str(tmp_path)], check=True
    )
    pages = list(tmp_path.rglob("*.html"))
    assert pages
    for page in pages:
        assert not LOADED.search(page.read_text(encoding="utf-8")), page.name
