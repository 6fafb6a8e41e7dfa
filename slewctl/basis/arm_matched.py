"""Functions matched to the arm's own profiles, by a few exact steps from the hub-matched ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis, Growth
from slewctl.basis.deflection import deflections, free_motion
from slewctl.basis.hub_matched import HubMatched
from slewctl.errors import InputError, check_count, shown


@dataclass(frozen=True)
class ArmMatched(Basis):
    """Hub-matched functions, bent `steps` times by their own inertia on the arm itself.

    One step takes each function φ, lets the hub counter it without a torque, and replaces
    it by the arm's deflection under the inertia forces of that motion (Stodola's iteration; in
    n functions at once, simultaneous iteration: Bathe, Finite Element Procedures, section
    11.6).  A step divides the share of a mode k > n in the functions for mode j by
    (ω_k/ω_j)²; it needs integrals along the arm but no eigenvalue problem.  On a uniform arm
    the hub-matched functions are the modes and every step leaves their span as it is.

    The functions are piecewise polynomials, in order and normalised to
    ∫ EI φ_i'' φ_j'' dξ ∝ δ_ij.

    Parameters
    ----------
    n : int
        How many functions.
    steps : int
        With three, four functions give frequencies and residues of the first three modes
        to 0.1 % for any hub and payload on tapered beams; with more, they tend to the span
        of the arm's first n modes.
    arm : Arm, optional
        By default the one that the functions are matched to.

    Raises
    ------
    InputError
        If n < 1, steps < 1 or `arm` is not an arm.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.ArmMatched(3)).n
    3
    """

    steps: int = 3
    arm: Arm | None = None
    name: ClassVar[str] = "arm-matched"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "steps", check_count(self.steps, "ArmMatched.steps"))
        if not isinstance(self.arm, Arm | None):
            raise InputError(
                f"{shown(self.arm)} is not an Arm",
                where="ArmMatched.arm",
                remedy="give a slewctl.Arm, or leave it out to match the arm",
            )

    def _matched_to(self, arm: Arm) -> ArmMatched:
        return self if self.arm is not None else replace(self, arm=arm)

    @cached_property
    def functions(self) -> Combined:
        """The functions as combinations of piecewise polynomials."""
        if self.arm is None:
            raise self._unmatched()
        found = _bent(self.arm, HubMatched(self.n).matched_to(self.arm))
        for _ in range(self.steps - 1):
            found = _bent(self.arm, found)
        return found

    @property
    def growth(self) -> Growth:
        return self.functions.growth

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return self.functions.breakpoints

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        return self.functions.evaluate(xi, derivative)


def _bent(arm: Arm, basis: Basis) -> Combined:
    """Return the deflections under the inertia of the motions that `basis` makes."""
    return deflections(arm, free_motion(arm, basis))
