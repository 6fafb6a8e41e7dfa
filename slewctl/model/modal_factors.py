"""Mass and stiffness of an arm from modal data, as square-root factors."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.arm import Arm, Joint, ModalData
from slewctl.basis import Basis, Combined
from slewctl.basis.with_joint import WithJoint
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
        `Modal`, with a joint's twist, or combinations of these.

    Returns
    -------
    mass : ndarray, shape (p, n + 1)
        The row of the rotor behind a joint last.
    stiffness : ndarray, shape (m, n)
        The row of the joint first.
    """
    if isinstance(basis, Combined):
        mass, stiffness = modal_factors(arm, basis.parent)
        combined = np.column_stack([mass[:, 0], mass[:, 1:] @ basis.coefficients])
        return combined, stiffness @ basis.coefficients
    if isinstance(basis, WithJoint) and arm.joint is not None:
        return _behind_joint(arm, arm.joint, basis)
    return _of_hub(arm, basis.n, arm.hub_inertia)


def _behind_joint(arm: Arm, joint: Joint, basis: WithJoint) -> tuple[Array, Array]:
    """Return the factors of [θ_m, twist, η]; the rotor's row is the last of the mass."""
    hub_mass, bending = _of_hub(arm, basis.parent.n, arm.hub.inertia)
    rotor = np.zeros((1, basis.n + 1))
    rotor[0, 0] = math.sqrt(arm.rotor_inertia)
    turning = hub_mass[:, :1]
    mass = np.vstack([np.hstack([turning, turning, hub_mass[:, 1:]]), rotor])
    return mass, block_diag(np.array([[math.sqrt(joint.stiffness)]]), bending)


def _of_hub(arm: Arm, n: int, hub_inertia: float) -> tuple[Array, Array]:
    """Return the factors of [θ, η] for the first n modes on a hub of an inertia."""
    data = modal_data(arm)
    coupling = np.array(data.coupling[:n])
    left = data.rigid_remainder(hub_inertia) + float(np.sum(np.square(data.coupling[n:])))
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
