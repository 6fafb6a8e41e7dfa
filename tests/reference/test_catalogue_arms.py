"""Published frequencies of the catalogue's arms against their converged models."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from slewctl import Arm, Beam, Hub, Polynomial, arms, assemble, modal_data
from slewctl.arm.catalogue import Published
from slewctl.model.locked import frequencies


def computed(arm: Arm, published: Published) -> tuple[np.ndarray, np.ndarray]:
    """Printed and converged frequencies in Hz of the published modes."""
    modes, hz = zip(*published.frequencies_hz, strict=True)
    found = frequencies(arm, max(modes), published.boundary)
    assert found.relative_errors.max() < 1e-10
    return np.array(hz), found.hz[np.array(modes) - 1]


CASES = [
    pytest.param(name, published, id=f"{name}-{published.boundary}")
    for name, entry in arms.CATALOGUE.items()
    for published in entry.published
]


@pytest.mark.parametrize(("name", "published"), CASES)
def test_stated_agreement_is_true_and_not_generous(name: str, published: Published) -> None:
    printed, found = computed(arms.get(name), published)
    worst = np.abs(found / printed - 1).max()
    assert 0.6 * published.agreement < worst < published.agreement


def test_the_satellites_sheet_is_that_of_its_wings() -> None:
    """Two uniform wings of 8 m and 40 kg on a bus of 900 kg·m², as their modes tell of them."""
    stiffness = 10.0 * (2 * np.pi * 0.25 * 8**2 / 3.516015) ** 2
    whole = modal_data(Arm(Beam(8.0, 10.0, stiffness), Hub(900.0, 1.0)), 3)
    told, made = arms.get("two-wing-satellite").beam, whole.beam
    assert_allclose(told.inertia, made.inertia + 900.0, rtol=5e-4)
    assert_allclose(told.frequencies_hz, made.frequencies_hz, rtol=5e-4)
    assert_allclose(told.coupling, np.abs(made.coupling), rtol=5e-4)
    signs = np.sign(made.coupling)
    for one, other in zip(told.places, made.places, strict=True):
        for key in ("shapes", "moments"):
            if getattr(one, key) is not None:
                assert_allclose(getattr(one, key), signs * getattr(other, key), rtol=2e-3)


def test_paper_beam_lies_below_the_papers_upper_bounds() -> None:
    """Tables 2 and 3, five slewing functions: 2.927301 and 8.760392 Hz are Ritz values."""
    (published,) = arms.CATALOGUE["paper-beam"].published
    printed, found = computed(arms.get("paper-beam"), published)
    assert np.all(found < printed)


def test_quanser_link_lies_below_both_measured_dips() -> None:
    """4.12 and about 26 Hz measured; 4.029 and 25.25 Hz here; the vendor's model has 3 Hz."""
    (published,) = arms.CATALOGUE["quanser-flexible-link"].published
    printed, found = computed(arms.get("quanser-flexible-link"), published)
    assert_allclose(found, [4.029, 25.252], rtol=0, atol=0.5e-3)
    assert_allclose(found / printed - 1, [-0.022, -0.029], rtol=0, atol=0.5e-3)


def test_sheffield_manipulator_to_the_printed_whole_hertz() -> None:
    """13, 35 and 65 Hz: data and frequencies of one paper confirm each other."""
    (published,) = arms.CATALOGUE["sheffield-manipulator"].published
    printed, found = computed(arms.get("sheffield-manipulator"), published)
    assert_allclose(np.round(found), printed, rtol=0, atol=0)


def test_nrel_edgewise_mode_is_between_the_rotors_two_asymmetric_ones() -> None:
    """Report, table 9-1 (FAST): 1.0793 Hz with pitch, 1.0898 Hz with yaw of the nacelle.

    The isolated blade without pre-twist has 1.0900 Hz, a fixed nacelle's value.
    """
    found = frequencies(arms.get("nrel-5mw-rotor"), 1).hz[0]
    assert found == pytest.approx(1.0900, abs=0.5e-4)
    assert found == pytest.approx(1.0898, rel=3e-4)


def test_spacecraft_frequencies_lie_above_the_hub_locked_ones() -> None:
    """No published figure: 1.2584, 8.3955 and 24.909 Hz free, 0.6959 Hz with the hub held."""
    arm = arms.get("flexible-spacecraft")
    free, held = frequencies(arm, 3, "free").hz, frequencies(arm, 4, "hub-locked").hz
    assert_allclose(free, [1.2584, 8.3955, 24.909], rtol=5e-5)
    assert held[0] == pytest.approx(0.6959, abs=0.5e-4)
    # A free hub adds one degree of freedom: the two sets interlace.
    assert np.all(held[:3] < free)
    assert np.all(free < held[1:])


@pytest.mark.parametrize(("name", "appendages"), [("flexible-spacecraft", 4), ("wright-beam", 3)])
def test_one_appendage_with_its_share_of_the_hub_is_the_whole_star(
    name: str, appendages: int
) -> None:
    """Hub with N equal appendages, assembled in full: its modes are those of one appendage
    with 1/N of the hub, once, and the hub-locked ones, N − 1 times."""
    arm = arms.get(name)
    one = assemble(arm, Polynomial(12))
    n = one.n
    M, K = np.zeros((2, 1 + appendages * n, 1 + appendages * n))
    for k in range(appendages):
        block = np.r_[0, 1 + k * n : 1 + (k + 1) * n]
        M[np.ix_(block, block)] += one.mass
        K[np.ix_(block, block)] += one.stiffness
    star = np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))
    held = np.sqrt(eigh(one.stiffness[1:, 1:], one.mass[1:, 1:], eigvals_only=True))
    expected = np.sort(np.concatenate([one.omega, *[held] * (appendages - 1)]))[:8]
    # Squared frequencies carry rounding of the largest, about ε ω_max².
    assert_allclose(star[1:9] ** 2, expected**2, rtol=1e-7, atol=1e-12 * star[-1] ** 2)
