"""Maps of a study: the loss over hub inertia and order, and the case behind every cell."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from slewctl._types import BoolArray
from slewctl.compare import GOOD, StudySlice
from slewctl.escape import quoted

# Upper ends of the classes of loss, light to dark; what is lost is at most ...
_CLASSES = (0.01, GOOD, 0.2, 1.0, np.inf)
_LABELS = ("≤ 1 %", f"≤ {100 * GOOD:g} %", "≤ 20 %", "≤ 100 %", "more")
_PANELS_A_ROW = 5  # as many as a page is wide
_WIDTH = 760.0
_LEFT, _TOP, _BELOW = 34.0, 46.0, 46.0
# No cell is larger, and a cell is so much smaller than its place: the ground is the grid.
_LARGEST, _GAP = 19.0, 1.5

# What is told of the case in a cell, by its column among the rows: words and unit.
_TOLD = {
    "gain_margin_db": ("gain margin", "dB"),
    "phase_margin_deg": ("phase margin", "deg"),
    "disk_margin": ("disk margin", ""),
    "settling_time": ("settling, in periods of the first mode", ""),
    "residual_vibration": ("residual vibration over the tip's travel", ""),
    "worst_frequency_error": ("worst frequency error of the design model", ""),
    "unstable_mode": ("mode that grows", ""),
    "unstable_ratio": ("its frequency over the first mode's", ""),
}


def map_figure(part: StudySlice) -> str:
    """Return a map of the loss for every basis: hub ratio across, order upwards."""
    columns, rows = len(part.hub_ratios), len(part.orders)
    lines = -(-len(part.bases) // _PANELS_A_ROW)
    beside = -(-len(part.bases) // lines)
    room = (_WIDTH - _LEFT) / beside
    size = min((room - 14) / columns, _LARGEST)
    height = _TOP + rows * size + _BELOW
    drawn, places = "", []
    for place, basis in enumerate(part.bases):
        left = _LEFT + place % beside * room
        top = _TOP + place // beside * (rows * size + _BELOW + 14)
        height = top + rows * size + _BELOW
        places.append([round(left, 1), round(top, 1), round(size, 2)])
        drawn += _panel(part, basis, left, top, size, first=place % beside == 0)
    label = quoted(f"Loss of {part.title} over hub inertia and number of functions")
    return (
        f'<svg class="plot map" role="img" aria-label="{label}" viewBox="0 0 {_WIDTH:g} {height:g}"'
        f" data-places='{json.dumps(places)}'>{_legend(part)}{drawn}"
        f'<text class="m" x="{_WIDTH / 2:g}" y="{height - 4:g}">hub inertia over the beam\'s</text>'
        "</svg>"
    )


def map_data(part: StudySlice) -> str:
    """Return, as JSON for the page's script, what the cells of a map are and what is told."""
    rows = {(r["basis"], r["n"], r["hub_ratio"]): r for r in part.rows}
    cells = [
        [
            [
                _case(rows.get((basis, n, ratio)), float(loss))
                for ratio, loss in zip(part.hub_ratios, line, strict=True)
            ]
            for n, line in zip(part.orders, part.losses(basis), strict=True)
        ]
        for basis in part.bases
    ]
    told = {
        "title": part.title,
        "yardstick": part.yardstick,
        "bases": part.bases,
        "orders": part.orders,
        "hubs": part.hub_ratios,
        "told": list(_TOLD.values()),
        "cells": cells,
    }
    text = json.dumps(told, ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")  # nothing in it ends the script


def _case(row: Mapping[str, Any] | None, loss: float) -> list[Any] | str | None:
    """Return what is told of one design: its loss and values, or why there is none."""
    if row is None:
        return None
    if row["outcome"] == "no design":
        return str(row["reason"] or "no design")
    shown = loss if math.isfinite(loss) else None
    return [_short(shown), *(_short(row.get(name)) for name in _TOLD)]


def _short(value: Any) -> Any:
    if value is None or isinstance(value, str) or math.isnan(value):
        return value if isinstance(value, str) else None
    return float(f"{value:.3g}") if math.isfinite(value) else str(float(value))


def _panel(
    part: StudySlice, basis: str, left: float, top: float, size: float, *, first: bool
) -> str:
    losses = part.losses(basis)
    rows, columns = losses.shape
    tiles, low = "", -np.inf
    for tone, high in enumerate(_CLASSES):
        inside = (losses > low) & (losses <= high) & np.isfinite(losses)
        square = f"h{size - _GAP:.1f}v{size - _GAP:.1f}h-{size - _GAP:.1f}z"
        tiles += _each(inside, f"t{tone}", square, left, top, size, 0)
        low = high
    half = size / 2
    for mask, look, mark in (
        (np.isinf(losses), "no", "m-4-4l8 8m0-8l-8 8"),
        (np.isnan(losses), "none", "m-4 0h8"),
    ):
        tiles += _each(mask, look, mark, left, top, size, half - _GAP / 2)
    middle = f'x="{left + columns * size / 2:.1f}" y="{top - 7:g}"'
    words = f'<text class="m" {middle}>{quoted(basis)}</text>'
    bottom = top + rows * size
    for k, ratio in enumerate(part.hub_ratios):
        at = f"translate({left + (k + 0.5) * size + 3.5:.1f} {bottom + 4:.1f})rotate(-90)"
        words += f'<text class="e" transform="{at}">{ratio:g}</text>'
    if first:
        for k, n in enumerate(part.orders):
            at = f'x="{left - 5:g}" y="{bottom - (k + 0.5) * size + 4:.1f}"'
            words += f'<text class="e" {at}>{n}</text>'
        middle = f"translate(11 {top + rows * size / 2:.1f})rotate(-90)"
        words += f'<text class="m" transform="{middle}">functions n</text>'
    return tiles + words


def _each(
    mask: BoolArray, look: str, mark: str, left: float, top: float, size: float, off: float
) -> str:
    """Return one path with a mark wherever the mask is true."""
    rows = len(mask)
    path = "".join(
        f"M{left + column * size + off:.1f} {top + (rows - 1 - row) * size + off:.1f}{mark}"
        for row, column in zip(*np.nonzero(mask), strict=True)
    )
    return f'<path class="{look}" d="{path}"/>' if path else ""


def _legend(part: StudySlice) -> str:
    """Return the legend of a map: the classes of loss, unstable, and no design."""
    losses = np.concatenate([part.losses(basis).ravel() for basis in part.bases])
    entries = [(f"t{k}", "h10v10h-10z", label) for k, label in enumerate(_LABELS)]
    if np.isinf(losses).any():
        entries.append(("no", "m1 1l8 8m0-8l-8 8", "unstable"))
    if np.isnan(losses).any():
        entries.append(("none", "m1 5h8", "no design"))
    text, at = "", _LEFT
    for look, mark, label in entries:
        text += f'<path class="{look}" d="M{at:g} 5{mark}"/>'
        text += f'<text x="{at + 15:g}" y="14">{label}</text>'
        at += 34 + 7.2 * len(label)
    return text
