"""Reductions: what is kept is exact, what is lost is bounded, and coordinates do not matter."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from reductions import arm_with, flexible_error, response, without
from scipy.linalg import solve_continuous_lyapunov
from strategies import arms, deterministic

from slewctl import (
    Arm,
    KelvinVoigt,
    truth,
)
from slewctl.loop import peak_gain
from slewctl.plant import balanced_truncation, modal_truncation, state_space
from slewctl.plant.separation import separate


@deterministic(40)
@given(
    arm=arms(),
    ratio=st.sampled_from([1e-4, 1e-3, 0.02, 0.3]),
    order=st.integers(2, 13),
    output=st.sampled_from(["theta", "tip", "theta_dot", "tip_acceleration"]),
)
def test_balanced_error_is_between_its_bounds(
    arm: Arm, ratio: float, order: int, output: str
) -> None:
    """σ_k+1 <= ‖G − Gr‖∞ <= 2 Σ σ, with the norm from level sets in the loop room."""
    system = state_space(truth(replace(arm, damping_ratio=ratio), 8), [output], coordinates="modal")
    reduced = balanced_truncation(system, order)
    peak = peak_gain(flexible_error(system, reduced, 8)).value
    assert reduced.hankel[order - 2] * (1 - 1e-6) <= peak <= reduced.bound * (1 + 1e-6)
    assert reduced.error <= peak * (1 + 1e-6)
    assert_allclose(reduced.bound, 2 * reduced.hankel[order - 2 :].sum(), rtol=1e-14)


@pytest.mark.parametrize("correction", [False, True])
@pytest.mark.parametrize("output", ["theta", "tip", "theta_dot", "tip_acceleration"])
@pytest.mark.parametrize("ratio", [1e-4, 0.02])
def test_modal_error_is_below_its_bound(output: str, correction: bool, ratio: float) -> None:
    system = state_space(truth(arm_with(ratio), 10), [output], coordinates="modal")
    reduced = modal_truncation(system, 3, correction)
    peak = peak_gain(flexible_error(system, reduced, 10)).value
    assert reduced.error <= peak * (1 + 1e-7)
    # Nehari: no constant beside a system brings its norm below its largest Hankel value.
    assert reduced.hankel[0] * (1 - 1e-7) <= peak <= reduced.bound * (1 + 1e-7)


@pytest.mark.parametrize("ratio", [1e-6, 1e-4, 0.05, 0.7])
def test_hankel_values_of_one_mode_in_closed_form(ratio: float) -> None:
    """k/(s² + as + ω²): σ₁σ₂ = k²/(2aω)² and σ₁ − σ₂ = k/(2ω²)."""
    k, omega = 3.0, 5.0
    a = 2 * ratio * omega
    system = control.StateSpace([[0, 1], [-(omega**2), -a]], [[0], [1]], [[k, 0]], 0)
    hankel = balanced_truncation(system, 1).hankel
    assert_allclose(hankel.prod(), (k / (2 * a * omega)) ** 2, rtol=1e-9)
    assert_allclose(hankel[0] - hankel[1], k / (2 * omega**2), rtol=1e-9 / ratio)


def test_hankel_values_agree_with_lyapunov_equations() -> None:
    """Another way to them: √eig(PW) with scipy's Gramians of the flexible states."""
    system = state_space(truth(arm_with(0.02), 6), ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 7])
    P = solve_continuous_lyapunov(flexible.A, -flexible.B @ flexible.B.T)
    W = solve_continuous_lyapunov(flexible.A.T, -flexible.C.T @ flexible.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    assert_allclose(balanced_truncation(system, 4).hankel[:8], expected[:8], rtol=1e-7)


@pytest.mark.parametrize("friction", [0.0, 1e-6, 0.05, 2.0])
@pytest.mark.parametrize("coordinates", ["modal", "physical"])
def test_rigid_body_is_kept_exactly(friction: float, coordinates: str) -> None:
    """Its poles, and the reduction's agreement with the arm where only they matter."""
    model = truth(arm_with(0.005, friction), 10)
    system = state_space(model, ["theta", "tip"], coordinates=coordinates)
    reduced = balanced_truncation(system, 2).system
    assert_array_equal(reduced.A[:, 0], [0, 0])
    assert reduced.A[0, 1] == 1
    slow = reduced.A[1, 1]
    if friction == 0:
        assert slow == 0
    else:
        poles = np.linalg.eigvals(state_space(model, "theta", coordinates="modal").A)
        assert_allclose(slow, poles[np.abs(poles - slow).argmin()].real, rtol=1e-9, atol=1e-13)
        # A weak friction damps the free rotation at c/J.
        if friction < 1e-3:
            assert_allclose(-slow, friction / model.mass[0, 0], rtol=1e-4)
    low = 1e-5
    assert_allclose(response(reduced, low), response(system, low), rtol=1e-5)


@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_coordinates_do_not_matter(friction: float) -> None:
    model = truth(arm_with(1e-4, friction), 10)
    found = [
        balanced_truncation(state_space(model, ["theta", "tip"], coordinates=c), 8)
        for c in ("modal", "physical")
    ]
    assert_allclose(found[0].hankel[:12], found[1].hankel[:12], rtol=1e-8)
    for omega in (0.7, 20.0, 300.0):
        assert_allclose(
            response(found[0].system, omega), response(found[1].system, omega), rtol=1e-7
        )


@deterministic(30)
@given(arm=arms(damping=True))
def test_parts_add_up_to_the_system(arm: Arm) -> None:
    model = truth(arm, 6)
    system = state_space(model, ["theta", "tip"], coordinates="modal")
    parts = separate(system)
    assert len(parts.rigid.A) + len(parts.poles) == system.nstates
    for omega in (0.31, 3.3, 33.0):
        s = 1j * omega
        rigid = parts.rigid.C @ np.linalg.solve(s * np.eye(2) - parts.rigid.A, parts.rigid.B)
        whole = response(system, omega)
        assert_allclose(rigid + parts.response(s), whole, atol=1e-9 * np.abs(whole).max())


def test_overdamped_modes_are_found_in_pairs() -> None:
    """Kelvin–Voigt: λ₁λ₂ = ω² of each mode, however its poles lie."""
    model = truth(replace(arm_with(0.0), damping=KelvinVoigt(0.1)), 8)
    ratios = 0.1 * model.omega / 2
    assert ratios[0] < 1 < ratios[1]
    system = state_space(model, ["tip"], coordinates="modal")
    assert_allclose(separate(system).frequencies, model.omega, rtol=1e-9)
    assert balanced_truncation(system, 6).bound > 0


def test_friction_beside_overdamped_modes() -> None:
    model = truth(replace(arm_with(0.0, 0.05), damping=KelvinVoigt(0.1)), 8)
    parts = separate(state_space(model, ["tip"], coordinates="modal"))
    assert [len(mode) for mode in parts.modes] == [2] * 8
    assert_allclose(parts.frequencies, model.omega, rtol=2e-2)


@pytest.mark.parametrize("outputs", [["theta", "tip"], ["tip_acceleration", "theta_dot"]])
def test_modal_truncation_is_the_truth_with_fewer_modes(outputs: list[str]) -> None:
    """An acceleration's D must lose the removed modes: that is the static correction."""
    arm = arm_with()
    large, small = (state_space(truth(arm, n), outputs, coordinates="modal") for n in (9, 3))
    accelerates = outputs[0] == "tip_acceleration"
    reduced = modal_truncation(large, 3, static_correction=accelerates).system
    assert reduced.input_labels == large.input_labels
    assert reduced.output_labels == large.output_labels
    for omega in (0.2, 13.0, 170.0):
        expected = response(small, omega)
        assert_allclose(response(reduced, omega), expected, atol=1e-8 * np.abs(expected).max())


def test_static_correction_is_exact_at_rest() -> None:
    system = state_space(truth(arm_with(), 9), ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 10])
    reduced = without(modal_truncation(system, 2).system, [0, 1])
    bare = without(modal_truncation(system, 2, False).system, [0, 1])
    assert_allclose(response(reduced, 0.0), response(flexible, 0.0), rtol=1e-9)
    assert np.abs(response(bare, 0.0) - response(flexible, 0.0)).max() > 1e-7
    assert_array_equal(bare.D, 0)


def test_full_order_gives_the_system_back() -> None:
    system = state_space(truth(arm_with(0.01), 4), ["theta", "tip"], coordinates="modal")
    for reduced in (balanced_truncation(system, 10), modal_truncation(system, 4)):
        assert reduced.bound == 0
        for omega in (0.5, 20.0):
            assert_allclose(response(reduced.system, omega), response(system, omega), rtol=1e-8)
