"""Figures and tables for a paper: PDF and PNG, the data behind them, and LaTeX."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from slewctl._types import FilePath
from slewctl.compare import CaseResult, Comparison, Evaluation
from slewctl.errors import check_choice, check_path
from slewctl.report.comparison_figures import figures, looks
from slewctl.report.comparison_tables import file_name, known, readings
from slewctl.report.export import csv_text, write_files
from slewctl.report.page import number
from slewctl.report.palette import ALARM
from slewctl.report.plot import Item, Panel, Plot
from slewctl.report.scale import Axis

# Of the PNG: what printers ask for.
_DPI = 300


@dataclass(frozen=True)
class Style:
    """How figures are set.

    Attributes
    ----------
    width : float
        In inches.
    family : str
        Of fonts.
    size : float
        Of words, in points.
    """

    width: float
    family: str
    size: float


STYLES: Mapping[str, Style] = {
    "paper": Style(3.5, "serif", 8.0),  # a column of two
    "wide": Style(7.2, "serif", 9.0),  # both columns
    "slides": Style(6.0, "sans-serif", 12.0),
}


def write_figures(
    comparison: Comparison,
    folder: FilePath,
    style: str = "paper",
    *,
    drawn: Iterable[Mapping[str, str | bytes]] | None = None,
) -> Path:
    """Write the figures of a comparison for a paper, with tables in LaTeX and the data.

    Parameters
    ----------
    comparison : Comparison
    folder : str or PathLike
        Gets, of every design, each figure as PDF, PNG and CSV and a table of all that was tried
        as ``.tex`` and CSV; and ``all-designs.tex`` and ``.csv`` of the designs themselves.
        The tables are tabulars that need LaTeX's booktabs.
    style : {"paper", "wide", "slides"}
        One column of a paper (3.5 inches), two (7.2 inches), or slides.
    drawn : iterable of mapping, optional
        What `design_files` returned of each case, where it was drawn in another process.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For another style, or if the folder cannot be written.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, compare
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> from pathlib import Path
    >>> from slewctl.report import write_figures
    >>> write_figures(compare([case]), Path("figures"))  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    if drawn is None:
        drawn = (design_files(k, case, style) for k, case in enumerate(comparison.cases))
    own = [{"design": r.case.name, **_row(r.chosen)} for r in comparison.cases]
    files = _table("all-designs", own)
    for of_design in drawn:
        files |= of_design
    write_files(folder, files)
    return folder


def design_files(place: int, result: CaseResult, style: str) -> dict[str, str | bytes]:
    """Return the files of one design: its figures, their data and its table.

    Raises
    ------
    InputError
        For an unknown style.
    """
    chosen = STYLES[check_choice(style, STYLES, "style")]
    name = file_name(result.case.name, place)
    files = _table(f"{name}-table", [_row(e) for e in result.evaluations])
    for kind, plot, _ in figures(result):
        files |= {f"{name}-{kind}.{end}": data for end, data in _set(plot, result, chosen)}
    return files


def _set(plot: Plot, result: CaseResult, style: Style) -> Iterator[tuple[str, str | bytes]]:
    """Yield a figure as each kind of file."""
    designs = looks(result)
    settings: Any = {
        "font.family": style.family, "font.size": style.size, "mathtext.fontset": "dejavuserif",
        "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6,
        "pdf.fonttype": 42,
    }  # fmt: skip
    with mpl.rc_context(settings):
        fig = _figure(plot.panels, designs, style)
        fig.draw_without_rendering()
        fig.set_layout_engine("none")  # it is laid out now, and need not be again
        for end, more in (
            ("pdf", {"metadata": {"CreationDate": None}}),
            ("png", {"dpi": _DPI, "metadata": {"Software": None}}),
        ):
            out = io.BytesIO()
            fig.savefig(out, format=end, **more)
            yield end, out.getvalue()
    yield "csv", csv_text(_data(plot.panels, designs))


