"""The report of shapers and profiles side by side."""

from __future__ import annotations

from pathlib import Path

from slewctl._types import FilePath
from slewctl.errors import check_path
from slewctl.loop import Shaping
from slewctl.report.drawing import figure, legend, style, svg
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.page import render, versions
from slewctl.report.palette import SPARE_COLOURS


def write_shaping(found: Shaping, folder: FilePath, title: str) -> Path:
    """Write the report of a comparison of commands and return the path of its page.

    Parameters
    ----------
    found : Shaping
    folder : str or PathLike
        Gets ``index.html``, ``shapers.csv``, ``sensitivity.csv`` and ``results.json``.
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
    >>> from slewctl.report import write_shaping
    >>> write_shaping(found, Path("report"), "arm")  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    names = [command.name for command in found.commands if command.shaper]
    curves = {name: found.sensitivity(name) for name in names}
    off = curves[names[0]][0]
    rows = [
        {"error": error, **{name: curves[name][1][k] for name in names}}
        for k, error in enumerate(off.tolist())
    ]
    page = render("shaping.html", title=title, found=found, picture=_picture(found, names))
    results = {
        "versions": versions(),
        "modes": found.modes,
        "error": found.error,
        "commands": found.commands,
        "profiles": found.profiles,
    }
    write_files(
        folder,
        {
            "index.html": page,
            "shapers.csv": csv_text(found.rows()),
            "sensitivity.csv": csv_text(rows),
            "results.json": json_text(results),
        },
    )
    return folder / "index.html"


def _picture(found: Shaping, names: list[str]) -> str:
    fig, axes = figure(1, 2, (7.2, 3.4))
    colours = [style("clamped-free")["color"], style("slewing")["color"], *SPARE_COLOURS]
    for place, name in enumerate(names):
        off, left = found.sensitivity(name)
        colour = colours[place % len(colours)]
        dashes = "--" if place >= len(colours) else "-"
        axes[0].plot(100 * off, 100 * left, dashes, lw=1.1, color=colour, label=name)
        (command,) = (c for c in found.commands if c.name == name)
        axes[1].plot(command.duration, 100 * command.residual_off, "o", ms=5, color=colour)
        axes[1].annotate(f" {name}", (command.duration, 100 * command.residual_off), fontsize=8)
    axes[0].set_xlabel("error of all frequencies (%)")
    axes[0].set_ylabel("residual (%)")
    axes[0].set_ylim(bottom=0)
    legend(axes[0], ncols=2)
    axes[1].set_xlabel("duration (s)")
    axes[1].set_ylabel(f"residual at ±{100 * found.error:g} % (%)")
    axes[1].set_ylim(bottom=0)
    axes[1].margins(x=0.2)
    words = "Residual of each shaper against the error of the frequencies, and against its duration"
    return svg(fig, "shapers", words)
