"""Bases by the names that design files call them."""

from __future__ import annotations

from slewctl.basis.arm_matched import ArmMatched
from slewctl.basis.clamped_free import ClampedFree
from slewctl.basis.contract import Basis
from slewctl.basis.hub_matched import HubMatched
from slewctl.basis.polynomial import Polynomial
from slewctl.basis.slewing import Slewing
from slewctl.errors import check_choice

BASES: dict[str, type[Basis]] = {
    kind.name: kind for kind in (ClampedFree, Slewing, Polynomial, HubMatched, ArmMatched)
}
"""Bases that a name and a number of functions describe."""

NAMES = tuple(BASES)


def create(name: str, n: int) -> Basis:
    """Return the basis called `name` with `n` functions.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    n : int
        How many functions.

    Raises
    ------
    InputError
        If the name is unknown or n < 1.
    """
    return BASES[check_choice(name, NAMES, "basis")](n)