def _figure(panels: Sequence[Panel], designs: Sequence[Mapping[str, Any]], style: Style) -> Figure:
    lefts = sorted({panel.left for panel in panels})
    tops = sorted({panel.top for panel in panels})
    high = sum(next(p.height for p in panels if p.top == top) + 14 for top in tops)
    fig = Figure(figsize=(style.width, style.width * (high + 62) / 480), layout="constrained")
    FigureCanvasAgg(fig)
    ratios = [next(p.height for p in panels if p.top == top) for top in tops]
    grid = fig.add_gridspec(len(tops), len(lefts), height_ratios=ratios)
    for panel in panels:
        ax = fig.add_subplot(grid[tops.index(panel.top), lefts.index(panel.left)])
        _draw(ax, panel, designs)
        # A low panel is no place for a long word on its side.
        low = panel.height * style.width / 480 * 72 < 0.62 * style.size * len(panel.y.label)
        ax.set_ylabel(panel.y.label.replace(" (", "\n(") if low else panel.y.label)
        if panel.x_marked:
            ax.set_xlabel(panel.x.label)
        else:
            ax.tick_params(labelbottom=False)
    fig.align_ylabels()
    if len(designs) > 1:
        lines = [_line(look) for look in designs]
        handles = [mpl.lines.Line2D([], [], label=d["label"], **line)
                   for d, line in zip(designs, lines, strict=True)]  # fmt: skip
        fig.legend(handles=handles, loc="outside upper center", frameon=False,
                   ncols=min(len(handles), 1 + int(style.width / style.size * 4)),
                   fontsize=0.9 * style.size)  # fmt: skip
    return fig


