"""The report of a study: a page, the same as Markdown, and its rows for other tools."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from slewctl.compare import MEDIANS, PAPERS, Duel, StudyResult
from slewctl.report.export import json_text, packed_csv, parquet, write_files
from slewctl.report.page import render, versions
from slewctl.report.study_figures import AXIS_NAMES, duel_figure
from slewctl.report.study_map import map_data, map_figure


def write_study(result: StudyResult, folder: Path, *, as_parquet: bool = False) -> Path:
    """Write the report of a study and return the path of its page.

    Parameters
    ----------
    result : StudyResult
    folder : Path
        Gets ``index.html``, ``index.md``, ``results.json`` (the answer and what it was
        counted from) and ``rows.csv.gz`` (every design).
    as_parquet : bool
        Whether to write ``rows.parquet`` too, which needs pyarrow.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written, or pyarrow is missing; nothing is left half-written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.report import write_study
    >>> write_study(result, Path("report"))  # doctest: +SKIP
    """
    answer = result.answer
    shown: dict[str, Any] = {
        "result": result,
        "study": result.study,
        "answer": answer,
        "pairs": _by_pair(answer.duels),
        "reductions": _by_pair(answer.reductions),
        "axis_names": AXIS_NAMES,
        "medians": MEDIANS,
        "inputs": json_text(result.study),
    }
    papers = [d for d in answer.duels if (d.first, d.second) == PAPERS]
    figures = {
        "maps": [(part, map_figure(part), map_data(part)) for part in result.slices],
        "widest": max((len(part.hub_ratios) for part in result.slices), default=0),
        "duel": duel_figure(papers, answer.elsewhere, "duel") if papers else "",
    }
    results = {"versions": versions(), "study": result.study, "answer": answer}
    files: dict[str, str | bytes] = {
        "index.html": render("study.html", **shown, **figures),
        "index.md": render("study.md", **shown, maps=figures["maps"]),
        "results.json": json_text(results),
        "rows.csv.gz": packed_csv(result.rows),
    }
    if as_parquet:
        files["rows.parquet"] = parquet(result.rows)
    write_files(folder, files)
    return folder / "index.html"


def _by_pair(duels: Iterable[Duel]) -> list[tuple[str, str, list[Duel]]]:
    """Return the duels of each two bases together."""
    pairs: dict[tuple[str, str], list[Duel]] = {}
    for duel in duels:
        pairs.setdefault((duel.first, duel.second), []).append(duel)
    return [(first, second, found) for (first, second), found in pairs.items()]
