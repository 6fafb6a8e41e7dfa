"""The rows of a study by column: what is counted over a million designs without a row of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from slewctl._types import Array, BoolArray, IntArray
from slewctl.compare.study.results_file import Rows

Row = Mapping[str, Any]

# The axes of a study beside the basis.
HUB = "hub_ratio"
OTHER_AXES = ("payload_ratio", "damping_ratio", "bandwidth", "sensors", "method", "n")
# An axis that not every study has.
VARIATION = "variation"
# Costs that differ by less than a percent are a draw.
DRAW = 0.01
# A design is good when it loses no more than this of the optimal cost.
GOOD = 0.05
# The methods that minimise the cost by which they are judged; of others, less is expected.
OPTIMAL = ("lqg", "h2-lmi")


class Designs:
    """The designs of a study.

    Parameters
    ----------
    rows : sequence of mapping
        All with the same keys.
    """

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = rows
        self._codes: dict[str, tuple[IntArray, list[Any]]] = {}
        self._numbers: dict[str, Array] = {}

    def __len__(self) -> int:
        return len(self.rows)

    def column(self, name: str) -> list[Any]:
        """Return the values of a column; None of one that the study does not have."""
        if isinstance(self.rows, Rows):
            place = self.rows.keys.index(name) if name in self.rows.keys else None
            return [None if place is None else row[place] for row in self.rows.values]
        return [row.get(name) for row in self.rows]

    def numbers(self, name: str) -> Array:
        """Return a column as numbers; what is unknown is NaN."""
        if name not in self._numbers:
            values = [math.nan if value is None else value for value in self.column(name)]
            self._numbers[name] = np.array(values, dtype=float)
        return self._numbers[name]

    def codes(self, name: str) -> tuple[IntArray, list[Any]]:
        """Return a column as places in the list of its values, and that list."""
        if name not in self._codes:
            places: dict[Any, int] = {}
            found = [places.setdefault(value, len(places)) for value in self.column(name)]
            self._codes[name] = np.array(found, dtype=np.intp), list(places)
        return self._codes[name]

    def equal(self, name: str, *values: Any) -> BoolArray:
        """Return where a column has one of these values."""
        codes, known = self.codes(name)
        wanted = np.array([value in values for value in known], dtype=bool)
        return wanted[codes] if known else np.zeros(0, dtype=bool)

    @property
    def has_variations(self) -> bool:
        """Whether the study changes something else of its arm."""
        return bool(len(self.rows)) and VARIATION in self.rows[0]

    @cached_property
    def made(self) -> BoolArray:
        """Where there is a design."""
        return ~self.equal("outcome", "no design")

    @cached_property
    def stable(self) -> BoolArray:
        """Where it is stable on the truth and on one of twice the modes."""
        return self.equal("outcome", "stable") & self.equal("stable_on_twice", True)

    @cached_property
    def costs(self) -> Array:
        """Cost over the optimum; infinite where the loop is not stable."""
        return np.where(self.stable, 1 + self.numbers("h2_loss"), math.inf)

    @cached_property
    def good(self) -> BoolArray:
        """Where the design is stable and loses at most 5 % of the optimal cost."""
        return self.stable & (self.numbers("h2_loss") <= GOOD)

    @cached_property
    def optimal(self) -> BoolArray:
        """Where the method minimises the cost by which it is judged."""
        return self.made & self.equal("method", *OPTIMAL)

    @cached_property
    def _sides(self) -> tuple[IntArray, list[Any]]:
        """For designs alike but for the basis, the place of that on each basis; −1 for none."""
        codes, bases = self.codes("basis")
        group = alike(self, (HUB, *OTHER_AXES, VARIATION))
        sides = np.full((int(group.max(initial=-1)) + 1, len(bases)), -1, dtype=np.intp)
        made = np.flatnonzero(self.made)
        sides[group[made], codes[made]] = made
        return sides, bases

    def pairs(self, first: str, second: str) -> tuple[IntArray, IntArray]:
        """Return the places of designs on two bases that are alike in everything else."""
        sides, bases = self._sides
        if first not in bases or second not in bases:
            none = np.zeros(0, dtype=np.intp)
            return none, none
        a, b = sides[:, bases.index(first)], sides[:, bases.index(second)]
        both = (a >= 0) & (b >= 0)
        return a[both], b[both]

    def winners(self, first: IntArray, second: IntArray) -> IntArray:
        """Return 1 where the first of two designs is better, −1 where the second is, 0 for a draw.

        A stable design beats an unstable one, a smaller cost one that is more than a percent
        larger.
        """
        a, b = self.costs[first], self.costs[second]
        with np.errstate(invalid="ignore"):  # two infinite ones
            draw = (a == b) | (np.abs(a - b) <= DRAW * np.minimum(a, b))
        return np.where(draw, 0, np.where(a < b, 1, -1))


def alike(designs: Designs, names: Sequence[str]) -> IntArray:
    """Return a number for each design, the same for those that agree in all of some columns."""
    found = np.zeros(len(designs), dtype=np.intp)
    for name in names:
        codes, known = designs.codes(name)
        # Kept small in each step: the product of all counts could pass every integer.
        _, found = np.unique(found * max(len(known), 1) + codes, return_inverse=True)
    return found
