"""Bases by the names that design files call them."""

from __future__ import annotations

from slewctl.arm import Arm, ModalData
from slewctl.basis.arm_matched import ArmMatched
from slewctl.basis.clamped_free import ClampedFree
from slewctl.basis.contract import Basis
from slewctl.basis.hub_matched import HubMatched
from slewctl.basis.modal import MODAL, Modal
from slewctl.basis.polynomial import Polynomial
from slewctl.basis.slewing import Slewing
from slewctl.errors import InputError, check_choice, check_count, shown

BASES: dict[str, type[Basis]] = {
    kind.name: kind for kind in (ClampedFree, Slewing, Polynomial, HubMatched, ArmMatched)
}
"""Bases that a name and a number of functions describe."""

NAMES = tuple(BASES)
"""Of bases for an arm that has a beam."""


def bases_of(arm: Arm) -> tuple[str, ...]:
    """Return the names of the bases that an arm can be modelled on.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.basis import bases_of
    >>> bases_of(sc.Arm(sc.ModalData(600.0, (0.2, 1.3), (20.0, 4.0))))
    ('modal',)
    """
    return (MODAL,) if isinstance(arm.beam, ModalData) else NAMES


def described(basis: object, n: object = None, where: str = "basis") -> Basis:
    """Return a basis given as itself, or by name and number of functions.

    Parameters
    ----------
    basis : Basis or str
    n : int, optional
        With a name.
    where : str
        What asked for it, for messages.

    Raises
    ------
    InputError
        For something else, a name without `n`, or `n` beside a basis that has its own.
    """
    if isinstance(basis, str):
        if n is None:
            raise InputError(
                f"no number of functions for the basis {shown(basis)}",
                where=where,
                remedy="give n too",
            )
        return create(basis, check_count(n, "n"))
    if not isinstance(basis, Basis):
        raise InputError(
            f"{shown(basis)} is not a basis",
            where=where,
            remedy="give one, as in Slewing(3), or its name and n",
        )
    if n is not None:
        raise InputError(
            f"{basis!r} has its own number of functions", where="n", remedy="leave n out"
        )
    return basis


def create(name: str, n: int) -> Basis:
    """Return the basis called `name` with `n` functions.

    Parameters
    ----------
    name : str
        One of `NAMES`, or ``modal``.
    n : int
        How many functions.

    Returns
    -------
    Basis

    Raises
    ------
    InputError
        If the name is unknown or n < 1.

    Examples
    --------
    >>> from slewctl.basis import create
    >>> create("hub-matched", 3)
    HubMatched(n=3, ratios=None)
    """
    known: dict[str, type[Basis]] = {**BASES, MODAL: Modal}
    return known[check_choice(name, known, "basis")](n)
