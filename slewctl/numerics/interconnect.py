"""Systems put together: in series, in parallel, side by side, and in a loop."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.numerics.linear_system import LinearSystem

Matrices: TypeAlias = tuple[Array, Array, Array, Array]


class AlgebraicLoopError(ValueError):
    """A loop without delay whose equations have no unique solution."""


def series(first: LinearSystem, second: LinearSystem) -> LinearSystem:
    """Return second·first: what `first` gives is what `second` takes.

    Parameters
    ----------
    first, second : LinearSystem
        As many outputs as inputs, on one clock.
    """
    none = np.zeros((first.nstates, second.nstates))
    return LinearSystem(
        np.block([[first.A, none], [second.B @ first.C, second.A]]),
        np.vstack([first.B, second.B @ first.D]),
        np.hstack([second.D @ first.C, second.C]),
        second.D @ first.D,
        first.dt if first.dt is not None else second.dt,
        inputs=first.input_labels,
        outputs=second.output_labels,
    )


def parallel(first: LinearSystem, second: LinearSystem) -> LinearSystem:
    """Return first + second, of equal shapes and on one clock."""
    return LinearSystem(
        diagonal(first.A, second.A),
        np.vstack([first.B, second.B]),
        np.hstack([first.C, second.C]),
        first.D + second.D,
        first.dt if first.dt is not None else second.dt,
        inputs=first.input_labels,
        outputs=first.output_labels,
    )


def side_by_side(*systems: LinearSystem) -> LinearSystem:
    """Return systems that have nothing to do with each other as one, on one clock."""
    A, B, C, D = (diagonal(*part) for part in zip(*(s.matrices for s in systems), strict=True))
    return LinearSystem(A, B, C, D, systems[0].dt)


def lft(plant: LinearSystem, controller: LinearSystem) -> LinearSystem:
    """Return the lower linear fractional transformation: the controller closed around a plant.

    Parameters
    ----------
    plant : LinearSystem
        From [w, u] to [z, y], where the controller takes the last outputs, y, and gives the
        last inputs, u.
    controller : LinearSystem
        u = K y: connected with a plus sign, on the plant's clock.

    Raises
    ------
    AlgebraicLoopError
        If I − D_K D₂₂ is singular.
    """
    Ak, Bk, Ck, Dk = controller.matrices
    w, z = plant.ninputs - controller.noutputs, plant.noutputs - controller.ninputs
    B1, B2 = plant.B[:, :w], plant.B[:, w:]
    (C1, C2), D = (plant.C[:z], plant.C[z:]), plant.D
    n, k = plant.nstates, controller.nstates
    # u = Dk (C₂ x + D₂₁ w + D₂₂ u) + Ck x_k, solved for u.
    left = _well_posed(Dk @ D[z:, w:])
    u = np.linalg.solve(left, np.hstack([Dk @ C2, Ck, Dk @ D[z:, :w]]))
    moved = np.hstack([plant.A, np.zeros((n, k)), B1]) + B2 @ u
    seen = np.hstack([C1, np.zeros((z, k)), D[:z, :w]]) + D[:z, w:] @ u
    y = np.hstack([C2, np.zeros((len(C2), k)), D[z:, :w]]) + D[z:, w:] @ u
    own = np.hstack([np.zeros((k, n)), Ak, np.zeros((k, w))]) + Bk @ y
    moved = np.vstack([moved, own])
    return LinearSystem(
        moved[:, : n + k],
        moved[:, n + k :],
        seen[:, : n + k],
        seen[:, n + k :],
        plant.dt,
        inputs=plant.input_labels[:w],
        outputs=plant.output_labels[:z],
    )


def behind_feedthrough(controller: LinearSystem, feedthrough: Array) -> LinearSystem:
    """Return the controller that, given y, does what `controller` does given y − D u.

    The loop of the one around a plant with the feedthrough D is the loop of the other around
    the plant without (Zhou, Doyle and Glover, Robust and Optimal Control, section 17.2).

    Parameters
    ----------
    controller : LinearSystem
    feedthrough : ndarray, shape (measurements, controls)
        D, of the plant.

    Raises
    ------
    AlgebraicLoopError
        If the feedthroughs of both make a loop without solution.
    """
    A, B, C, Dk = controller.matrices
    # u = C x + Dk (y − D u), solved for u.
    left = _well_posed(-Dk @ feedthrough)
    C, Dk = (np.asarray(np.linalg.solve(left, rows), dtype=float) for rows in (C, Dk))
    return LinearSystem(
        A - B @ feedthrough @ C,
        B - B @ feedthrough @ Dk,
        C,
        Dk,
        controller.dt,
        inputs=controller.input_labels,
        outputs=controller.output_labels,
        states=controller.state_labels,
        name=controller.name,
    )


def _well_posed(round_trip: Array) -> Array:
    """Return I − `round_trip`; refuse a loop without delay that has no solution."""
    left = np.eye(len(round_trip)) - round_trip
    smallest = np.linalg.svd(left, compute_uv=False).min(initial=np.inf)
    if smallest <= 4 * np.finfo(float).eps * (1 + np.linalg.norm(round_trip)):
        raise AlgebraicLoopError
    return left


def closed_matrix(A: Array, B: Array, C: Array, controller: Matrices) -> Array:
    """Return the state matrix of ẋ = Ax + Bu, y = Cx under u = K y, the controller's states below.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
    controller : tuple of ndarray
        A, B, C and D of K.
    """
    Ak, Bk, Ck, Dk = controller
    return np.block([[A + B @ Dk @ C, B @ Ck], [Bk @ C, Ak]])


def diagonal(*blocks: Array) -> Array:
    """Return a block-diagonal matrix; blocks without rows or columns keep their other size."""
    return np.asarray(block_diag(*blocks), dtype=float)
