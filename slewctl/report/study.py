"""The report of a study: a page, the same as Markdown, and its rows for other tools."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from slewctl._types import FilePath
from slewctl.compare import MEDIANS, PAPERS, Duel, StudyResult
from slewctl.errors import check_path
from slewctl.report.export import json_text, packed_csv, parquet, write_files
from slewctl.report.page import render, versions
from slewctl.report.study_figures import AXIS_NAMES, duel_figure
from slewctl.report.study_map import map_data, map_figure

# A page holds no more: as many are read, and the rest are drawn when they are asked for.
MOST_MAPS = 24


def write_study(
    result: StudyResult,
    folder: FilePath,
    *,
    as_parquet: bool = False,
    wanted: Mapping[str, str] | None = None,
) -> Path:
    """Write the report of a study and return the path of its page.

    Parameters
    ----------
    result : StudyResult
    folder : str or PathLike
        Gets ``index.html``, ``index.md``, ``results.json`` (the answer and what it was
        counted from) and ``rows.csv.gz`` (every design).
    as_parquet : bool
        Whether to write ``rows.parquet`` too, which needs pyarrow.
    wanted : mapping of str to str, optional
        At which values of the axes the maps are, such as ``{"bandwidth": "0.1"}``; by default
        the widest, as many as a page holds.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written, or pyarrow is missing; nothing is left half-written.
        For what is no axis of a map, or a value at which there is none.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.report import write_study
    >>> write_study(result, Path("report"))  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    slices = result.sliced(wanted or {})
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
        "left_out": _left_out(len(slices) - MOST_MAPS, folder),
    }
    papers = [d for d in answer.duels if (d.first, d.second) == PAPERS]
    figures = {
        "maps": [(part, map_figure(part), map_data(part)) for part in slices[:MOST_MAPS]],
        "widest": max((len(part.hub_ratios) for part in slices[:MOST_MAPS]), default=0),
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


def _left_out(count: int, folder: Path) -> tuple[str, str]:
    """Return how many maps a page does not hold, and the command that draws them."""
    maps = "1 more map is" if count == 1 else f"{count} more maps are"
    command = f"slewctl study FILE --out {shlex.quote(str(folder))} --resume --slice bandwidth=0.1"
    return (f"{maps} not drawn here", command) if count > 0 else ("", "")


def _by_pair(duels: Iterable[Duel]) -> list[tuple[str, str, list[Duel]]]:
    """Return the duels of each two bases together."""
    pairs: dict[tuple[str, str], list[Duel]] = {}
    for duel in duels:
        pairs.setdefault((duel.first, duel.second), []).append(duel)
    return [(first, second, found) for (first, second), found in pairs.items()]
