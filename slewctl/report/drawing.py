"""Vector figures for a page: deterministic SVG that follows the page's colours."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from slewctl.escape import quoted
from slewctl.report.compact import compact
from slewctl.report.palette import colour

STYLES = {
    "clamped-free": "--",
    "slewing": "-",
    "hub-matched": (0, (5, 1, 1, 1)),
    "arm-matched": (0, (2, 1)),
    "polynomial": "-.",
    "truth": "-",
    "": "-",
}

# Drawn in these, then replaced by the page's own text colour, so that a figure is
# readable on light and dark ground.
_INK = "#010203"
_FAINT = "#010204"

_SETTINGS: Any = {
    "svg.hashsalt": "slewctl",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 10.0,
    "text.color": _INK,
    "axes.edgecolor": _INK,
    "axes.labelcolor": _INK,
    "axes.titlecolor": _INK,
    "axes.titlesize": 10.0,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.grid": True,
    "grid.color": _FAINT,
    "grid.alpha": 0.18,
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.unicode_minus": True,
    "path.simplify_threshold": 0.3,  # in points: lines that differ by less look the same
}
INK = _INK


def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (7.2, 3.2), sharex: bool = False
) -> tuple[Figure, Sequence[Axes]]:
    """Return an empty figure and its axes, row by row."""
    with mpl.rc_context(_SETTINGS):
        fig = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(fig)
        grid = fig.subplots(rows, columns, squeeze=False, sharex=sharex)
    return fig, list(grid.ravel())


def svg(fig: Figure, name: str, description: str) -> str:
    """Return the figure as an ``<svg>`` element.

    Parameters
    ----------
    fig : Figure
    name : str
        Unique on the page; it prefixes the identifiers inside.
    description : str
        For readers who don't see the picture.
    """
    out = io.StringIO()
    with mpl.rc_context(_SETTINGS):
        # `Figure.savefig` draws twice, once to lay it out, which drawing does itself.
        FigureCanvasSVG(fig).print_svg(out, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = compact(text, name).replace(_INK, "currentColor").replace(_FAINT, "currentColor")
    return text.replace("<svg ", f'<svg role="img" aria-label="{quoted(description)}" ', 1).strip()


def legend(ax: Axes, **placing: Any) -> None:
    """Draw a small legend without a box, which would hide the page's ground."""
    ax.legend(fontsize=8, frameon=False, labelcolor=_INK, **placing)


def plain_labels(*axes: Axis) -> None:
    """Label the decades of logarithmic axes as 0.01, 1, 100 ...: powers take long to set."""
    for axis in axes:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))
        axis.set_minor_formatter(NullFormatter())


def style(source: str, position: int = 0) -> dict[str, Any]:
    """Return colour and line style of a basis or the truth."""
    return {"color": colour(source, position), "linestyle": STYLES.get(source, ":")}
