"""The report on the paper: its numbers beside computed ones, and what must be corrected."""

from __future__ import annotations

from pathlib import Path

from slewctl._types import FilePath
from slewctl.errors import check_path
from slewctl.paper import PaperReproduction, conditioning_words
from slewctl.paper.published import CITATION, TITLE
from slewctl.report.export import json_text, write_files
from slewctl.report.page import render, versions
from slewctl.report.paper_figures import (
    conditioning_figure,
    functions_figure,
    hub_figure,
    integrator_figure,
    modes_figure,
    tip_figure,
)


def write_paper(reproduction: PaperReproduction, folder: FilePath) -> Path:
    """Write the report of a reproduction and return the path of its page.

    Parameters
    ----------
    reproduction : PaperReproduction
    folder : str or PathLike
        Gets ``index.html`` and ``results.json``, which holds the numbers.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written; nothing is left half-written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.paper import reproduce
    >>> from slewctl.report import write_paper
    >>> write_paper(reproduce(), Path("report"))  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    findings = reproduction.findings
    page = render(
        "paper.html",
        p=reproduction,
        title=TITLE,
        citation=CITATION,
        functions=[functions_figure(f) for f in reproduction.figures.functions],
        modes=modes_figure(reproduction.figures),
        tip=tip_figure(reproduction.figures),
        integrators=integrator_figure(findings.integrators),
        hub=hub_figure(findings.hub),
        conditioning=conditioning_figure(reproduction.conditioning),
        conditioning_words=conditioning_words(reproduction.conditioning),
    )
    results = {"versions": versions(), "reproduction": reproduction}
    write_files(folder, {"index.html": page, "results.json": json_text(results)})
    return folder / "index.html"
