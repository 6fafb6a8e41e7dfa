"""The figure of a study that says who wins where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from slewctl.compare import Duel
from slewctl.report.drawing import INK, figure, svg
from slewctl.report.page import tidy
from slewctl.report.palette import COLOURS

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
