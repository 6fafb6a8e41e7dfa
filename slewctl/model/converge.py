"""Enlarging the polynomial basis until the frequencies stop falling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.basis import Basis, Modal, Polynomial
from slewctl.basis.with_joint import jointed
from slewctl.errors import InputError, check_count, shown
from slewctl.model.assembly import factors
from slewctl.model.ritz import Boundary, RitzModes, Triangular, ritz_modes, rounding
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
    turning = held(arm, boundary)
    sizes = _enlarged(arm, modes)
    first, basis = next(sizes), next(sizes)
    coarse: RitzModes | None = None
    omega: Array | None = None
    while basis.n <= _few(modes):
        # The frequencies alone until they settle, the first from within the same matrices.
        parts = factors(turning, jointed(turning, basis))
        found = Triangular.of(parts, boundary)
        beside = len(found.inverse) - basis.n
        before = found.omega(first.n + beside)[:modes] if omega is None else omega
        omega = found.omega(basis.n + beside)[:modes]
        change = np.abs(before / omega - 1)
        following = next(sizes)
        if _settled(change, basis) or following.n > _few(modes):
            coarse = found.modes()
            if _settled(change, basis):
                return _finished(turning, basis, coarse, modes, change)
        first, basis = basis, following
    if coarse is None:
        coarse = modes_in(arm, first, modes, boundary, tolerance=_ROUGHLY)
    while True:
        fine = modes_in(arm, basis, modes, boundary, coarse)
        change = np.abs(coarse.omega[:modes] / fine.omega[:modes] - 1)
        if _settled(change, basis):
            return _finished(turning, basis, fine, modes, change)
        coarse, basis = fine, next(sizes)


def _enlarged(arm: Arm, modes: int) -> Iterator[Polynomial]:
    """Yield bases of more and more functions, as many on every panel, for so many modes."""
    edges = arm.breakpoints
    panels = len(edges) + 1
    few = -(-12 // panels)
    terms = 3 + 2 * modes // panels + few
    while True:
        yield Polynomial(panels * terms, edges)
        terms += max(1, few, terms // 4)


def _few(modes: int) -> int:
    """Return up to how many functions all modes of the matrices cost less than those wanted."""
    return max(SMALL, 3 * trials(modes))


def _settled(change: Array, basis: Polynomial) -> bool:
    """Whether frequencies stand still, or no more functions are taken."""
    most = max(_MOST_FUNCTIONS, (len(basis.edges) + 1) * _MOST_TERMS)
    return bool(change.max() <= _TARGET) or basis.n > most


def _finished(
    turning: Arm, basis: Polynomial, found: RitzModes, modes: int, change: Array
) -> Converged:
    omega = found.omega[:modes]
    shapes = found.shapes[:, :modes]
    return Converged(jointed(turning, basis), omega, shapes, change + rounding(omega))


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
    if basis.n <= _few(modes):
        return ritz_modes(factors(arm, jointed(arm, basis)), boundary)
    start = coarse.shapes[:, : trials(modes)] if coarse else None
    return lowest_modes(arm, basis, modes, boundary, start, tolerance)
