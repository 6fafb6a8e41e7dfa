"""Admissible functions, one file per basis, behind one narrow contract."""

from slewctl.basis.clamped_free import ClampedFree
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis
from slewctl.basis.polynomial import Polynomial
from slewctl.basis.slewing import Slewing
from slewctl.errors import check_choice

BASES: dict[str, type[Basis]] = {kind.name: kind for kind in (ClampedFree, Slewing, Polynomial)}


def create(name: str, n: int) -> Basis:
    """Return the basis called `name` with `n` functions.

    Raises
    ------
    InputError
        If the name is unknown or n < 1.
    """
    return BASES[check_choice(name, BASES, "basis")](n)


__all__ = ["BASES", "Basis", "ClampedFree", "Combined", "Polynomial", "Slewing", "create"]
