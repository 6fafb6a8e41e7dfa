"""The command ``paper``."""

from __future__ import annotations

from pathlib import Path

from slewctl.breakdown import computing
from slewctl.cli.terminal import OUT, progress
from slewctl.paper import PARTS, reproduce


def reproduce_paper(out: Path) -> None:
    """Write the report of the paper's tables and figures."""
    from slewctl.report import write_paper  # matplotlib is only needed here

    with progress(len(PARTS)) as step, computing("paper"):
        reproduction = reproduce(step)
        page = write_paper(reproduction, out)
    OUT.print(f"report: {page}")
