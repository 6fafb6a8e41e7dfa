"""Any basis with the arm's own static deflection appended."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis, Growth
from slewctl.basis.deflection import Motion, deflections
from slewctl.basis.inertia import panel_rule
from slewctl.errors import InputError, shown

# Ten digits: the static shape has less than this of its own, and none that can be told.
_DEPENDENT = 1e-10


@dataclass(frozen=True)
class WithStatic(Basis):
    """The functions of `parent` and the arm's deflection under constant angular acceleration.

    The last function is the inertia-relief shape, EI φ'' = ∫_x^L m̄ (r + s)(s − x) ds +
    m_t (r + L)(L − x) + J_t, scaled to unit strain energy.  With it the model bends under a
    slowly varying torque exactly as the arm does.

    Parameters
    ----------
    parent : Basis
    arm : Arm, optional
        By default the one that the functions are matched to.

    Raises
    ------
    InputError
        If either is something else, or, once there is an arm, the static shape is a
        combination of the parent's functions to ten digits, as that of a uniform arm is of
        four polynomials.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.WithStatic(sc.Slewing(2))).n
    3
    """

    n: int = field(init=False)
    parent: Basis
    arm: Arm | None = None
    name: ClassVar[str] = "with static shape"

    def __post_init__(self) -> None:
        for name, kind in (("parent", Basis), ("arm", Arm)):
            value = getattr(self, name)
            if not isinstance(value, kind) and not (name == "arm" and value is None):
                raise InputError(
                    f"{shown(value)} is not of type {kind.__name__}",
                    where=f"WithStatic.{name}",
                    remedy="give the basis, then the arm",
                )
        object.__setattr__(self, "n", self.parent.n + 1)
        if self.arm is None:
            return
        object.__setattr__(self, "parent", self.parent.matched_to(self.arm))
        if self._independence() < _DEPENDENT:
            raise InputError(
                f"the static shape lies in the span of the {self.parent.name} functions",
                where="WithStatic.parent",
                remedy="use the parent by itself: it bends as the arm does already",
            )

    def _matched_to(self, arm: Arm) -> WithStatic:
        return self if self.arm is not None else replace(self, arm=arm)

    @cached_property
    def static(self) -> Combined:
        """The static shape alone, a piecewise polynomial."""
        if self.arm is None:
            raise self._unmatched()
        return deflections(self.arm, Motion(np.ones(1)))

    def _independence(self) -> float:
        """Return the distance of the static curvature from the parent's, relative to its size."""
        bounds = np.union1d([0.0, *self.breakpoints, 1.0], np.linspace(0, 1, self.n + 2))
        xi, weights = panel_rule(tuple(bounds), 24)
        root = np.sqrt(weights)[:, None]
        known = root * self.parent.evaluate(xi, 2)
        static = (root * self.static.evaluate(xi, 2))[:, 0]
        Q = np.linalg.qr(known)[0]
        for _ in range(2):  # the second time removes the rounding of the first
            rest = static - Q @ (Q.T @ static)
        return float(np.linalg.norm(rest) / np.linalg.norm(static))

    @property
    def growth(self) -> Growth:
        mine, own = self.parent.growth, self.static.growth
        return Growth(max(mine.exponent, own.exponent), max(mine.degree, own.degree))

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return tuple(sorted({*self.parent.breakpoints, *self.static.breakpoints}))

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        return np.hstack(
            [self.parent.evaluate(xi, derivative), self.static.evaluate(xi, derivative)]
        )
