"""Published frequencies of spinning beams, to their printed digits.

Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982), as in Bir, "Verification of
BModes", AIAA 2009-1035, table 3a: a uniform cantilever without hub radius, L = 31.623 m,
m̄ = 100 kg/m, EI = 1e8 N·m², flapping (out of the plane of rotation).
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import Arm, Beam, Payload, Polynomial, assemble
from slewctl.model import Model
from slewctl.model.spin import spin_frequencies_hz

# The printed 31.623 m is √1000 m rounded: √(EI/m̄L⁴) is then 1 rad/s, which the third
# frequencies show to their last digit.
LENGTH = 1000**0.5
BARE = [3.516, 3.682, 4.137, 4.797, 5.585, 6.450, 7.360, 8.300, 9.257, 10.226, 11.202, 12.184, 13.170]  # fmt: skip
TIP_MASS = [1.557, 1.902, 2.670, 3.582, 4.543, 5.522, 6.509, 7.501, 8.495, 9.490, 10.49, 11.48, 12.48]  # fmt: skip


HALF_UNIT = 0.501e-3
# Some of the figures are rounded up: 61.69721 to 61.697, but 79.61448 to 79.615.
UNIT = 1e-3


def model(length: float = LENGTH, tip_mass: float = 0.0) -> Model:
    """The beam with a payload of `tip_mass` beam masses, converged to ten digits."""
    payload = Payload(mass=tip_mass * 100.0 * length)
    return assemble(Arm(Beam(length, 100.0, 1e8), payload=payload), Polynomial(16))


def flap(beam: Model, spin: float) -> np.ndarray:
    return 2 * np.pi * spin_frequencies_hz(beam, spin, "out")


def in_plane(beam: Model, spin: float) -> np.ndarray:
    return 2 * np.pi * spin_frequencies_hz(beam, spin, "in")


def test_first_flap_frequency_of_wright_et_al() -> None:
    """Ω = 0 … 12 rad/s, to half a unit of the last digit."""
    beam = model()
    computed = [flap(beam, spin)[0] for spin in range(13)]
    assert_allclose(computed, BARE, rtol=0, atol=HALF_UNIT)


def test_higher_flap_frequencies_of_wright_et_al() -> None:
    """22.035 and 61.697 at rest, 37.603 and 79.615 at 12 rad/s."""
    beam = model()
    assert_allclose(flap(beam, 0.0)[1:3], [22.035, 61.697], rtol=0, atol=UNIT)
    assert_allclose(flap(beam, 12.0)[1:3], [37.603, 79.615], rtol=0, atol=UNIT)


def test_printed_length_changes_the_fifth_digit() -> None:
    """With 31.623 m the unit is 1 − 1.4e-5: two printed digits of 61.697 still hold."""
    unit = (1e8 / 100.0) ** 0.5 / 31.623**2
    assert flap(model(31.623), 0.0)[2] == pytest.approx(flap(model(), 0.0)[2] * unit, rel=1e-9)
    assert flap(model(31.623), 0.0)[2] == pytest.approx(61.697, abs=UNIT)


def test_flap_frequency_with_tip_mass_of_wright_et_al() -> None:
    """The same beam with a tip mass equal to its own; the last three have two decimals."""
    beam = model(tip_mass=1.0)
    computed = np.array([flap(beam, spin)[0] for spin in range(13)])
    assert_allclose(computed[:10], TIP_MASS[:10], rtol=0, atol=UNIT)
    assert_allclose(computed[10:], TIP_MASS[10:], rtol=0, atol=10 * HALF_UNIT)


@pytest.mark.parametrize("tip_mass", [0.0, 1.0])
def test_in_plane_frequencies_follow_from_the_published_ones(tip_mass: float) -> None:
    """In the plane of rotation ω² = ω_flap² − Ω²."""
    beam = model(tip_mass=tip_mass)
    printed = TIP_MASS if tip_mass else BARE
    for spin in range(13):
        expected = printed[spin] ** 2 - spin**2
        # The printed figure's rounding, carried through the square.
        unit = 10 * UNIT if tip_mass and spin >= 10 else UNIT
        allowed = 2 * printed[spin] * unit
        assert in_plane(beam, spin)[0] ** 2 == pytest.approx(expected, abs=allowed)
