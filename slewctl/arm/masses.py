"""Rigid bodies fixed to the beam: lumped masses along it, and what all of them come to."""

from __future__ import annotations

from dataclasses import dataclass, replace

from slewctl._types import Array
from slewctl.arm.magnitudes import check_size_or_zero


@dataclass(frozen=True)
class LumpedMass:
    """A small rigid body fixed to the beam: an accelerometer, a joint, a payload on its way.

    Parameters
    ----------
    x : float
        Where, in m from the clamp; from 0 to the beam's length.
    mass : float
        In kg.
    inertia : float
        About its own centre, in kg·m².

    Examples
    --------
    >>> import slewctl as sc
    >>> beam = sc.Beam(1.0, 1.0, 1.0)
    >>> arm = sc.Arm(beam, masses=(sc.LumpedMass(0.5, mass=1.0),))
    >>> omega = 6.283185307179586 * sc.hub_locked_frequencies_hz(arm, 2)
    >>> omega.round(4).tolist()
    [2.8912, 14.2254]
    """

    x: float
    mass: float = 0.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "mass", "inertia"):
            value = check_size_or_zero(getattr(self, name), f"lumped_mass.{name}")
            object.__setattr__(self, name, value)

    def scaled(self, factor: float) -> LumpedMass:
        """Return the same body with its mass and inertia times a factor."""
        return replace(self, mass=factor * self.mass, inertia=factor * self.inertia)


@dataclass(frozen=True, eq=False)
class Bodies:
    """The rigid bodies on a beam, the payload first.

    Attributes
    ----------
    xi : ndarray, shape (k,)
        x/L of each.
    mass, inertia : ndarray, shape (k,)
        In kg, and in kg·m² about their own centres.
    """

    xi: Array
    mass: Array
    inertia: Array

    @property
    def rotary(self) -> bool:
        """Whether any has a rotary inertia."""
        return bool(self.inertia.any())


@dataclass(frozen=True)
class Payload:
    """A rigid body at the tip.

    Parameters
    ----------
    mass : float
        m_t in kg.
    inertia : float
        J_t about its own centre, in kg·m².

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Payload(mass=0.1)
    Payload(mass=0.1, inertia=0.0)
    """

    mass: float = 0.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "inertia"):
            value = check_size_or_zero(getattr(self, name), f"payload.{name}")
            object.__setattr__(self, name, value)
