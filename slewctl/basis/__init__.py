"""Admissible functions, one file per basis, behind one narrow contract."""

from collections.abc import Callable

from slewctl.arm import Arm
from slewctl.basis.arm_matched import ArmMatched
from slewctl.basis.clamped_free import ClampedFree
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis
from slewctl.basis.hub_matched import HubMatched
from slewctl.basis.matched_roots import Ratios
from slewctl.basis.polynomial import Polynomial
from slewctl.basis.slewing import Slewing
from slewctl.basis.with_static import WithStatic
from slewctl.errors import InputError, check_choice

BASES: dict[str, type[Basis]] = {kind.name: kind for kind in (ClampedFree, Slewing, Polynomial)}
"""Bases that are the same for every arm."""

FITTED: dict[str, Callable[[Arm, int], Basis]] = {
    HubMatched.name: HubMatched.of,
    ArmMatched.name: ArmMatched.of,
}
"""Bases that are made for one arm."""

NAMES = (*BASES, *FITTED)


def create(name: str, n: int, arm: Arm | None = None) -> Basis:
    """Return the basis called `name` with `n` functions, fitted to `arm` where it can be.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    n : int
        How many functions.
    arm : Arm, optional
        Only the bases of `FITTED` need it.

    Raises
    ------
    InputError
        If the name is unknown, n < 1, or the basis needs an arm and there is none.
    """
    check_choice(name, NAMES, "basis")
    if name in BASES:
        return BASES[name](n)
    if not isinstance(arm, Arm):
        raise InputError(
            f"the {name} basis is made for one arm, and none is given",
            where="basis",
            remedy="give the arm, as in create(name, n, arm)",
        )
    return FITTED[name](arm, n)


__all__ = [
    "BASES",
    "FITTED",
    "NAMES",
    "ArmMatched",
    "Basis",
    "ClampedFree",
    "Combined",
    "HubMatched",
    "Polynomial",
    "Ratios",
    "Slewing",
    "WithStatic",
    "create",
]
