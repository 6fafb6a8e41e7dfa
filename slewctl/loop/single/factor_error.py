"""How far a factor may be from what its modes say, bounded from the distances of its poles."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, IntArray
from slewctl.loop.single.powers import majorant_powers, powers_of
from slewctl.numerics.long_complex import LONG_ROUNDING
from slewctl.numerics.modal_bounds import ROUNDING
from slewctl.numerics.modal_form import Block, ModalForm


class ErrorBound:
    """Bounds of |X − Y (s − J)⁻¹ ξ − D|, of rounding, and of what modes leave out.

    Of each component, whose states A couples with no others, the latter is
    |Y| R f · g R |ξ| / (1 − g R f), R = |(s − J)⁻¹|: see `ModalForm`.

    Parameters
    ----------
    form : ModalForm
    blocks : list of Block
    alone : ndarray of int
        The other poles.
    rounding : float
        Relative, of one term of a sum.
    offset : ndarray, shape (p,)
        Error of what is not a mode.
    """

    def __init__(
        self, form: ModalForm, blocks: list[Block], alone: IntArray, rounding: float, offset: Array
    ) -> None:
        self.form, self.blocks, self.offset = form, blocks, offset
        self.alone = alone
        entry = np.abs(form.entry) + form.entry_error
        shape = np.abs(form.shape) + form.shape_error
        inexact = form.shape_error + rounding * shape
        self.entry, self.shape, self.inexact = entry, shape, inexact
        # By component, so that sums over its modes are sums over neighbours.
        self.order = np.argsort(form.component[alone], kind="stable")
        pick = alone[self.order]
        self.components = int(form.component.max(initial=-1)) + 1
        self.has_single, self.starts = np.unique(form.component[pick], return_index=True)
        self.own = (inexact * entry + shape * form.entry_error).T[pick]
        self.crossing = np.stack(
            [form.weight * entry, form.weight * form.spread, *(shape * form.spread)]
        )[:, pick]
        # The poles of a sampled factor are computed on the plane of s.
        unit = LONG_ROUNDING if form.long else ROUNDING
        self.pole_error = unit * np.abs(form.poles[pick]) if form.sample_time else np.zeros(0)
        self.shifted = (shape * entry).T[pick]
        self.outputs = len(shape)
        self.powers = [self._of_powers(block) if _of_one_pole(block) else None for block in blocks]

    def __call__(self, single: Array, blocks: list[Array]) -> Array:
        """Return the bounds, shape (m, p).

        Parameters
        ----------
        single : ndarray, shape (m, number of simple poles)
            |1/(s − J)| of each, on an interval or at a point.
        blocks : list of ndarray, shape (m, k)
            The same of the diagonal of each block.
        """
        R, form = single[:, self.order], self.form
        own = self.offset
        if len(self.pole_error):
            turned = R * self.pole_error
            far = np.where(turned < 1, R / np.where(turned < 1, 1 - turned, 1.0), np.inf)
            own = own + (R * far * self.pole_error) @ self.shifted
            R = far
        own = own + R @ self.own
        sums = self._sums(R)  # (p + 2, m, components)
        p = self.outputs
        for block, powers, near in zip(self.blocks, self.powers, blocks, strict=True):
            index, where = block.index, form.component[block.index[0]]
            if powers is not None:
                found = powers_of(near[:, 0], len(index))[:, 1:] @ powers
                own = own + found[:, :p]
                sums[:, :, where] += found[:, p:].T
                continue
            shape, weight = self.shape[:, index].T, form.weight[index]
            spread, inexact, entry = (
                majorant(block, near, vector[index])
                for vector in (form.spread, form.entry_error, self.entry)
            )
            own = own + inexact @ shape + entry @ self.inexact[:, index].T
            sums[0, :, where] += entry @ weight
            sums[1, :, where] += spread @ weight
            sums[2:, :, where] += (spread @ shape).T
        room = 1 - sums[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            through = np.where(room > 0, sums[0] / room, np.inf)
            moved = (sums[2:] * through).sum(axis=2).T
        return np.asarray(np.where(np.isnan(moved), np.inf, moved) + own)

    def _of_powers(self, block: Block) -> Array:
        """Return what each power of the reach of a block adds to all sums, shape (k, 2p + 2)."""
        index, form = block.index, self.form
        shape, weight = self.shape[:, index].T, form.weight[index]
        spread, inexact, entry = (
            majorant_powers(block, vector[index])
            for vector in (form.spread, form.entry_error, self.entry)
        )
        own = inexact @ shape + entry @ self.inexact[:, index].T
        return np.column_stack([own, entry @ weight, spread @ weight, spread @ shape])

    def _sums(self, R: Array) -> Array:
        """Return the sums over the simple modes of each component."""
        if self.components == 1:
            return np.asarray((R @ self.crossing.T).T[:, :, None])
        found = np.zeros((len(self.crossing), len(R), self.components))
        if len(self.starts):
            for row, vector in enumerate(self.crossing):
                found[row, :, self.has_single] = np.add.reduceat(R * vector, self.starts, axis=1).T
        return found


def _of_one_pole(block: Block) -> bool:
    """Whether all poles of a block are exactly one, as far from everything as each other."""
    return block.nilpotent or len(block.index) == 1


def majorant(block: Block, reach: Array, vector: Array) -> Array:
    """Return |(s − T)⁻¹| times a vector with positive entries, shape (m, k).

    Parameters
    ----------
    block : Block
    reach : ndarray, shape (m, k)
        |1/(s − T)| on the diagonal.
    vector : ndarray, shape (k,)
    """
    T = np.abs(block.T)
    w = np.zeros_like(reach)
    for i in reversed(range(len(vector))):
        above = w[:, i + 1 :] @ T[i, i + 1 :]
        w[:, i] = reach[:, i] * (vector[i] + above)
    return w
