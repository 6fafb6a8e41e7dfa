"""A region for the poles of a closed loop, and its matrix inequalities."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design.lmi.blocks import Block
from slewctl.design.lmi.state_feedback import Unknowns
from slewctl.design.result import Guarantee

# A damping sector of a smaller ratio is the half plane to the solver's precision; what was
# promised is recomputed from the poles all the same.
_NO_SECTOR = 1e-6


@dataclass(frozen=True)
class Region:
    """Where poles are wanted: Re s ≤ −decay, damping ratio ≥ damping, |s| ≤ radius.

    Parameters
    ----------
    decay : float
        In 1/s; 0 for none.
    damping : float
        ζ in [0, 1); 0 for none.
    radius : float
        In rad/s; infinite for none.
    """

    decay: float = 0.0
    damping: float = 0.0
    radius: float = math.inf

    def scaled(self, rate: float) -> Region:
        """Return the region in time units of 1/rate."""
        return Region(self.decay / rate, self.damping, self.radius / rate)

    def holds(self, poles: ComplexArray) -> bool:
        """Whether all poles are stable and within, to a relative 1e-6."""
        return bool(poles.real.max() < 0) and all(g.check.passed for g in self.promises(poles))

    def broken(self, poles: ComplexArray) -> Region:
        """Return those of the wishes that the poles do not keep."""
        decay, damping, radius = (
            not wish.holds(poles)
            for wish in (Region(self.decay), Region(0.0, self.damping), Region(radius=self.radius))
        )
        return Region(
            self.decay if decay else 0.0,
            self.damping if damping else 0.0,
            self.radius if radius else math.inf,
        )

    def and_also(self, other: Region) -> Region:
        """Return where both regions are."""
        return Region(
            max(self.decay, other.decay),
            max(self.damping, other.damping),
            min(self.radius, other.radius),
        )

    def promises(self, poles: ComplexArray, of: str = "") -> list[Guarantee]:
        """Return what the region asks for beside what the poles achieve."""
        slowest = -float(poles.real.max())
        least = float((-poles.real / np.maximum(np.abs(poles), np.finfo(float).tiny)).min())
        wishes = []
        if self.decay > 0:
            wishes.append(Guarantee(f"decay rate{of}", self.decay, slowest, "at least", "1/s"))
        if self.damping > 0:
            wishes.append(Guarantee(f"damping ratio{of}", self.damping, least, "at least"))
        if math.isfinite(self.radius):
            farthest = float(np.abs(poles).max())
            wishes.append(Guarantee(f"radius{of}", self.radius, farthest, "at most", "rad/s"))
        return wishes

    def blocks(self, unknowns: Unknowns) -> list[Block]:
        """Return the region's matrix inequalities, for every vertex of the dynamics."""
        found = []
        for i in range(len(unknowns.dynamics)):
            found += self._vertex_blocks(unknowns.moved(i), unknowns.P)
        return found

    def _vertex_blocks(self, M: Array, P: Array) -> list[Block]:
        import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

        blocks = []
        if self.decay > 0:
            blocks.append(Block("decay rate", -(M + M.T + 2 * self.decay * P)))
        if self.damping > _NO_SECTOR:
            # T between the symmetric and the skew part: every eigenvalue of the sector's own
            # block is double, on which the solver stalls; these two say the same.
            slope = math.sqrt(1 - self.damping**2) / self.damping
            H, S = slope * (M + M.T), M - M.T
            T = cp.Variable(P.shape, symmetric=True)
            blocks.append(Block("damping, skew part", cp.bmat([[T, S], [S.T, T]])))
            blocks.append(Block("damping, symmetric part", -(H + T)))
            blocks.append(Block("damping ratio", -cp.bmat([[H, S], [S.T, H]]), imposed=False))
        if math.isfinite(self.radius):
            edge = cp.bmat([[P, M / self.radius], [M.T / self.radius, P]])
            blocks.append(Block("radius", edge))
        return blocks
