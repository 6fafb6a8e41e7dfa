"""Mass and stiffness of an arm from modal data, as square-root factors."""

from __future__ import annotations

import math

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.basis import Basis, Combined
from slewctl.errors import InputError


def modal_factors(arm: Arm, basis: Basis) -> tuple[Array, Array]:
    """Return F with M = FᵀF and S with K_e = SᵀS for the modes of an arm's data.

    A row for each mode, whose momentum is η̇_k + δ_k θ̇, and one for the inertia that none of
    them moves: M = [[J, δ], [δᵀ, I]].

    Parameters
    ----------
    arm : Arm
        Whose beam is `ModalData`.
    basis : Basis
        `Modal`, or combinations of its functions.

    Returns
    -------
    mass : ndarray, shape (modes + 1, n + 1)
    stiffness : ndarray, shape (modes, n)
    """
    if isinstance(basis, Combined):
        mass, stiffness = modal_factors(arm, basis.parent)
        combined = np.column_stack([mass[:, 0], mass[:, 1:] @ basis.coefficients])
        return combined, stiffness @ basis.coefficients
    data, n = modal_data(arm), basis.n
    coupling = np.array(data.coupling[:n])
    left = data.rigid_remainder(arm.hub_inertia) + float(np.sum(np.square(data.coupling[n:])))
    mass = np.zeros((n + 1, n + 1))
    mass[:n, 0], mass[:n, 1:] = coupling, np.eye(n)
    mass[n, 0] = math.sqrt(left)
    return mass, np.diag(data.omega[:n])


def modal_data(arm: Arm) -> ModalData:
    """Return the modal data of an arm that has no beam."""
    if not isinstance(arm.beam, ModalData):
        raise InputError(
            f"{arm.name} has a beam and no modal data",
            where="arm.beam",
            remedy="give modal data in its place, or use another basis",
        )
    return arm.beam
