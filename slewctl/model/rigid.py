"""Mass and inertia of the beam by itself: the scales of hubs and payloads."""

from __future__ import annotations

from functools import lru_cache

from slewctl.arm import Arm, Beam, Hub, ModalData
from slewctl.basis import Modal, Polynomial
from slewctl.basis.with_joint import jointed
from slewctl.model.assembly import check_arm, factors


def beam_mass(arm: Arm) -> float:
    """Return ∫ m̄ dx in kg.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    float
        In kg.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> from slewctl.model import beam_mass
    >>> round(beam_mass(arm), 4)
    0.7917
    """
    L = arm.beam.length
    near, middle, far = (_inertia(arm.beam, r) for r in (0.0, L / 2, L))
    # ∫ m̄ (r + x)² dx is a parabola in r, whose second difference is 2 (L/2)² ∫ m̄ dx.
    return (near - 2 * middle + far) / (2 * (L / 2) ** 2)


def beam_inertia(arm: Arm) -> float:
    """Return ∫ m̄ (r + x)² dx in kg·m²: the beam's inertia about the axis.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    float
        In kg·m².

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> from slewctl.model import beam_inertia
    >>> round(beam_inertia(arm), 4)
    0.1944
    """
    return _inertia(arm.beam, arm.hub.radius)


def total_inertia(arm: Arm) -> float:
    """Return J in kg·m²: the inertia of the rigid arm about the axis (physics of eq. 9).

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    float
        In kg·m².

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> from slewctl.model import total_inertia
    >>> round(total_inertia(arm), 4)
    0.3944
    """
    check_arm(arm, "total_inertia")
    # The first column is the rigid rotation, whatever functions stand beside it.
    functions = Modal(1) if isinstance(arm.beam, ModalData) else Polynomial(1)
    rotation = factors(arm, jointed(arm, functions.matched_to(arm))).mass[:, 0]
    return float(rotation @ rotation)


@lru_cache(maxsize=256)
def _inertia(beam: Beam, radius: float) -> float:
    return total_inertia(Arm(beam, Hub(radius=radius)))
