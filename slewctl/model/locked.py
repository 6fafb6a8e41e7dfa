"""Natural frequencies with the hub locked or free, converged, with an error estimate.

A locked rotor, behind an elastic joint, gives the zeros of the rotor's own angle.  A locked
hub is what a shaker test with the brake on, or a dip in the response of the hub
angle, shows: the zeros of the transfer function from torque to hub angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import Basis
from slewctl.basis.with_joint import jointed
from slewctl.errors import InputError, check_choice
from slewctl.model.assembly import check_arm, factors
from slewctl.model.converge import check_modes, converged, held
from slewctl.model.ritz import Boundary, ritz_modes

BOUNDARIES: tuple[Boundary, ...] = ("hub-locked", "rotor-locked", "free")


@dataclass(frozen=True, eq=False)
class Frequencies:
    """The first natural frequencies of an arm and how far they are converged.

    Attributes
    ----------
    boundary : {"hub-locked", "rotor-locked", "free"}
        What is held: the hub, the rotor behind an elastic joint, or nothing.
    hz : ndarray, shape (modes,)
        Undamped frequencies of the flexible modes in Hz, increasing.
    relative_errors : ndarray, shape (modes,)
        Estimated relative error of each: its change when the polynomial basis was last
        enlarged, plus rounding.
    functions : int
        How many polynomial functions they were computed with.
    """

    boundary: Boundary
    hz: Array
    relative_errors: Array
    functions: int

    def __post_init__(self) -> None:
        self.hz.setflags(write=False)
        self.relative_errors.setflags(write=False)


def frequencies(arm: Arm, modes: int, boundary: Boundary = "hub-locked") -> Frequencies:
    """Return the first `modes` converged flexible frequencies of `arm`.

    The polynomial basis, with panels at the profiles' breakpoints, is enlarged until the
    frequencies stop falling.

    Parameters
    ----------
    arm : Arm
    modes : int
        How many flexible modes.
    boundary : {"hub-locked", "rotor-locked", "free"}
        The rotor of an arm with an elastic joint.

    Returns
    -------
    Frequencies

    Raises
    ------
    InputError
        If `arm` is not an arm, modes < 1 or more than 500, or the boundary is unknown, or
        the rotor's and there is no joint.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> from slewctl.model import frequencies
    >>> frequencies(arm, 2, "free").hz.round(3).tolist()
    [1.061, 4.161]
    """
    check_arm(arm, "frequencies")
    check_choice(boundary, BOUNDARIES, "frequencies.boundary")
    modes = check_modes(modes, "frequencies.modes")
    known = held(arm, boundary).given_modes
    if known is not None and modes > known:
        raise InputError(
            f"{modes} modes of an arm whose data give {known}",
            where="frequencies.modes",
            remedy=f"ask for at most {known}",
        )
    found = converged(arm, modes, boundary)
    return Frequencies(boundary, found.omega / (2 * np.pi), found.errors, found.basis.n)


def hub_locked_frequencies_hz(arm: Arm, modes: int) -> Array:
    """Return the first `modes` frequencies in Hz of `arm` with its hub held, shape (modes,).

    `frequencies` returns them with their error estimates.

    Parameters
    ----------
    arm : Arm
    modes : int

    Returns
    -------
    ndarray, shape (modes,)

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> sc.hub_locked_frequencies_hz(arm, 2).round(3).tolist()
    [0.77, 4.097]
    """
    return frequencies(arm, modes, "hub-locked").hz


def ritz_frequencies_hz(arm: Arm, basis: Basis, boundary: Boundary) -> Array:
    """Return all frequencies in Hz, shape (n,), that one `basis` gives, increasing."""
    arm = held(arm, boundary)
    return ritz_modes(factors(arm, jointed(arm, basis)), boundary).omega / (2 * np.pi)
