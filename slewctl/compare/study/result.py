"""The result of a study: its rows, its answer, and the slices that maps are drawn of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._show import Axes, DataFrame, axes_or_new, table_html, to_frame
from slewctl._types import Array
from slewctl.compare.design_basis import SOURCES
from slewctl.compare.study.answer import (
    OPTIMAL,
    VARIATION,
    Answer,
    Row,
    Share,
    answer,
    share,
    stable,
)
from slewctl.compare.study.grid import Study

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
    def bases(self) -> list[str]:
        """Bases, the simplest first, then reductions of the truth."""
        return sorted({row["basis"] for row in self.rows}, key=SOURCES.index)

    @cached_property
    def orders(self) -> list[int]:
        """Numbers of functions, increasing."""
        return sorted({row["n"] for row in self.rows})

    @cached_property
    def hub_ratios(self) -> list[float]:
        """Hub inertias over the beam's, increasing."""
        return sorted({row["hub_ratio"] for row in self.rows})

    @property
    def drifting(self) -> list[float]:
        """Hub ratios at which the optimum still moves with the modes of the truth."""
        moving = {r["hub_ratio"] for r in self.rows if abs(r["optimum_drift"] or 0.0) > _DRIFT}
        return sorted(moving)

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
        found = np.full((len(self.orders), len(self.hub_ratios)), math.nan)
        order = {n: place for place, n in enumerate(self.orders)}
        column = {ratio: place for place, ratio in enumerate(self.hub_ratios)}
        for row in self.rows:
            if row["basis"] == basis and row["outcome"] != "no design":
                least = self._least.get(row["hub_ratio"], 1.0)
                cost = (1 + row["h2_loss"]) / least if stable(row) else math.inf
                found[order[row["n"]], column[row["hub_ratio"]]] = cost - 1
        return np.round(found, _DIGITS)

    @cached_property
    def _least(self) -> dict[float, float]:
        """The least cost over the optimum that counts as no loss, at the hubs where it isn't 1."""
        least: dict[float, float] = {}
        if self.rows[0]["method"] not in OPTIMAL:
            for row in filter(stable, self.rows):
                hub, cost = row["hub_ratio"], 1 + row["h2_loss"]
                least[hub] = min(cost, least.get(hub, cost))
        return least


@dataclass(frozen=True, eq=False)
class StudyResult:
    """A study with the row of every design; see `slewctl.compare.evaluate_point` for its keys.

    Attributes
    ----------
    study : Study
    rows : sequence of mapping
        Lengths over the travel of the tip, times in periods of the first mode, and so on.
    """

    study: Study
    rows: Sequence[Row]

    def _repr_html_(self) -> str:
        counts = [
            {
                "method": method,
                "basis": each.basis,
                "designs": each.designs,
                "stable": each.stable,
                "at most 5 % lost": each.good,
            }
            for method, each in self.shares
        ]
        return table_html(counts, " ".join(self.answer.sentences))

    def to_frame(self) -> DataFrame:
        """Return the rows as a pandas data frame, one design a row."""
        return to_frame(self.rows)

    @cached_property
    def answer(self) -> Answer:
        """Three sentences and what they were counted from."""
        return answer(self.rows)

    @property
    def refused(self) -> int:
        """How many designs could not be made."""
        return sum(row["outcome"] == "no design" for row in self.rows)

    @cached_property
    def shares(self) -> tuple[tuple[str, Share], ...]:
        """How often each basis is good, by method."""
        made = [row for row in self.rows if row["outcome"] != "no design"]
        kinds = dict.fromkeys((row["method"], row["basis"]) for row in made)
        return tuple(
            (method, share([row for row in made if row["method"] == method], basis))
            for method, basis in kinds
        )

    @cached_property
    def slices(self) -> tuple[StudySlice, ...]:
        """The combinations of the other axes that span hub inertias and orders, widest first."""
        parts: dict[str, list[Row]] = {}
        for row in self.rows:
            parts.setdefault(_title(row), []).append(row)
        slices = [StudySlice(title, rows) for title, rows in parts.items()]
        spanning = [s for s in slices if len(s.hub_ratios) > 1 and len(s.orders) > 1]
        return tuple(sorted(spanning, key=lambda s: (-len(s.hub_ratios), -len(s.orders))))


def _title(row: Row) -> str:
    changed = f"; change of the arm: {row[VARIATION]}" if row.get(VARIATION) else ""
    return (
        f"{row['method']} from {row['sensors'].replace('+', ', ')}; payload "
        f"{row['payload_ratio']:g} of the beam's mass, damping ratio {row['damping_ratio']:g}, "
        f"bandwidth {row['bandwidth']:g} of the first flexible frequency{changed}"
    )
