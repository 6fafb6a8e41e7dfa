"""The damping matrix of an arm: its ratios, its law, and friction at hub, rotor and joint."""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space

from slewctl._types import Array
from slewctl.arm import Arm, KelvinVoigt
from slewctl.model.ritz import Factors, RitzModes, ritz_modes


def damping_matrix(
    arm: Arm, twist: Array, parts: Factors, mass: Array, stiffness: Array, free: RitzModes
) -> Array:
    """Return D: modal damping, the arm's damping law, friction at hub and rotor, the joint's.

    Modal damping is M U diag(2ζω) UᵀM; its θ row vanishes, since turning the arm as a rigid
    body bends nothing, and is set to exactly zero.  Of hub-locked modes V it is
    M_e V diag(2ζω) VᵀM_e on q alone.
    """
    damping = np.zeros_like(mass)
    if arm.damping_modes == "hub-locked":
        damping[1:, 1:] = locked_damping(arm, parts, twist)
    else:
        damping[1:, 1:] = _modal_damping(arm, (mass @ free.shapes)[1:], free.omega)
    damping += parts.drag.T @ parts.drag
    if arm.damping is not None:
        alpha, beta = arm.damping.coefficients
        damping += alpha * mass + beta * stiffness
    if arm.joint is None:
        damping[0, 0] += arm.hub.friction
        return damping
    hub = np.concatenate([[1.0], twist])
    damping += arm.hub.friction * np.outer(hub, hub)
    damping[0, 0] += arm.joint.rotor_friction
    own = arm.joint.damping
    if isinstance(arm.damping, KelvinVoigt):  # of the beam's material alone
        own -= arm.damping.retardation_time * arm.joint.stiffness
    damping[1:, 1:] += own * np.outer(twist, twist)
    return damping


def locked_damping(arm: Arm, parts: Factors, twist: Array) -> Array:
    """Return D on q of the damping ratios of the hub-locked modes, shape (n, n).

    Behind an elastic joint the hub is held where nothing twists it; what the functions turn
    it by is taken out of their momenta, since it bends nothing.
    """
    bending, stiffness, still = parts.mass[:, 1:], parts.stiffness, np.eye(len(twist))
    if arm.joint is not None:
        rotation = parts.mass[:, 0].copy()
        rotation[-1] = 0.0  # the rotor's row
        bending = bending - np.outer(rotation, twist)
        still = null_space(twist[None, :])
        stiffness = stiffness[1:] @ still
    if not still.size:
        return np.zeros((len(twist), len(twist)))
    unmoved = np.zeros((len(bending), 1))
    of_held = Factors(np.hstack([unmoved, bending @ still]), stiffness, parts.drag[:0])
    held = ritz_modes(of_held, "hub-locked")
    return _modal_damping(arm, bending.T @ (bending @ (still @ held.shapes)), held.omega)


def _modal_damping(arm: Arm, momenta: Array, omega: Array) -> Array:
    """Return Σ 2ζω p pᵀ over modes with these momenta p, one a column."""
    scaled = momenta * np.sqrt(2 * arm.damping_ratios(len(omega)) * omega)
    return np.asarray(scaled @ scaled.T)
