"""Published figures of beams, to their printed digits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from slewctl import Arm, Beam, ClampedFree, Payload, Polynomial, assemble
from slewctl.basis.characteristic import clamped_free_roots, slewing_roots


def hub_locked(arm: Arm, count: int) -> np.ndarray:
    """Frequencies in rad/s of the beam clamped to a hub that does not turn.

    Deleting the row and column of θ locks the hub.
    """
    model = assemble(arm, Polynomial(count + 12))
    K, M = model.stiffness[1:, 1:], model.mass[1:, 1:]
    return np.sqrt(eigh(K, M, eigvals_only=True)[:count])


def uniform(payload: Payload | None = None) -> Arm:
    return Arm(Beam(1.0, 1.0, 1.0), payload=payload or Payload())


def test_table_1_of_the_paper() -> None:
    """Roots βL of the uniform beam, clamped-free and pinned-free, i = 1 … 5.

    "New admissible functions for the dynamic analysis of a slewing flexible beam", table 1.
    Its last row is misprinted: the asymptotes are (2i − 1)π/2 and (4i + 1)π/4.
    """
    clamped_free = [1.87510407, 4.69409113, 7.85475744, 10.99554073, 14.13716839]
    pinned_free = [3.92660231, 7.06858275, 10.21017612, 13.35176878, 16.49336143]
    assert_allclose(clamped_free_roots(5).z, clamped_free, rtol=0, atol=0.5e-8)
    assert_allclose(slewing_roots(5).z, pinned_free, rtol=0, atol=0.5e-8)
    # From the sixth on the asymptotes hold to e^(−βL).
    i = np.arange(6, 20)
    assert np.all(np.abs(clamped_free_roots(19).z[5:] - (2 * i - 1) * np.pi / 2) < 1e-7)
    assert np.all(np.abs(slewing_roots(19).z[5:] - (4 * i + 1) * np.pi / 4) < 1e-14 * i)


def test_uniform_cantilever_of_wright_et_al() -> None:
    """Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982); Bir, AIAA 2009-1035, table 3a.

    L = 31.623 m, m̄ = 100 kg/m, EI = 1e8 N·m² at rest: 3.516, 22.035, 61.697 rad/s.
    With this rounded L the unit √(EI/m̄L⁴) is 1 − 1.3e-5 rad/s; the printed figures are
    rounded up, which leaves one unit in the last place.
    """
    arm = Arm(Beam(31.623, 100.0, 1e8))
    assert_allclose(hub_locked(arm, 3), [3.516, 22.035, 61.697], rtol=0, atol=1e-3)


def test_cantilever_with_tip_mass_of_wright_et_al() -> None:
    """The same beam with a tip mass equal to its own, at rest: 1.557 rad/s (same table)."""
    arm = Arm(Beam(31.623, 100.0, 1e8), payload=Payload(mass=3162.3))
    assert_allclose(hub_locked(arm, 1), [1.557], rtol=0, atol=0.5e-3)


def test_tapered_cantilever_of_hodges_and_pierce() -> None:
    """m̄ and EI both ∝ 1 − x/(2L): 4.31517, 23.5193, 63.1992.

    Hodges & Pierce, Introduction to Structural Dynamics and Aeroelasticity, table 3.14.
    """
    arm = Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5)))
    computed = hub_locked(arm, 3)
    assert_allclose(computed, [4.31517, 23.5193, 63.1992], rtol=0, atol=0.5e-5 * 10)
    assert computed[0] == pytest.approx(4.31517, abs=0.5e-5)


def test_cantilever_with_equal_tip_mass() -> None:
    """βL = 1.2479174, 4.0311394, 7.1341322 for a tip mass equal to the beam's.

    Blevins, Formulas for Natural Frequency and Mode Shape (roots of the textbook equation
    1 + cos λ cosh λ + λ (cos λ sinh λ − sin λ cosh λ) = 0).
    """
    computed = np.sqrt(hub_locked(uniform(Payload(mass=1.0)), 3))
    assert_allclose(computed, [1.2479174, 4.0311394, 7.1341322], rtol=0, atol=0.5e-7)


GOODWIN = np.array([18.95, 118.76, 332.54, 651.66, 1077.2, 1609.2])
GOODWIN_UNITS = np.array([0.01, 0.01, 0.01, 0.01, 0.1, 0.1])


def test_piezo_beam_of_goodwin_has_clamped_free_ratios() -> None:
    """18.95, 118.76, 332.54, 651.66, 1077.2, 1609.2 rad/s (Goodwin's piezoelectric beam).

    One unknown factor √(EI/m̄L⁴) must carry the computed ratios into every printed interval.
    """
    computed = hub_locked(uniform(), 6)
    low = ((GOODWIN - GOODWIN_UNITS / 2) / computed).max()
    high = ((GOODWIN + GOODWIN_UNITS / 2) / computed).min()
    assert low <= high


def test_clamped_free_functions_give_the_cantilever_exactly() -> None:
    """The basis functions are its modes, so M_e and K_e are diagonal with ω = z²."""
    model = assemble(uniform(), ClampedFree(6))
    K, M = model.stiffness[1:, 1:], model.mass[1:, 1:]
    omega = np.sqrt(eigh(K, M, eigvals_only=True))
    assert_allclose(omega, clamped_free_roots(6).z ** 2, rtol=1e-12)
