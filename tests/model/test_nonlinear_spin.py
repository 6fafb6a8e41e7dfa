"""Frequencies at constant spin: what stiffens, what softens, and what diverges."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from strategies import arms, deterministic

from slewctl import Arm, Beam, ClampedFree, Hub, InputError, Payload, Polynomial, Slewing, assemble
from slewctl.model.locked import ritz_frequencies_hz
from slewctl.model.nonlinear import large_slew
from slewctl.model.spin import SpinSofteningWarning, critical_spin_rad_s, spin_frequencies_hz

EPS = np.finfo(float).eps
KINDS = st.sampled_from([ClampedFree, Slewing, Polynomial])


def squared(arm: Arm, n: int, spin: float, plane: str) -> np.ndarray:
    """ω² in rad²/s² with stiffening."""
    return (2 * np.pi * spin_frequencies_hz(assemble(arm, Polynomial(n)), spin, plane)) ** 2


@given(arms(), KINDS, st.integers(1, 8), st.floats(0.0, 30.0))
@deterministic(40)
def test_both_planes_equal_the_dense_eigenvalues(arm: Arm, kind: type, n: int, spin: float) -> None:
    """Against eigh of the matrices that the definition names, whatever the payload."""
    model = assemble(arm, kind(n))
    equations = large_slew(model)
    M, K = model.mass[1:, 1:], model.stiffness[1:, 1:]
    cases = {
        "in": K - spin**2 * equations.softening,
        "out": K + spin**2 * equations.geometric_stiffness,
    }
    for plane, stiffness in cases.items():
        expected = eigh(stiffness, M, eigvals_only=True)
        found = (2 * np.pi * spin_frequencies_hz(model, spin, plane)) ** 2
        # eigh's error is absolute: ε times the largest eigenvalue and the condition of M.
        allowed = 100 * EPS * expected[-1] * np.linalg.cond(M)
        assert_allclose(found, expected, rtol=1e-9, atol=allowed)


@given(arms(), st.floats(0.0, 30.0))
@deterministic(40)
def test_in_plane_is_flap_less_the_spin_without_rotary_inertia(arm: Arm, spin: float) -> None:
    point = replace(arm, payload=Payload(arm.payload.mass))
    flap = squared(point, 6, spin, "out")
    # The square root and the square lose two roundings of ω².
    assert_allclose(squared(point, 6, spin, "in"), flap - spin**2, rtol=0, atol=8 * EPS * flap[-1])


@given(arms(), st.floats(0.1, 30.0))
@deterministic(40)
def test_tension_keeps_every_arm_stable_in_the_plane(arm: Arm, spin: float) -> None:
    """Flapping is faster than Ω: the centrifugal pull outweighs the softening."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", SpinSofteningWarning)
        in_plane = squared(arm, 6, spin, "in")
    assert np.all(in_plane > 0)
    assert np.all(squared(arm, 6, spin, "out") > spin**2 * (1 - 1e-12) * (arm.payload.inertia == 0))


@given(arms(), st.floats(0.0, 30.0), st.sampled_from(["in", "out"]))
@deterministic(25)
def test_frequencies_fall_as_functions_are_added(arm: Arm, spin: float, plane: str) -> None:
    """Rayleigh–Ritz on nested spaces: convergence from above."""
    edges = arm.beam.breakpoints
    before = spin_frequencies_hz(assemble(arm, Polynomial(4, edges)), spin, plane)
    for n in (6, 9, 14):
        after = spin_frequencies_hz(assemble(arm, Polynomial(n, edges)), spin, plane)
        rounding = 1e-9 * before + 1e-13 * after[-1]
        assert np.all(after[: len(before)] <= before + rounding)
        before = after


def test_spinning_beam_converges_to_ten_digits() -> None:
    arm = Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5)), Hub(0.1, 0.2), Payload(0.5, 0.01))
    for plane in ("in", "out"):
        coarse = spin_frequencies_hz(assemble(arm, Polynomial(14)), 5.0, plane)[:3]
        fine = spin_frequencies_hz(assemble(arm, Polynomial(20)), 5.0, plane)[:3]
        assert_allclose(coarse, fine, rtol=1e-10)


@given(arms(), KINDS, st.integers(1, 8))
@deterministic(25)
def test_at_rest_both_planes_are_the_hub_locked_frequencies(arm: Arm, kind: type, n: int) -> None:
    model = assemble(arm, kind(n))
    locked = ritz_frequencies_hz(arm, kind(n), "hub-locked")
    for plane in ("in", "out"):
        for stiffening in (True, False):
            found = spin_frequencies_hz(model, 0.0, plane, stiffening)
            # The rotary inertia's zero contribution goes through eigvalsh.
            assert_allclose(found, locked, rtol=1e-9, atol=1e-13 * locked[-1])


@given(arms())
@deterministic(25)
def test_without_stiffening_the_arm_diverges_above_the_critical_spin(arm: Arm) -> None:
    model = assemble(arm, Polynomial(6))
    critical = critical_spin_rad_s(model)
    below = spin_frequencies_hz(model, 0.999 * critical, stiffening=False)
    assert np.all(below > 0)
    with pytest.warns(SpinSofteningWarning, match="stiffening=True"):
        above = spin_frequencies_hz(model, 1.001 * critical, stiffening=False)
    assert np.isnan(above[0])
    assert np.all(above[1:] > 0)
    assert large_slew(model, stiffening=False).critical_spin_rad_s == critical
    assert large_slew(model).critical_spin_rad_s == np.inf


def test_critical_spin_is_the_lowest_hub_locked_frequency_of_a_point_payload() -> None:
    beam = Beam(1.3, (2.0, -0.9), (40.0, 0.0, -25.0))
    point = assemble(Arm(beam, Hub(0.7, 0.12), Payload(0.4)), Polynomial(8))
    locked = 2 * np.pi * spin_frequencies_hz(point, 0.0)[0]
    assert critical_spin_rad_s(point) == pytest.approx(locked, rel=1e-12)
    # Rotary inertia lowers the frequency, not the stiffness that the spin has to overcome.
    body = assemble(Arm(beam, Hub(0.7, 0.12), Payload(0.4, 0.05)), Polynomial(8))
    assert critical_spin_rad_s(body) == pytest.approx(critical_spin_rad_s(point), rel=1e-12)
    assert 2 * np.pi * spin_frequencies_hz(body, 0.0)[0] < 0.999 * locked


def test_direction_of_the_spin_does_not_matter(full_arm: Arm) -> None:
    model = assemble(full_arm, Slewing(4))
    for plane in ("in", "out"):
        forth, back = (spin_frequencies_hz(model, spin, plane) for spin in (3.0, -3.0))
        assert_allclose(forth, back, rtol=1e-13)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": "arm"}, "spin_frequencies_hz: 'arm' is not a model; give one, as from assemble"),
        ({"spin_rad_s": np.nan}, "spin_rad_s: nan is not a finite number; give a number"),
        ({"plane": "inn"}, "plane: unknown name 'inn'; did you mean 'in'"),
    ],
)
def test_spin_refuses_nonsense(full_arm: Arm, change: dict, message: str) -> None:
    arguments = {"model": assemble(full_arm, Slewing(2)), "spin_rad_s": 1.0, **change}
    with pytest.raises(InputError, match=message):
        spin_frequencies_hz(**arguments)
