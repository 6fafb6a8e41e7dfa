"""Beams from a section: its moments by integration over the section itself."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss

from slewctl import Beam, InputError

SIZES = st.floats(1e-4, 1.0)
NODES, WEIGHTS = leggauss(8)


@given(SIZES, SIZES)
def test_a_rectangle_is_integrated_over_its_thickness(width: float, thickness: float) -> None:
    """m̄ = ∫ρ dA and EI = ∫E y² dA, y across the thickness."""
    beam = Beam.rectangular(
        1.0, width=width, thickness=thickness, youngs_modulus=2e11, density=7850.0
    )
    y, strips = NODES * thickness / 2, WEIGHTS * thickness / 2 * width
    np.testing.assert_allclose(beam.mass_per_length, 7850 * strips.sum(), rtol=1e-13)
    np.testing.assert_allclose(beam.bending_stiffness, 2e11 * strips @ y**2, rtol=1e-13)


@given(SIZES, st.floats(1e-9, 1.0))
def test_a_tube_is_a_rod_less_its_hole_to_rounding(outer: float, wall: float) -> None:
    """In exact arithmetic, however thin the wall is."""
    inner = outer * (1 - wall)
    beam = Beam.tube(
        1.0, outer_diameter=outer, inner_diameter=inner, youngs_modulus=1.0, density=1.0
    )
    D, d = Fraction(outer), Fraction(inner)
    np.testing.assert_allclose(beam.mass_per_length, np.pi / 4 * float(D**2 - d**2), rtol=1e-14)
    np.testing.assert_allclose(beam.bending_stiffness, np.pi / 64 * float(D**4 - d**4), rtol=1e-14)


def test_a_hole_as_wide_as_the_tube_is_refused() -> None:
    with pytest.raises(InputError, match=r"beam.inner_diameter: the hole of 0.04 m leaves nothing"):
        Beam.tube(
            1.0, outer_diameter=0.04, inner_diameter=0.04, youngs_modulus=7e10, density=2700.0
        )
