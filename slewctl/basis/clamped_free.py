"""Eigenfunctions of the clamped-free uniform beam ("cantilever modes", eq. 45)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.basis.characteristic import clamped_free_roots
from slewctl.basis.contract import Basis, Growth


@dataclass(frozen=True)
class ClampedFree(Basis):
    """The first `n` eigenfunctions of the uniform cantilever.

    φ = sin βx − sinh βx + s (cosh βx − cos βx), s = (sin βL + sinh βL)/(cos βL + cosh βL):
    eq. 45 with its misprinted sign mended, in the paper's normalisation.  The
    hyperbolic pair is written with the decaying exponentials e^(−βx) and e^(−β(L−x)),
    so that nothing overflows or cancels for any index.

    Parameters
    ----------
    n : int

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.ClampedFree(3)).n
    3
    """

    name: ClassVar[str] = "clamped-free"

    @property
    def growth(self) -> Growth:
        return Growth(float(clamped_free_roots(self.n).z[-1]), 0)

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        roots = clamped_free_roots(self.n)
        z, sin, cos = roots.z, roots.sin, roots.cos
        small = np.exp(-z)
        scale = 2 / (1 + 2 * cos * small + small**2)
        # s and (s − 1) e^z, each divided through by cosh z.
        s = scale * (sin * small + (1 - small**2) / 2)
        rising = scale * (sin - cos - small)
        angle = np.multiply.outer(xi, z)
        near_root, near_tip = np.exp(-angle), np.exp(angle - z)
        sine, cosine = np.sin(angle), np.cos(angle)
        parity = -1.0 if derivative % 2 else 1.0
        hyperbolic = 0.5 * (rising * near_tip + parity * (s + 1) * near_root)
        trigonometric = (
            sine - s * cosine,
            cosine + s * sine,
            -sine + s * cosine,
        )[derivative]
        return z**derivative * (trigonometric + hyperbolic)
