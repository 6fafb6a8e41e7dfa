"""The result of a study: its rows, its answer, and the slices that maps are drawn of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._show import DataFrame, table_html, to_frame
from slewctl.compare.study.answer import Answer, Share, answer, share
from slewctl.compare.study.designs import Designs, Row
from slewctl.compare.study.grid import Study
from slewctl.compare.study.slices import StudySlice, sliced, slices_of


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
    def _designs(self) -> Designs:
        return Designs(self.rows)

    @cached_property
    def answer(self) -> Answer:
        """Three sentences and what they were counted from."""
        return answer(self._designs)

    @property
    def refused(self) -> int:
        """How many designs could not be made."""
        return int((~self._designs.made).sum())

    @cached_property
    def shares(self) -> tuple[tuple[str, Share], ...]:
        """How often each basis is good, by method."""
        designs = self._designs
        (method, methods), (basis, bases) = designs.codes("method"), designs.codes("basis")
        kind = method * len(bases) + basis
        kinds, first = np.unique(kind[designs.made], return_index=True)
        return tuple(
            (
                methods[k // len(bases)],
                share(designs, designs.made & (kind == k), bases[k % len(bases)]),
            )
            for k in kinds[np.argsort(first)]
        )

    @cached_property
    def slices(self) -> tuple[StudySlice, ...]:
        """The combinations of the other axes that span hub inertias and orders, widest first."""
        return slices_of(self._designs)

    def sliced(self, wanted: Mapping[str, str]) -> tuple[StudySlice, ...]:
        """Return the slices at some values of the axes.

        Parameters
        ----------
        wanted : mapping of str to str
            Values by axis, such as ``{"bandwidth": "0.1"}``; all slices for none.

        Raises
        ------
        InputError
            For what is no axis of a slice, or a value at which there is none.
        """
        return sliced(self.slices, wanted)
