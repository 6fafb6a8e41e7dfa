"""The guide's list of requirements is that of the code."""

from __future__ import annotations

import re
from pathlib import Path

from slewctl.check import REQUIREMENTS

PAGE = Path(__file__).parents[2] / "docs" / "requirements.md"


def test_the_page_lists_every_requirement_with_its_definition() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \| (.*?) \|$", PAGE.read_text("utf-8"), re.M)
    assert rows == [
        (key, quantity.sense, quantity.unit, quantity.meaning)
        for key, quantity in REQUIREMENTS.items()
    ]
