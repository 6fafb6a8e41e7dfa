"""The arm and its parts: a beam clamped to a hub, with a payload at its tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.arm.damping import KelvinVoigt, Rayleigh
from slewctl.arm.magnitudes import check_length, check_size_or_zero
from slewctl.arm.motor import Motor
from slewctl.arm.profiles import Profile, ProfileSpec, Stations, as_profile
from slewctl.arm.section import Section, rectangle, round_tube
from slewctl.errors import (
    InputError,
    check_damping_ratio,
    check_each,
    shown,
)
from slewctl.export import toml_text

# Stations nearer to each other, over the length, are one: rounding of what was written.
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

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Beam(1.0, [2.0, -1.0], sc.Stations([0, 0.5, 1], [40, 30, 10])).length
    1.0
    """

    length: float
    mass_per_length: ProfileSpec
    bending_stiffness: ProfileSpec

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", check_length(self.length, "beam.length"))
        for name in ("mass_per_length", "bending_stiffness"):
            spec = getattr(self, name)
            if isinstance(spec, np.ndarray):
                spec = spec.tolist()
            object.__setattr__(self, name, tuple(spec) if isinstance(spec, list) else spec)
        # Built here, not when first asked for, so that a wrong profile is refused at once.
        _ = self.mass_profile, self.stiffness_profile

    @classmethod
    def rectangular(
        cls,
        length: float,
        *,
        width: float,
        thickness: float,
        youngs_modulus: float,
        density: float,
    ) -> Beam:
        """Return a uniform beam of rectangular section: m̄ = ρbh and EI = Ebh³/12.

        Parameters
        ----------
        length : float
            In m.
        width, thickness : float
            b and h in m; the beam bends across its thickness.
        youngs_modulus : float
            E in N/m².
        density : float
            ρ in kg/m³.

        Raises
        ------
        InputError
            If a value is not positive.

        Examples
        --------
        >>> import slewctl as sc
        >>> beam = sc.Beam.rectangular(
        ...     0.6, width=0.03, thickness=0.0015, youngs_modulus=2.0e11, density=7850.0)
        >>> round(beam.mass_per_length, 5), round(beam.bending_stiffness, 4)
        (0.35325, 1.6875)
        """
        return cls._of(length, rectangle(width, thickness), youngs_modulus, density)

    @classmethod
    def tube(
        cls,
        length: float,
        *,
        outer_diameter: float,
        inner_diameter: float = 0.0,
        youngs_modulus: float,
        density: float,
    ) -> Beam:
        """Return a uniform round tube or rod: m̄ = ρπ(D² − d²)/4 and EI = Eπ(D⁴ − d⁴)/64.

        Parameters
        ----------
        length : float
            In m.
        outer_diameter, inner_diameter : float
            D and d in m; a rod has no inner one.
        youngs_modulus : float
            E in N/m².
        density : float
            ρ in kg/m³.

        Raises
        ------
        InputError
            If a value is not positive, or the inner diameter not smaller than the outer.

        Examples
        --------
        >>> import slewctl as sc
        >>> beam = sc.Beam.tube(
        ...     2.0, outer_diameter=0.04, inner_diameter=0.036, youngs_modulus=7e10, density=2700.0)
        >>> round(beam.mass_per_length, 4), round(beam.bending_stiffness, 1)
        (0.6447, 3025.1)
        """
        section = round_tube(outer_diameter, inner_diameter)
        return cls._of(length, section, youngs_modulus, density)

    @classmethod
    def _of(cls, length: float, section: Section, youngs_modulus: float, density: float) -> Beam:
        return cls(length, *section.of_material(youngs_modulus, density))

    @cached_property
    def mass_profile(self) -> Profile:
        """m̄ in kg/m as a function of x/L."""
        return as_profile(self.mass_per_length, self.length, "beam.mass_per_length")

    @cached_property
    def stiffness_profile(self) -> Profile:
        """EI in N·m² as a function of x/L."""
        return as_profile(self.bending_stiffness, self.length, "beam.bending_stiffness")

    @cached_property
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
        J_h about the axis, in kg·m², without the rotor that `Motor.rotor_inertia` gives.
    radius : float
        r in m: the beam is clamped at this distance from the axis.
    friction : float
        Viscous friction c_h at the axis, in N·m·s/rad.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Hub(inertia=0.2, radius=0.05)
    Hub(inertia=0.2, radius=0.05, friction=0.0)
    """

    inertia: float = 0.0
    radius: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("inertia", "radius", "friction"):
            value = check_size_or_zero(getattr(self, name), f"hub.{name}")
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


@dataclass(frozen=True)
class Arm:
    """A flexible arm turned by a torque at its hub.

    Modal damping ratios, a damping law and the hub's friction add up.

    Parameters
    ----------
    beam : Beam
    hub : Hub
    payload : Payload
    damping_ratio : float or sequence of float
        Damping ratio ζ of every flexible mode of the free arm, 0 <= ζ < 1; or of its first
        modes one by one, the last value holding for all that follow.
    damping : Rayleigh or KelvinVoigt, optional
        A damping law.
    motor : Motor, optional
        What turns the hub; without one only the torque is known.
    name : str
        For tables and reports.

    Examples
    --------
    >>> import slewctl as sc
    >>> beam = sc.Beam(length=1.0, mass_per_length=2.0, bending_stiffness=40.0)
    >>> arm = sc.Arm(beam, sc.Hub(inertia=0.2), sc.Payload(mass=0.1), damping_ratio=0.01)
    >>> sc.truth(arm, 2).n
    2
    """

    beam: Beam
    hub: Hub = field(default_factory=Hub)
    payload: Payload = field(default_factory=Payload)
    damping_ratio: float | Sequence[float] = 0.0
    damping: Rayleigh | KelvinVoigt | None = None
    motor: Motor | None = None
    name: str = "arm"

    def __post_init__(self) -> None:
        _check_part(self.beam, (Beam,), "beam")
        _check_part(self.hub, (Hub,), "hub")
        _check_part(self.payload, (Payload,), "payload")
        _check_part(self.damping, (Rayleigh, KelvinVoigt, type(None)), "damping")
        _check_part(self.motor, (Motor, type(None)), "motor")
        if not isinstance(self.name, str):
            raise InputError(
                f"{shown(self.name)} is not text", where="arm.name", remedy="give a str"
            )
        object.__setattr__(self, "damping_ratio", _damping_ratio(self.damping_ratio))

    @property
    def hub_inertia(self) -> float:
        """Inertia that turns with the hub, in kg·m²: the hub's own and the motor's rotor's."""
        return self.hub.inertia + (self.motor.reflected_inertia if self.motor else 0.0)

    def damping_ratios(self, modes: int) -> Array:
        """Return the damping ratio ζ of each of the first flexible modes, shape (modes,)."""
        ratio = self.damping_ratio
        given = (ratio,) if isinstance(ratio, float | int) else tuple(ratio)
        return np.array([given[min(k, len(given) - 1)] for k in range(modes)])

    def to_toml(self) -> str:
        """Return the arm as the ``[arm]`` of a design file, or a file of its own.

        Raises
        ------
        InputError
            If a profile is a function, which a file cannot hold.

        Examples
        --------
        >>> from slewctl.arm import Arm, Beam, Hub
        >>> print(Arm(Beam(1.0, 2.0, 40.0), hub=Hub(inertia=0.2), damping_ratio=0.005).to_toml())
        [arm]
        name = "arm"
        damping_ratio = 0.005
        <BLANKLINE>
        [arm.beam]
        length = 1.0
        mass_per_length = 2.0
        bending_stiffness = 40.0
        <BLANKLINE>
        [arm.hub]
        inertia = 0.2
        <BLANKLINE>
        """
        return toml_text({"arm": arm_table(self)})


