"""Enlarging the polynomial basis until the frequencies stop falling."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.basis import Basis, Modal, Polynomial
from slewctl.basis.with_joint import jointed
from slewctl.errors import InputError, check_count, shown
from slewctl.model.assembly import factors
from slewctl.model.ritz import Boundary, RitzModes, ritz_modes, rounding
from slewctl.model.subspace import lowest_modes, trials

MOST_MODES = 500
"""Modes that an arm can be asked for: a few seconds' work."""

# Relative change of the frequencies: rounding of well-conditioned matrices of this size.
_TARGET = 1e-11
# Shapes to be compared with finer ones: their frequencies are good to its square.
_ROUGHLY = 1e-6
# Beyond so many functions, or those that every panel needs, no more are taken.
_MOST_FUNCTIONS = 400
_MOST_TERMS = 6  # of each panel
# Up to here all modes of the matrices cost less than the few that are asked for.
SMALL = 400


def check_modes(modes: object, where: str) -> int:
    """Return a number of modes; refuse what is none, or more than can be computed."""
    count = check_count(modes, where)
    if count > MOST_MODES:
        raise InputError(
            f"{shown(count)} modes, where {MOST_MODES} are the most",
            where=where,
            remedy=f"give at most {MOST_MODES}",
        )
    return count


@dataclass(frozen=True, eq=False)
class Converged:
    """An arm's first modes in polynomials, settled.

    Attributes
    ----------
    basis : Basis
        Polynomials, or `Modal` for an arm from modal data, and the twist of a joint that moves.
    omega : ndarray, shape (modes,)
        Natural frequencies in rad/s, increasing.
    shapes : ndarray, shape (basis.n, modes)
        The modes in the functions of the basis.
    errors : ndarray, shape (modes,)
        Relative change of each frequency in the last enlargement, plus rounding.
    """

    basis: Basis
    omega: Array
    shapes: Array
    errors: Array


def converged(arm: Arm, modes: int, boundary: Boundary) -> Converged:
    """Return the first `modes` modes of `arm` once their frequencies have settled.

    Parameters
    ----------
    arm : Arm
        Its breakpoints are the edges of the panels.
    modes : int
    boundary : {"hub-locked", "rotor-locked", "free"}
    """
    if isinstance(arm.beam, ModalData):
        return _given(arm, arm.beam.modes, modes, boundary)
    edges = arm.breakpoints
    panels = len(edges) + 1
    few = -(-12 // panels)
    terms = 3 + 2 * modes // panels + few
    first = Polynomial(panels * terms, edges)
    coarse = modes_in(arm, first, modes, boundary, tolerance=_ROUGHLY)
    while True:
        terms += max(1, few, terms // 4)
        basis = Polynomial(panels * terms, edges)
        fine = modes_in(arm, basis, modes, boundary, coarse)
        omega = fine.omega[:modes]
        change = np.abs(coarse.omega[:modes] / omega - 1)
        if change.max() <= _TARGET or basis.n > max(_MOST_FUNCTIONS, panels * _MOST_TERMS):
            turning = jointed(held(arm, boundary), basis)
            return Converged(turning, omega, fine.shapes[:, :modes], change + rounding(omega))
        coarse = fine


def _given(arm: Arm, known: int, modes: int, boundary: Boundary) -> Converged:
    """Return the modes of an arm from modal data: what is given needs no convergence."""
    moving = held(arm, boundary)
    basis = jointed(moving, Modal(known))
    found = ritz_modes(factors(moving, basis), boundary)
    omega = found.omega[:modes]
    return Converged(basis, omega, found.shapes[:, :modes], rounding(omega))


def held(arm: Arm, boundary: Boundary) -> Arm:
    """Return the arm of a boundary: a joint between the rotor and a hub that is held is none."""
    if boundary == "rotor-locked" and arm.joint is None:
        raise InputError(
            "the rotor and the hub of an arm without an elastic joint are one",
            where="boundary",
            remedy="ask for hub-locked, or give the arm its joint",
        )
    return replace(arm, joint=None) if boundary == "hub-locked" else arm


def modes_in(
    arm: Arm,
    basis: Polynomial,
    modes: int,
    boundary: Boundary,
    coarse: RitzModes | None = None,
    tolerance: float = 1e-10,
) -> RitzModes:
    """Return the first `modes` modes, or more, in one basis with as many terms on each panel.

    Parameters
    ----------
    arm : Arm
    basis : Polynomial
    modes : int
    boundary : {"hub-locked", "rotor-locked", "free"}
    coarse : RitzModes, optional
        Those in a basis of fewer terms, to start from.
    tolerance : float
        Relative error of the shapes; that of the frequencies is its square.
    """
    arm = held(arm, boundary)
    if basis.n <= max(SMALL, 3 * trials(modes)):
        return ritz_modes(factors(arm, jointed(arm, basis)), boundary)
    start = coarse.shapes[:, : trials(modes)] if coarse else None
    return lowest_modes(arm, basis, modes, boundary, start, tolerance)
