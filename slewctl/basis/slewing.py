"""The paper's new admissible functions: eigenfunctions of the slewing uniform beam (eq. 46)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.basis.characteristic import slewing_roots
from slewctl.basis.contract import Basis, Growth


@dataclass(frozen=True)
class Slewing(Basis):
    """The first `n` eigenfunctions of the uniform beam slewing without a hub.

    φ = σ [sin βx + c sinh βx − β(1 + c) x], c = sin βL / sinh βL, with σ making the tip
    displacement one (eq. 46–47): a pinned-free mode minus its root slope times x.
    Every function has φ''(0) = 0: the set carries no bending moment at the root.

    Parameters
    ----------
    n : int

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.Slewing(3)).n
    3
    """

    name: ClassVar[str] = "slewing"

    @property
    def growth(self) -> Growth:
        return Growth(float(slewing_roots(self.n).z[-1]), 1)

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        roots = slewing_roots(self.n)
        z, sin = roots.z, roots.sin
        small = np.exp(-z)
        ratio = 2 * sin * small / (1 - small**2)  # sin z / sinh z
        sigma = 1 / (2 * sin - z * (1 + ratio))
        angle = np.multiply.outer(xi, z)
        near_root, near_tip = np.exp(-angle), np.exp(angle - z)
        # sin z · sinh(zξ)/sinh z and sin z · cosh(zξ)/sinh z without overflow
        sinh = sin * (near_tip - small * near_root) / (1 - small**2)
        cosh = sin * (near_tip + small * near_root) / (1 - small**2)
        slope = z * (1 + ratio)
        shape = (
            np.sin(angle) + sinh - np.multiply.outer(xi, slope),
            z * (np.cos(angle) + cosh) - slope,
            z**2 * (sinh - np.sin(angle)),
        )[derivative]
        return sigma * shape
