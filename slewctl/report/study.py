"""The report of a study: a page, the same as Markdown, and its rows for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slewctl.compare import StudyResult
from slewctl.report.export import json_text, packed_csv, write_files
from slewctl.report.page import render, versions
from slewctl.report.study_figures import duel_figure, map_figure


def write_study(result: StudyResult, folder: Path) -> Path:
    """Write the report of a study and return the path of its page.

    Parameters
    ----------
    result : StudyResult
    folder : Path
        Gets ``index.html``, ``index.md``, ``results.json`` (the answer and what it was
        counted from) and ``rows.csv.gz`` (every design).

    Raises
    ------
    InputError
        If the folder cannot be written; nothing is left half-written.
    """
    duels = [d for d in result.answer.duels if d.hub_ratio is not None]
    pairs = list(dict.fromkeys((d.first, d.second) for d in duels))
    shown: dict[str, Any] = {
        "result": result,
        "study": result.study,
        "answer": result.answer,
        "pairs": [(a, b, [d for d in duels if (d.first, d.second) == (a, b)]) for a, b in pairs],
        "inputs": json_text(result.study),
    }
    figures = {
        "maps": [(part, map_figure(part, f"map-{k}")) for k, part in enumerate(result.slices)],
        "duel": duel_figure(shown["pairs"][0][2], "duel") if pairs else "",
    }
    results = {"versions": versions(), "study": result.study, "answer": result.answer}
    write_files(
        folder,
        {
            "index.html": render("study.html", **shown, **figures),
            "index.md": render("study.md", **shown),
            "results.json": json_text(results),
            "rows.csv.gz": packed_csv(result.rows),
        },
    )
    return folder / "index.html"
