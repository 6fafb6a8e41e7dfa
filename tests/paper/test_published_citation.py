"""The paper is cited alike on its page and in CITATION.cff."""

from __future__ import annotations

import re
from pathlib import Path

from slewctl.paper.published import CITATION

ROOT = Path(__file__).parents[2]


def test_citation_is_that_of_the_citation_file() -> None:
    listed = (ROOT / "CITATION.cff").read_text("utf-8").partition("references:")[2]
    for key in ("family-names", "title", "journal", "volume", "issue", "year", "start", "end"):
        found = re.search(rf"\b{key}: (.+)", listed)
        assert found
        assert found[1] in CITATION
