"""Functions of an arm with an elastic joint: the joint's twist, then those of the beam."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis.contract import Basis, Growth


@dataclass(frozen=True)
class WithJoint(Basis):
    """The twist θ − θ_m of an elastic joint, and the functions of `parent`.

    The first function turns the hub against the rotor by 1 rad and bends nothing; the
    others bend the beam and leave the joint as it is.

    Parameters
    ----------
    parent : Basis
        Matched to its arm.
    """

    n: int = field(init=False)
    parent: Basis
    name: ClassVar[str] = "joint and beam"

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", self.parent.n + 1)

    @property
    def twist(self) -> Array:
        return np.eye(self.n)[0]

    @property
    def growth(self) -> Growth:
        return self.parent.growth

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return self.parent.breakpoints

    @property
    def needs_beam(self) -> bool:
        return self.parent.needs_beam

    def tip_values(self, coefficients: Array) -> Array:
        return self.parent.tip_values(coefficients[1:])

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        bent = self.parent.evaluate(xi, derivative)
        return np.hstack([np.zeros((len(xi), 1)), bent])

    def _combined(self, xi: Array, derivative: int, coefficients: Array) -> Array:
        return self.parent.combined(xi, derivative, coefficients[1:])


def jointed(arm: Arm, basis: Basis) -> Basis:
    """Return a matched basis with the twist of the arm's joint, where it has one.

    Parameters
    ----------
    arm : Arm
    basis : Basis
        Matched to the arm; returned as it is if it has the twist already.
    """
    return basis if arm.joint is None or basis.twist.any() else WithJoint(basis)
