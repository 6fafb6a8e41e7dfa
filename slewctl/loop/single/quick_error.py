"""The error of a factor from sums over pairs of poles, where what couples them allows it.

That of `ErrorBound`, which asks each pole by itself, in two cases: all simple poles belong to
one component, as those of an arm with friction do, or each pair, and each lone pole, is a
component of its own, as those of a modal model are.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.loop.single.factor_error import ErrorBound
from slewctl.loop.single.powers import powers_of
from slewctl.loop.single.simple_poles import Distances, SimplePoles


class QuickError:
    """Bounds of the error of a continuous factor.

    Parameters
    ----------
    bound : ErrorBound
        Its blocks are at the origin.
    poles : SimplePoles
    coupled : bool
        Whether all poles are one component, blocks included.
    """

    def __init__(self, bound: ErrorBound, poles: SimplePoles, coupled: bool) -> None:
        self.bound, self.coupled = bound, coupled
        back = np.argsort(bound.order)
        own, crossing = bound.own[back], bound.crossing[:, back].T
        up, down, lone = poles.upper, poles.lower, poles.lone
        # Of a pair the two are alike, but for the rounding of the bounds themselves.
        pair, alone = np.maximum(crossing[up], crossing[down]), crossing[lone]
        both = np.vstack([pair, alone])
        self.spread, self.moved = both[:, 1:2], (both[:, :1] * both[:, 2:]).T
        own_pair = np.maximum(own[up], own[down])
        self.weights = (np.hstack([own_pair, pair]) if coupled else own_pair).T
        self.lone_weights = (np.hstack([own[lone], alone]) if coupled else own[lone]).T

    def __call__(self, near: Distances, blocks: list[Array]) -> Array:
        """Return the bounds, shape (m, p), given the distances and the reach of the blocks."""
        p, R = self.bound.outputs, near.upper + near.lower
        sums = self.weights @ R
        if len(near.lone):
            sums += self.lone_weights @ near.lone
        own, sums = self.bound.offset[:, None] + sums[:p], sums[p:]
        for powers, reach in self._of_blocks(blocks):
            found = (reach @ powers).T
            own = own + found[:p]
            if self.coupled:
                sums = sums + found[p:]
            else:
                own = own + _through(found[p:])
        if self.coupled:
            return np.asarray((own + _through(sums)).T)
        if len(near.lone):
            R = np.vstack([R, near.lone])
        if not len(R):
            return np.asarray(own.T)
        room = 1 - (R * self.spread).max(axis=0)
        R *= R
        moved = self.moved @ R / room
        return np.asarray((own + np.where(room > 0, moved, np.inf)).T)

    def _of_blocks(self, blocks: list[Array]) -> list[tuple[Array, Array]]:
        """Return what each power of the reach of a block adds, and the powers, from the first."""
        return [
            (powers, powers_of(reach[:, 0], reach.shape[1])[:, 1:])
            for powers, reach in zip(self.bound.powers, blocks, strict=True)
            if powers is not None
        ]


def _through(sums: Array) -> Array:
    """Return |Y| R f · g R |ξ| / (1 − g R f) of one component, shape (p, m)."""
    room = 1 - sums[1]
    found = sums[2:] * (sums[0] / room)
    return np.where(room > 0, found, np.inf)


def of_simple_poles(bound: ErrorBound, poles: SimplePoles, sampled: bool) -> QuickError | None:
    """Return the quick bounds; None where poles are coupled otherwise."""
    if sampled or any(powers is None for powers in bound.powers):
        return None
    component = bound.form.component
    simple = component[bound.alone]
    of_blocks = [int(component[block.index[0]]) for block in bound.blocks]
    if bound.components == 1:
        return QuickError(bound, poles, True)
    units = [simple[poles.upper], simple[poles.lone], np.array(of_blocks, dtype=int)]
    own = np.concatenate(units)
    alike = (simple[poles.upper] == simple[poles.lower]).all()
    if alike and len(np.unique(own)) == len(own):
        return QuickError(bound, poles, False)
    return None
