"""The figures of a study: maps of the loss over hub inertia and order, and who wins where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from slewctl._types import Array, BoolArray
from slewctl.compare import GOOD, Duel, StudySlice
from slewctl.report.drawing import ALARM, COLOURS, INK, figure, svg
from slewctl.report.page import tidy

# Upper ends of the classes of loss, light to dark; what is lost is at most ...
_CLASSES = (0.01, GOOD, 0.2, 1.0, np.inf)
_LABELS = ("≤ 1 %", f"≤ {100 * GOOD:g} %", "≤ 20 %", "≤ 100 %", "more")
_TONES = [colormaps["cividis_r"](t) for t in (0.0, 0.2, 0.42, 0.64, 0.86)]
_PANELS_A_ROW = 5  # as many as a page is wide
# Cells are a little smaller than their places: the ground between them is the grid.
_CELL = 0.46

# More letters along a panel's axis would run into each other.
_LETTERS = 24

AXIS_NAMES = {
    "hub_ratio": "hub inertia over the beam's",
    "payload_ratio": "payload over the beam's mass",
    "damping_ratio": "damping ratio",
    "bandwidth": "bandwidth over f₁",
    "sensors": "sensors",
    "method": "method",
    "n": "functions n",
    "variation": "change of the arm",
}


def map_figure(part: StudySlice, name: str) -> str:
    """Return a map of the loss for every basis: hub ratio across, order upwards."""
    lines = -(-len(part.bases) // _PANELS_A_ROW)
    columns = -(-len(part.bases) // lines)
    fig, axes = figure(lines, columns, (7.6, 0.75 + 1.95 * lines))
    for place, ax in enumerate(axes):
        if place >= len(part.bases):
            ax.set_axis_off()
            continue
        _map(ax, part, part.bases[place])
        if place % columns:
            ax.set_yticklabels([])
        else:
            ax.set_ylabel("functions n")
    _explain(fig, part)
    fig.supxlabel(AXIS_NAMES["hub_ratio"], fontsize=10, color=INK)
    return svg(fig, name, f"Loss of {part.title} over hub inertia and number of functions")


def _map(ax: Axes, part: StudySlice, basis: str) -> None:
    losses = part.losses(basis)
    low = -np.inf
    for high, tone in zip(_CLASSES, _TONES, strict=True):
        _tiles(ax, (losses > low) & (losses <= high) & np.isfinite(losses), tone)
        low = high
    for mask, mark, colour in ((np.isinf(losses), "x", ALARM), (np.isnan(losses), "_", INK)):
        rows, columns = np.nonzero(mask)
        ax.plot(columns, rows, mark, color=colour, markersize=6, markeredgewidth=1.6)
    ax.set_title(basis, fontsize=9)
    ax.grid(visible=False)
    ax.set_xlim(-0.6, len(part.hub_ratios) - 0.4)
    ax.set_ylim(-0.6, len(part.orders) - 0.4)
    ax.set_xticks(range(len(part.hub_ratios)), [f"{r:g}" for r in part.hub_ratios],
                  rotation=90, fontsize=8)  # fmt: skip
    ax.set_yticks(range(len(part.orders)), [str(n) for n in part.orders], fontsize=8)


def _tiles(ax: Axes, mask: BoolArray, tone: tuple[float, float, float, float]) -> None:
    """Draw a tile wherever the mask is true, all of them as one path."""
    if mask.any():
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * _CELL
        rows, columns = np.nonzero(mask)
        tiles: Array = np.concatenate([corners + at for at in zip(columns, rows, strict=True)])
        codes = [Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY] * len(rows)
        ax.add_patch(PathPatch(Path(tiles, codes), facecolor=tone, edgecolor="none"))


def _explain(fig: Figure, part: StudySlice) -> None:
    """Draw the legend of a map: the classes of loss, unstable, and no design."""
    handles: list[object] = [
        Patch(facecolor=tone, label=label) for tone, label in zip(_TONES, _LABELS, strict=True)
    ]
    losses = np.array([part.losses(basis) for basis in part.bases])
    (ax,) = fig.axes[:1]
    for mask, mark, colour, label in (
        (np.isinf(losses), "x", ALARM, "unstable"),
        (np.isnan(losses), "_", INK, "no design"),
    ):
        if mask.any():
            handles += ax.plot([], [], mark, color=colour, markeredgewidth=1.6, label=label)
    fig.legend(
        handles=handles, loc="outside upper center", ncols=len(handles), fontsize=8,
        frameon=False, labelcolor=INK, handlelength=1.0, columnspacing=1.2,
    )  # fmt: skip


def duel_figure(hubs: Sequence[Duel], elsewhere: Sequence[Duel], name: str) -> str:
    """Return who wins of two bases, as shares of the pairs at each value of each axis."""
    axes_of: dict[str, list[Duel]] = {}
    for duel in (*hubs, *elsewhere):
        axes_of.setdefault(str(duel.axis), []).append(duel)
    columns = min(len(axes_of), 3)
    lines = -(-len(axes_of) // columns)
    fig, panels = figure(lines, columns, (7.6, 0.4 + 2.1 * lines))
    for place, ax in enumerate(panels):
        if place < len(axes_of):
            axis, duels = list(axes_of.items())[place]
            _stack(ax, axis, duels)
            ax.set_yticklabels([] if place % columns else ["0", "50 %", "100 %"])
        else:
            ax.set_axis_off()
    panels[0].set_ylabel("pairs won")
    fig.legend(
        *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8,
        frameon=False, labelcolor=INK,
    )  # fmt: skip
    return svg(fig, name, f"Pairs won by {hubs[0].first} and {hubs[0].second} along every axis")


def _stack(ax: Axes, axis: str, duels: Sequence[Duel]) -> None:
    first, second = duels[0].first, duels[0].second
    shares: Mapping[str, list[float]] = {
        first: [d.first_wins / d.pairs for d in duels],
        "draw": [d.draws / d.pairs for d in duels],
        second: [d.second_wins / d.pairs for d in duels],
    }
    left = np.zeros(len(duels))
    ax.grid(visible=False)
    for label, share in shares.items():
        colour = COLOURS.get(label, "#bbbbbb")
        ax.bar(range(len(duels)), share, bottom=left, color=colour, label=label, width=0.8)
        left += share
    labels = [tidy(d.value) for d in duels]
    crowded = max(map(len, labels)) * len(labels) > _LETTERS
    ax.set_xticks(range(len(duels)), labels, fontsize=8, rotation=25 if crowded else 0,
                  ha="right" if crowded else "center", rotation_mode="anchor")  # fmt: skip
    ax.set_ylim(0, 1)
    ax.set_yticks([0, 0.5, 1])
    ax.set_xlabel(AXIS_NAMES[axis], fontsize=9)
