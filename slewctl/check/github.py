"""Results as workflow commands of GitHub Actions: an annotation at the line that failed.

The format is that of "Workflow commands for GitHub Actions" in GitHub's documentation.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from slewctl._types import FilePath
from slewctl.check.result import DesignResult
from slewctl.check.words import GONE, sentence, title
from slewctl.errors import check_path
from slewctl.escape import Escaped, github_data, github_property

# GitHub shows ten errors of a step, so that the broken files come first.
_ORDER = {"broken": 0, "missing": 1, "failed": 1, "passed": 2, "unchanged": 2}


def to_annotations(results: Sequence[DesignResult], root: FilePath) -> list[str]:
    """Return one line for each failure and each design that could not be judged.

    Parameters
    ----------
    results : sequence of DesignResult
    root : str or PathLike
        Folder of the repository; files below it are named from there.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult, to_annotations
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> to_annotations([broken], Path())[0]
    '::error file=designs/arm.toml,line=1,title=slewctl%3A cannot be judged::no such basis'
    """
    root = check_path(root, "root")
    lines = []
    for result in sorted(results, key=lambda result: _ORDER[result.status]):
        file = _relative(result.file, root)
        if result.error:
            for text, line in result.faults or ((result.error, result.error_line),):
                lines.append(_command(file, line, "slewctl: cannot be judged", text))
        if result.missing:
            lines.append(_command(file, None, "slewctl: missing", f"{result.name}: {GONE}"))
        for found in result.failures:
            text = f"{result.name}: {sentence(found)}"
            lines.append(_command(file, found.line, f"slewctl: {title(found)}", text))
    return lines


def _relative(file: Path, root: Path) -> str:
    """Return the path as the repository knows it, where the file lies in it."""
    whole, folder = Path(os.path.abspath(file)), Path(os.path.abspath(root))
    if not whole.is_relative_to(folder):
        whole, folder = file.resolve(), root.resolve()
    return (whole.relative_to(folder) if whole.is_relative_to(folder) else file).as_posix()


def _command(file: str, line: int | None, title: str, message: str) -> str:
    place = f"file={github_property(file)},line={line or 1},title={github_property(title)}"
    return Escaped(f"::error {place}::{github_data(message)}")
