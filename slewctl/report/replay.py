"""The report of a logged slew beside its prediction."""

from __future__ import annotations

from pathlib import Path

from slewctl._show import rows_of
from slewctl._types import FilePath
from slewctl.errors import check_path
from slewctl.loop import MarginUse, Replay
from slewctl.report.drawing import figure, legend, style, svg
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.page import render, versions
from slewctl.report.palette import ALARM


def write_replay(found: Replay, use: MarginUse | str, folder: FilePath, title: str) -> Path:
    """Write the report of a logged slew and return the path of its page.

    Parameters
    ----------
    found : Replay
    use : MarginUse or str
        Or why the log does not tell of the margins.
    folder : str or PathLike
        Gets ``index.html``, ``signals.csv`` and ``results.json``.
    title : str

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
    >>> from slewctl.report import write_replay
    >>> write_replay(found, use, Path("report"), "arm")  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    page = render("replay.html", title=title, found=found, use=use, picture=_picture(found))
    results = {
        "versions": versions(),
        "start_s": found.start_s,
        "start_from": found.start_from,
        "signals": found.rows(),
        "margins": use,
    }
    write_files(
        folder,
        {
            "index.html": page,
            "signals.csv": csv_text(_samples(found)),
            "results.json": json_text(results),
        },
    )
    return folder / "index.html"


def _samples(found: Replay) -> list[dict[str, object]]:
    signals = (found.output, found.command)
    columns = {"t": found.t}
    for one in signals:
        columns |= {one.name: one.measured, f"{one.name}_predicted": one.predicted}
    return rows_of(columns)


def _picture(found: Replay) -> str:
    drawn, axes = figure(3, 1, (7.2, 6.4), sharex=True)
    looks = style("slewing")
    for ax, one in ((axes[0], found.output), (axes[2], found.command)):
        ax.plot(found.t, one.predicted, lw=4, alpha=0.4, color=looks["color"], label="predicted")
        ax.plot(found.t, one.measured, lw=1, color=looks["color"], label="measured")
        ax.set_ylabel(f"{one.name} ({one.unit})")
        legend(ax)
    output = found.output
    axes[1].plot(found.t, output.measured - output.predicted, lw=1, color=ALARM)
    axes[1].set_ylabel(f"difference ({output.unit})")
    axes[2].set_xlabel("time from the start of the slew (s)")
    return svg(drawn, "replay", "Output, difference and command, measured over predicted")
