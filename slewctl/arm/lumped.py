"""A rigid link on a torsion spring: the one-mode model that vendors of laboratory arms use."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm.magnitudes import check_size, check_size_or_zero


@dataclass(frozen=True)
class LumpedLink:
    """A hub that carries a rigid link on a torsion spring, coordinates [θ, α].

    α is the link's angle relative to the hub, so θ + α is where its tip points.  The spring
    is not a beam: no `Beam` has this model's single flexible mode, and its frequencies say
    nothing about a second one.

    Parameters
    ----------
    hub_inertia : float
        J_eq in kg·m².
    link_inertia : float
        J_l of the rigid link about the axis, in kg·m².
    spring : float
        K_s of the spring in N·m/rad.
    friction : float
        Viscous friction B_eq at the axis, in N·m·s/rad.
    """

    hub_inertia: float
    link_inertia: float
    spring: float
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("hub_inertia", "link_inertia", "spring"):
            object.__setattr__(self, name, check_size(getattr(self, name), f"lumped.{name}"))
        object.__setattr__(self, "friction", check_size_or_zero(self.friction, "lumped.friction"))

    @property
    def mass(self) -> Array:
        """M in kg·m², shape (2, 2)."""
        link = self.link_inertia
        return np.array([[self.hub_inertia + link, link], [link, link]])

    @property
    def damping(self) -> Array:
        """D in N·m·s/rad, shape (2, 2)."""
        return np.diag([self.friction, 0.0])

    @property
    def stiffness(self) -> Array:
        """K in N·m/rad, shape (2, 2)."""
        return np.diag([0.0, self.spring])

    @property
    def state_matrices(self) -> tuple[Array, Array]:
        """(A, B) of the states [θ, α, θ̇, α̇] with the torque at the hub, (4, 4) and (4, 1)."""
        A = np.zeros((4, 4))
        A[:2, 2:] = np.eye(2)
        A[2:, :2] = -np.linalg.solve(self.mass, self.stiffness)
        A[2:, 2:] = -np.linalg.solve(self.mass, self.damping)
        B = np.zeros((4, 1))
        B[2:, 0] = np.linalg.solve(self.mass, [1.0, 0.0])
        return A, B

    @property
    def hub_locked_hz(self) -> float:
        """Frequency in Hz with the hub held."""
        return math.sqrt(self.spring / self.link_inertia) / (2 * math.pi)

    @property
    def free_hz(self) -> float:
        """Frequency in Hz with the hub free, without friction."""
        return self.hub_locked_hz * math.sqrt(1 + self.link_inertia / self.hub_inertia)


def quanser_lumped(hub_locked_hz: float = 3.0) -> LumpedLink:
    """Return the vendor's one-mode model of the rotary flexible link on its servo.

    J_eq = 0.00208 kg·m², B_eq = 0.015 N·m·s/rad, J_l = m L²/3 with m = 0.065 kg and
    L = 0.381 m, K_s = (2π f)² J_l (Quanser Inc., Rotary Flexible Link, experiment set-up
    script).  The vendor's f is 3 Hz; published frequency responses have their dip at
    4.12 Hz, which makes the spring 1.9 times as stiff.

    Parameters
    ----------
    hub_locked_hz : float
        f in Hz.

    Returns
    -------
    LumpedLink

    Examples
    --------
    >>> from slewctl.arm import quanser_lumped
    >>> link = quanser_lumped(hub_locked_hz=4.12)
    >>> round(link.spring, 2)
    2.11
    """
    link = 0.065 * (15 * 0.0254) ** 2 / 3
    frequency = check_size(hub_locked_hz, "quanser_lumped.hub_locked_hz")
    return LumpedLink(0.00208, link, (2 * math.pi * frequency) ** 2 * link, friction=0.015)
