"""A slender beam: its length, and what it weighs and resists along it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl.arm.magnitudes import check_length
from slewctl.arm.profiles import Profile, ProfileSpec, as_profile
from slewctl.arm.section import Section, rectangle, round_tube

# Points nearer to each other, over the length, are one: rounding of what was written.
SAME_POINT = 1e-12


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
        return distinct((*self.mass_profile.breakpoints, *self.stiffness_profile.breakpoints))


def distinct(points: Iterable[float]) -> tuple[float, ...]:
    """Return the inner points in order, those that differ by rounding alone taken as one."""
    ordered = np.unique([0.0, *points, 1.0])
    apart = np.diff(ordered, prepend=-1.0) > SAME_POINT
    return tuple(float(x) for x in ordered[apart] if 0 < x < 1 - SAME_POINT)
