"""The arm and its parts: a beam clamped to a hub, with a payload at its tip."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slewctl.arm.profiles import Profile, ProfileSpec, Stations, as_profile
from slewctl.errors import InputError, check_nonnegative, check_number, check_positive, shown

_SAME_POINT = 1e-12


@dataclass(frozen=True)
class Beam:
    """A slender beam in bending.

    Parameters
    ----------
    length : float
        L in m, measured from the clamp.
    mass_per_length : float, sequence of float, Stations or callable
        m̄(x) in kg/m; see `slewctl.arm.profiles.as_profile`.
    bending_stiffness : float, sequence of float, Stations or callable
        EI(x) in N·m².

    Raises
    ------
    InputError
        If the length or a profile is not positive, or a table does not cover the beam.
    """

    length: float
    mass_per_length: ProfileSpec
    bending_stiffness: ProfileSpec

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", check_positive(self.length, "beam.length"))
        for name in ("mass_per_length", "bending_stiffness"):
            spec = getattr(self, name)
            if isinstance(spec, np.ndarray):
                spec = spec.tolist()
            object.__setattr__(self, name, tuple(spec) if isinstance(spec, list) else spec)
        # Built here, not when first asked for, so that a wrong profile is refused at once.
        _ = self.mass_profile, self.stiffness_profile

    @cached_property
    def mass_profile(self) -> Profile:
        """m̄ in kg/m as a function of x/L."""
        return as_profile(self.mass_per_length, self.length, "beam.mass_per_length")

    @cached_property
    def stiffness_profile(self) -> Profile:
        """EI in N·m² as a function of x/L."""
        return as_profile(self.bending_stiffness, self.length, "beam.bending_stiffness")

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner points x/L where either profile has a kink or a step.

        Points that differ by rounding alone are one.
        """
        both = np.array(
            sorted({*self.mass_profile.breakpoints, *self.stiffness_profile.breakpoints})
        )
        apart = np.diff(both, prepend=0.0) > _SAME_POINT
        return tuple(float(point) for point in both[apart])


@dataclass(frozen=True)
class Hub:
    """The turning hub that carries the beam.

    Parameters
    ----------
    inertia : float
        J_h about the axis, in kg·m².
    radius : float
        r in m: the beam is clamped at this distance from the axis.
    friction : float
        Viscous friction c_h at the axis, in N·m·s/rad.
    """

    inertia: float = 0.0
    radius: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("inertia", "radius", "friction"):
            value = check_nonnegative(getattr(self, name), f"hub.{name}")
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Payload:
    """A rigid body at the tip.

    Parameters
    ----------
    mass : float
        m_t in kg.
    inertia : float
        J_t about its own centre, in kg·m².
    """

    mass: float = 0.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "inertia"):
            value = check_nonnegative(getattr(self, name), f"payload.{name}")
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Arm:
    """A flexible arm turned by a torque at its hub.

    Parameters
    ----------
    beam : Beam
    hub : Hub
    payload : Payload
    damping_ratio : float
        Damping ratio ζ of every flexible mode of the free arm, 0 <= ζ < 1.
    name : str
        For tables and reports.
    """

    beam: Beam
    hub: Hub = field(default_factory=Hub)
    payload: Payload = field(default_factory=Payload)
    damping_ratio: float = 0.0
    name: str = "arm"

    def __post_init__(self) -> None:
        for field_name, kind in (("beam", Beam), ("hub", Hub), ("payload", Payload)):
            if not isinstance(getattr(self, field_name), kind):
                raise InputError(
                    f"{shown(getattr(self, field_name))} is not a {kind.__name__}",
                    where=f"arm.{field_name}",
                    remedy=f"give a slewctl.{kind.__name__}",
                )
        if not isinstance(self.name, str):
            raise InputError(
                f"{shown(self.name)} is not text", where="arm.name", remedy="give a str"
            )
        ratio = check_number(self.damping_ratio, "arm.damping_ratio")
        if not 0 <= ratio < 1:
            raise InputError(
                f"{ratio:g} is not in [0, 1)",
                where="arm.damping_ratio",
                remedy="give ζ as a fraction, for example 0.005 for half a percent",
            )
        object.__setattr__(self, "damping_ratio", ratio)


__all__ = ["Arm", "Beam", "Hub", "Payload", "Stations"]