def _draw(ax: Axes, panel: Panel, designs: Sequence[Mapping[str, Any]]) -> None:
    for axis, way in ((panel.x, "x"), (panel.y, "y")):
        if axis.kind == "symlog":
            getattr(ax, f"set_{way}scale")("symlog", linthresh=axis.bend)
        elif axis.kind == "log":
            getattr(ax, f"set_{way}scale")("log")
        getattr(ax, f"set_{way}lim")(axis.low, axis.high)
        _mark(ax, axis, way)
    ax.grid(visible=True, linewidth=0.4, alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    for item in panel.items:
        _item(ax, item, designs)


def _mark(ax: Axes, axis: Axis, way: str) -> None:
    """Mark an axis where the page does: of two marks that would touch one is left out."""
    marks = axis.marks()
    along = getattr(ax, f"{way}axis")
    along.set_major_locator(FixedLocator([value for value, _ in marks]))
    along.set_major_formatter(mpl.ticker.FixedFormatter([text for _, text in marks]))
    along.set_minor_locator(NullLocator())


# What names of looks mean in print; see the style sheet of the pages.
_LOOKS: Mapping[str, dict[str, Any]] = {
    "k": {"color": "black", "linewidth": 0.6},
    "wanted": {"color": "0.5", "alpha": 0.45, "linewidth": 3},
    "limit": {"color": ALARM, "linewidth": 0.8, "linestyle": ":"},
    "a": {"color": ALARM, "linewidth": 1.2},
    "critical": {"color": ALARM},
    "peak": {"color": ALARM, "markersize": 4},
}


def _item(ax: Axes, item: Item, designs: Sequence[Mapping[str, Any]]) -> None:
    own = item.look.split()[0].removeprefix("o")
    look = _line(designs[int(own)]) if own.isdecimal() else _LOOKS.get(item.look, {})
    if item.look in ("disk", "unstable"):
        ax.fill(item.x, item.y, facecolor=ALARM, alpha=0.14, edgecolor="none")
    elif item.kind == "curve":
        ax.plot(item.x, item.y, **look)
    elif item.kind == "word":
        colour = ALARM if item.look == "a" else "black"
        ax.annotate(item.text, (item.x[0], item.y[0]), xytext=(0, -0.7 * item.dy), ha="center",
                    textcoords="offset points", color=colour, fontsize="small",
                    annotation_clip=True)  # fmt: skip
    else:
        size = {"markersize": 8 - 2 * (int(own) % 4) if own.isdecimal() else 5} | look
        marks = {key: value for key, value in size.items() if key not in ("linestyle", "linewidth")}
        shape = {"dots": "o", "crosses": "x"}[item.kind]
        face: dict[str, Any] = {} if item.look == "peak" else {"markerfacecolor": "none"}
        ax.plot(item.x, item.y, shape, **face, **marks)


def _line(look: Mapping[str, Any]) -> dict[str, Any]:
    """Return colour and dashes of a design's line."""
    dashes = [float(part) for part in look["dashes"].split()]
    style: Any = (0, tuple(0.7 * d for d in dashes)) if dashes else "-"
    return {"color": look["colour"], "linestyle": style, "linewidth": 1.0}


def _data(
    panels: Sequence[Panel], designs: Sequence[Mapping[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Yield a row for every point of every design's curves, once."""
    told: set[tuple[str, str, float, float]] = set()
    for panel in panels:
        for item in panel.items:
            own = item.look.split()[0].removeprefix("o")
            if item.kind == "word" or not own.isdecimal():
                continue
            design, quantity = designs[int(own)]["label"], panel.y.label
            values = item.y if item.data is None else item.data
            for x, y in zip(item.x.tolist(), values.tolist(), strict=True):
                row = design, quantity, x, y
                if np.isfinite([x, y]).all() and row not in told:
                    told.add(row)
                    yield {"design": design, "quantity": quantity, panel.x.label: x, "value": y}


# The columns of a table: a quantity, its heading, and what it is multiplied by.
_COLUMNS = (
    ("gain_margin_db", "gain margin (dB)", 1),
    ("phase_margin_deg", "phase margin (deg)", 1),
    ("delay_margin_s", "delay margin (ms)", 1000),
    ("disk_margin", "disk margin", 1),
    ("h2_loss", "lost (%)", 100),
)


def _row(e: Evaluation) -> dict[str, Any]:
    """Return a row of a table: what a controller was made on, and its margins."""
    found = readings(e, slewed=False)
    values = {name: known(found[name]) for name, _, _ in _COLUMNS}
    return {
        **e.origin.cells,
        **{
            heading: None if values[name] is None else scale * values[name]  # type: ignore[operator]
            for name, heading, scale in _COLUMNS
        },
        "unstable at (Hz)": None if e.stable else e.judgement.unstable_hz[0],
    }


def _table(name: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, str | bytes]:
    """Return rows as CSV and as a tabular of LaTeX's booktabs; a column of nothing is left out."""
    used = [key for key in rows[0] if any(row[key] not in (None, "") for row in rows)]
    columns = "".join("l" if isinstance(rows[0][key], str) else "r" for key in used)
    lines = [
        "% \\usepackage{booktabs}",
        f"\\begin{{tabular}}{{{columns}}}",
        "\\toprule",
        " & ".join(_tex(key) for key in used) + " \\\\",
        "\\midrule",
        *(" & ".join(_cell(row[key]) for key in used) + " \\\\" for row in rows),
        "\\bottomrule",
        "\\end{tabular}",
    ]
    return {f"{name}.tex": "\n".join(lines) + "\n", f"{name}.csv": csv_text(rows)}


def _cell(value: Any) -> str:
    """Return a cell in LaTeX: numbers in mathematics, a dash for none."""
    if value is None:
        return "--"
    if isinstance(value, str):
        return _tex(value)
    text = number(value, 3).replace("−", "-").replace("∞", "\\infty")
    mantissa, _, power = text.partition("e")
    return f"${mantissa} \\times 10^{{{int(power)}}}$" if power else f"${text}$"


_SPECIAL = {
    "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}",
    "<": "\\textless{}", ">": "\\textgreater{}",
} | {sign: f"\\{sign}" for sign in "&%$#_{}"}  # fmt: skip


def _tex(text: str) -> str:
    """Return text with what LaTeX would take for a command made plain."""
    return "".join(_SPECIAL.get(sign, sign) for sign in text)
