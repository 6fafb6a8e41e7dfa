"""The figures of a study: maps of the loss over hub inertia and order, and who wins where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from slewctl.compare import Duel, StudySlice
from slewctl.report.drawing import ALARM, COLOURS, INK, figure, legend, svg

# From a tenth of a percent lost, which nobody notices, to all of the optimal cost again.
_LEAST, _MOST = 1e-3, 1.0
_MAP_COLOURS = "cividis_r"


def map_figure(part: StudySlice, name: str) -> str:
    """Return a map of the loss for every basis: hub ratio across, order upwards."""
    fig, axes = figure(1, len(part.bases), (7.6, 2.9))
    meshes = [_map(ax, part, basis) for ax, basis in zip(axes, part.bases, strict=True)]
    axes[0].set_ylabel("functions n")
    for ax in axes[1:]:
        ax.set_yticklabels([])
    bar = fig.colorbar(meshes[0], ax=axes, shrink=0.9, ticks=[1e-3, 1e-2, 1e-1, 1])
    bar.ax.set_yticklabels(["≤ 0.1 %", "1 %", "10 %", "≥ 100 %"])
    bar.ax.tick_params(labelsize=8)
    bar.set_label("lost of the optimal cost")
    fig.supxlabel("hub inertia over the beam's", fontsize=10, color=INK)
    return svg(fig, name, f"Loss of {part.title} over hub inertia and number of functions")


def _map(ax: Axes, part: StudySlice, basis: str) -> Any:
    losses = part.losses(basis)
    mesh = ax.pcolormesh(
        np.arange(len(part.hub_ratios) + 1) - 0.5,
        np.arange(len(part.orders) + 1) - 0.5,
        np.clip(losses, _LEAST, _MOST),
        norm=LogNorm(_LEAST, _MOST),
        cmap=_MAP_COLOURS,
        edgecolors="none",
        antialiased=False,  # no seams between cells
    )
    rows, columns = np.nonzero(np.isinf(losses))
    ax.plot(columns, rows, "x", color=ALARM, markersize=7, markeredgewidth=1.8)
    ax.set_title(basis)
    ax.grid(visible=False)
    ax.set_xticks(range(len(part.hub_ratios)), [f"{r:g}" for r in part.hub_ratios],
                  rotation=90, fontsize=8)  # fmt: skip
    ax.set_yticks(range(len(part.orders)), [str(n) for n in part.orders], fontsize=8)
    return mesh


def duel_figure(duels: Sequence[Duel], name: str) -> str:
    """Return who wins of two bases, as shares of all pairs at each hub ratio."""
    fig, axes = figure(size=(7.2, 2.6))
    ax = axes[0]
    first, second = duels[0].first, duels[0].second
    shares: Mapping[str, list[float]] = {
        first: [d.first_wins / d.pairs for d in duels],
        "draw": [d.draws / d.pairs for d in duels],
        second: [d.second_wins / d.pairs for d in duels],
    }
    left = np.zeros(len(duels))
    for label, share in shares.items():
        colour = COLOURS.get(label, "#bbbbbb")
        ax.bar(range(len(duels)), share, bottom=left, color=colour, label=label, width=0.8)
        left += share
    ax.set_xticks(range(len(duels)), [f"{d.hub_ratio:g}" for d in duels])
    ax.set_ylim(0, 1)
    ax.set_yticks([0, 0.5, 1], ["0", "50 %", "100 %"])
    ax.set_xlabel("hub inertia over the beam's")
    ax.set_ylabel("pairs won")
    legend(ax, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return svg(fig, name, f"Pairs won by {first} and {second} at each hub inertia")
