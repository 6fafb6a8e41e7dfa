"""``slewctl study`` that stands still once its results have so many lines.

However slow or busy the machine is, what comes from outside then finds the study at work.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from slewctl.cli import main
from slewctl.compare import Work, evaluate_point
from slewctl.compare.study import point
from slewctl.compare.study.results_file import Row

# The results that are watched, and how many lines they may have.
RESULTS, LINES = "HELD_STUDY_RESULTS", "HELD_STUDY_LINES"
# A file of this name beside the results lets the study go on.
GO_ON = "go on"


def held(work: Work) -> Sequence[Row]:
    """Return the rows of a point once they may be written."""
    found, results = evaluate_point(work), Path(os.environ[RESULTS])
    while (
        results.read_bytes().count(b"\n") >= int(os.environ[LINES])
        and not results.with_name(GO_ON).exists()
    ):
        time.sleep(0.02)
    return found


def run() -> None:
    """Run the command line with it."""
    point.evaluate_point = held
    main()
