"""Mass per length and bending stiffness of a uniform beam from its cross-section and material."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slewctl.arm.magnitudes import check_size, check_size_or_zero
from slewctl.errors import InputError


@dataclass(frozen=True)
class Section:
    """A cross-section.

    Attributes
    ----------
    area : float
        In m².
    second_moment : float
        Of area about the axis that it bends about, in m⁴.
    """

    area: float
    second_moment: float

    def of_material(self, youngs_modulus: object, density: object) -> tuple[float, float]:
        """Return ρA in kg/m and EI in N·m² for E in N/m² and ρ in kg/m³."""
        modulus = check_size(youngs_modulus, "beam.youngs_modulus")
        return check_size(density, "beam.density") * self.area, modulus * self.second_moment


def rectangle(width: object, thickness: object) -> Section:
    """Return a rectangle that bends across its thickness: I = b h³/12."""
    b, h = check_size(width, "beam.width"), check_size(thickness, "beam.thickness")
    return Section(b * h, b * h**3 / 12)


def round_tube(outer_diameter: object, inner_diameter: object) -> Section:
    """Return a round tube, or a rod without a hole: I = π(D⁴ − d⁴)/64."""
    D = check_size(outer_diameter, "beam.outer_diameter")
    d = check_size_or_zero(inner_diameter, "beam.inner_diameter")
    if not d < D:
        raise InputError(
            f"the hole of {d:g} m leaves nothing of a tube of {D:g} m",
            where="beam.inner_diameter",
            remedy="give a smaller one than the outer diameter",
        )
    # The difference of powers as a product, which loses no digits of a thin wall.
    squares = (D - d) * (D + d)
    return Section(math.pi / 4 * squares, math.pi / 64 * squares * (D**2 + d**2))
