"""Slices of a study: designs that differ in basis, order and hub inertia only, for its maps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from slewctl._show import Axes, axes_or_new
from slewctl._types import Array, IntArray
from slewctl.compare.design_basis import SOURCES
from slewctl.compare.study.designs import (
    HUB,
    OPTIMAL,
    OTHER_AXES,
    VARIATION,
    Designs,
    Row,
    alike,
)
from slewctl.compare.study.results_file import Rows
from slewctl.errors import InputError, check_choice, shown

# What the designs of a slice have in common.
COMMON = tuple(name for name in (*OTHER_AXES, VARIATION) if name != "n")
# An optimum that moves by more with the modes of the truth is no yardstick.
_DRIFT = 0.01
# What is behind this digit of a loss is rounding.
_DIGITS = 9


@dataclass(frozen=True, eq=False)
class StudySlice:
    """Designs that differ in basis, order and hub inertia only.

    Attributes
    ----------
    title : str
        What they have in common.
    rows : sequence of mapping
    """

    title: str
    rows: Sequence[Row]

    @cached_property
    def _designs(self) -> Designs:
        return Designs(self.rows)

    @cached_property
    def bases(self) -> list[str]:
        """Bases, the simplest first, then reductions of the truth."""
        return sorted(self._designs.codes("basis")[1], key=SOURCES.index)

    @cached_property
    def orders(self) -> list[int]:
        """Numbers of functions, increasing."""
        return sorted(self._designs.codes("n")[1])

    @cached_property
    def hub_ratios(self) -> list[float]:
        """Hub inertias over the beam's, increasing."""
        return sorted(self._designs.codes(HUB)[1])

    @property
    def drifting(self) -> list[float]:
        """Hub ratios at which the optimum still moves with the modes of the truth."""
        hubs, drift = (self._designs.numbers(name) for name in (HUB, "optimum_drift"))
        return np.unique(hubs[np.abs(drift) > _DRIFT]).tolist()

    def plot(self, basis: str, ax: Axes | None = None) -> Axes:
        """Draw the loss of one basis against the hub inertia, a line for each order.

        Parameters
        ----------
        basis : str
        ax : matplotlib Axes, optional
            By default those of a new figure.

        Returns
        -------
        Axes
            An unstable design is a gap in its line.
        """
        ax = axes_or_new(ax)
        for n, losses in zip(self.orders, self.losses(basis), strict=True):
            ax.plot(self.hub_ratios, np.where(np.isfinite(losses), losses, np.nan), "o-",
                    label=f"n = {n}")  # fmt: skip
        ax.set_xscale("symlog", linthresh=1e-2)
        ax.set_yscale("log")
        ax.set_xlabel("hub inertia over the beam's")
        ax.set_ylabel("lost " + self.yardstick)
        ax.set_title(basis)
        ax.legend()
        return ax

    @property
    def yardstick(self) -> str:
        """What the losses are relative to.

        A method that does not minimise the cost is compared with the best that it reaches
        itself at the same hub: what it costs beside that is no matter of the basis.
        """
        if self.rows[0]["method"] in OPTIMAL:
            return "of the optimal cost"
        return "over the method's own best design for the same hub"

    def losses(self, basis: str) -> Array:
        """Return the loss over the `yardstick`, shape (orders, hub_ratios).

        Infinite where the loop is unstable, NaN where there is no design.
        """
        designs, found = self._designs, np.full((len(self.orders), len(self.hub_ratios)), math.nan)
        own = designs.made & designs.equal("basis", basis)
        order = np.searchsorted(self.orders, designs.numbers("n")[own])
        hub = self._hubs[own]
        found[order, hub] = designs.costs[own] / self._least[hub] - 1
        return np.round(found, _DIGITS)

    @cached_property
    def _hubs(self) -> IntArray:
        """The place of each design's hub among the `hub_ratios`."""
        return np.searchsorted(self.hub_ratios, self._designs.numbers(HUB))

    @cached_property
    def _least(self) -> Array:
        """The least cost over the optimum that counts as no loss, for each hub."""
        least = np.ones(len(self.hub_ratios))
        if self.rows[0]["method"] not in OPTIMAL:
            own = np.full(len(least), math.inf)
            np.minimum.at(own, self._hubs, self._designs.costs)
            least = np.where(np.isfinite(own), own, least)
        return least


def slices_of(designs: Designs) -> tuple[StudySlice, ...]:
    """Return the combinations of the other axes that span hub inertias and orders, widest first."""
    part = alike(designs, COMMON)
    _, first, count = np.unique(part, return_index=True, return_counts=True)
    hubs, orders = (_values_of(designs, part, name) for name in (HUB, "n"))
    members = np.split(np.argsort(part, kind="stable"), np.cumsum(count)[:-1])
    spanning = np.flatnonzero((hubs > 1) & (orders > 1))
    return tuple(
        StudySlice(_title(designs.rows[first[k]]), _taken(designs.rows, members[k]))
        for k in sorted(spanning, key=lambda k: (-hubs[k], -orders[k], first[k]))
    )


def sliced(slices: Sequence[StudySlice], wanted: Mapping[str, str]) -> tuple[StudySlice, ...]:
    """Return the slices at some values of the axes; see `StudyResult.sliced`."""
    found = list(slices)
    if wanted and not found:
        raise InputError(
            "the study has no maps: one is of several hub ratios and several orders",
            where="slice",
            remedy="leave it out",
        )
    for axis, text in wanted.items():
        check_choice(axis, COMMON, "slice")
        values = sorted({part.rows[0].get(axis) for part in found}, key=lambda v: (v is None, v))
        there = {_text(value): value for value in values}
        given = _read(axis, text)
        if given not in there:
            raise InputError(
                f"no slice has {axis} = {shown(text)}",
                where="slice",
                remedy=f"there are {'; '.join(there)}",
            )
        found = [part for part in found if part.rows[0].get(axis) == there[given]]
    return tuple(found)


def _text(value: Any) -> str:
    """Return the value of an axis as it is written."""
    return f"{value:g}" if isinstance(value, float | int) else str(value)


def _read(axis: str, text: str) -> str:
    """Return a value as it is written here, however it was given."""
    if axis == "sensors":
        return text.replace(", ", "+")
    try:
        return f"{float(text):g}"
    except ValueError:
        return text


def _values_of(designs: Designs, part: IntArray, name: str) -> IntArray:
    """Return how many values of a column there are in each part."""
    codes, known = designs.codes(name)
    pairs = np.unique(part * max(len(known), 1) + codes)
    return np.bincount(pairs // max(len(known), 1))


def _taken(rows: Sequence[Row], places: IntArray) -> Sequence[Row]:
    """Return some of the rows, without a copy of what is in them."""
    if isinstance(rows, Rows):
        return Rows(rows.keys, [rows.values[place] for place in places])
    return [rows[place] for place in places]


def _title(row: Row) -> str:
    changed = f"; change of the arm: {row[VARIATION]}" if row.get(VARIATION) else ""
    return (
        f"{row['method']} from {row['sensors'].replace('+', ', ')}; payload "
        f"{row['payload_ratio']:g} of the beam's mass, damping ratio {row['damping_ratio']:g}, "
        f"bandwidth {row['bandwidth']:g} of the first flexible frequency{changed}"
    )