def arm_table(arm: Arm) -> dict[str, Any]:
    """Return an arm as the ``[arm]`` table of a design file; what is zero is left out."""
    beam = {key: _written(getattr(arm.beam, key), f"beam.{key}")
            for key in ("length", "mass_per_length", "bending_stiffness")}  # fmt: skip
    table: dict[str, Any] = {"name": arm.name, "damping_ratio": arm.damping_ratio or None}
    table["beam"] = beam
    for key in ("hub", "payload", "motor"):
        part = getattr(arm, key)
        table[key] = None if part is None else _kept(asdict(part))
    if arm.damping is not None:
        kind = "rayleigh" if isinstance(arm.damping, Rayleigh) else "kelvin-voigt"
        table["damping"] = {"kind": kind, **asdict(arm.damping)}
    return table


def _kept(values: Mapping[str, float | None]) -> dict[str, float] | None:
    return {key: value for key, value in values.items() if value} or None


def _written(spec: Any, where: str) -> Any:
    if isinstance(spec, Stations):
        return {"x": spec.x, "values": spec.values}
    if callable(spec):
        raise InputError(
            "a function cannot be written to a file",
            where=where,
            remedy="tabulate it as slewctl.Stations(x, values)",
        )
    return spec


def _check_part(part: object, kinds: tuple[type, ...], name: str) -> None:
    if not isinstance(part, kinds):
        wanted = [kind.__name__ for kind in kinds if kind is not type(None)]
        raise InputError(
            f"{shown(part)} is not a {' or '.join(wanted)}",
            where=f"arm.{name}",
            remedy=f"give a {' or '.join(f'slewctl.{kind}' for kind in wanted)}",
        )


def _damping_ratio(given: object) -> float | tuple[float, ...]:
    """Return one ratio as a float, several as a tuple."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str) or not isinstance(given, Sequence):
        return check_damping_ratio(given, "arm.damping_ratio")
    ratios = check_each(given, "arm.damping_ratio", check_damping_ratio)
    if not ratios:
        raise InputError("no ratio", where="arm.damping_ratio", remedy="give at least one")
    return ratios


__all__ = ["Arm", "Beam", "Hub", "Payload", "Stations"]
