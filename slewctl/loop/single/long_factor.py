"""Values of a factor in long numbers, where sums of its modes cancel too many digits."""

from __future__ import annotations

import numpy as np

from slewctl._types import ComplexArray
from slewctl.numerics.long_complex import LongComplex
from slewctl.numerics.modal_basis import AT_END, outside
from slewctl.numerics.modal_form import Block, ModalForm


class LongFactor:
    """The outputs of a system with one input, at points s, rounded once.

    Parameters
    ----------
    form : ModalForm
    blocks : list of Block
        All other poles stand alone.
    """

    def __init__(self, form: ModalForm, blocks: list[Block]) -> None:
        alone = np.flatnonzero(outside(len(form.poles), [block.index for block in blocks]))
        self.form, self.blocks, self.alone = form, blocks, alone
        self.poles = LongComplex(form.poles, form.poles_low)
        self.entry = LongComplex(form.entry, form.entry_low)
        self.shape = LongComplex(form.shape, form.shape_low)
        self.residue = self.shape[:, alone].times(self.entry[alone])

    def values(self, s: ComplexArray) -> ComplexArray:
        """Return the functions at points s, shape (m, p).

        In δ = z − 1 = 2s/(1 − s) where they are sampled.
        """
        point = LongComplex(s)
        if self.form.sample_time:
            point = LongComplex(2 * s).times(LongComplex(np.ones_like(s)).minus(s).reciprocal())
        with np.errstate(divide="ignore", invalid="ignore"):
            near = point[:, None].minus(self.poles).reciprocal()  # (m, n)
        if self.form.sample_time:
            at_end = self.form.poles == AT_END
            near.hi[:, at_end], near.lo[:, at_end] = ((1 - s) / 2)[:, None], 0
        found = LongComplex(np.tile(self.form.D.astype(complex), (len(s), 1)))
        if len(self.alone):
            parts = near[:, None, self.alone].times(self.residue)
            found = found.plus(parts.sum(2))
        for block in self.blocks:
            found = found.plus(self._of_block(block, near))
        return found.value

    def _of_block(self, block: Block, near: LongComplex) -> LongComplex:
        """Return Y (s − T)⁻¹ ξ by back-substitution."""
        index, T = block.index, LongComplex(block.T, block.low)
        w: dict[int, LongComplex] = {}
        for i in reversed(range(len(index))):
            total = LongComplex(np.full(len(near.hi), self.entry.hi[index[i]]))
            total = total.plus(self.entry.lo[index[i]] * np.ones(len(near.hi)))
            for j in range(i + 1, len(index)):
                total = total.plus(w[j].times(T[i, j]))
            w[i] = total.times(near[:, index[i]])
        found = w[0][:, None].times(self.shape[:, index[0]])
        for j in range(1, len(index)):
            found = found.plus(w[j][:, None].times(self.shape[:, index[j]]))
        return found
