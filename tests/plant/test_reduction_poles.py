"""Reductions of hard cases: poles that coincide, states that do nothing, many light modes."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from reductions import arm_with, companion, response, without
from scipy.linalg import solve_continuous_lyapunov
from strategies import deterministic

from slewctl import (
    InputError,
    KelvinVoigt,
    truth,
)
from slewctl.plant import balanced_truncation, modal_truncation, state_space
from slewctl.plant.separation import separate


def test_states_that_nothing_reaches_do_not_count() -> None:
    A = np.diag([-1.0, -2.0, -3.0])
    system = control.ss(A, [[1.0], [1.0], [0.0]], [[1.0, 1.0, 1.0]], 0)
    assert balanced_truncation(system, 2).bound < 1e-15
    with pytest.raises(InputError, match="only 2 flexible states"):
        balanced_truncation(system, 3)


def test_forty_light_modes_keep_their_accuracy() -> None:
    """ζ = 1e-4, 40 modes: damping and Hankel values mode by mode as in closed form."""
    model = truth(arm_with(1e-4), 40)
    parts = separate(state_space(model, ["tip"], coordinates="modal"))
    damping = -parts.poles.real[::2] / np.abs(parts.poles[::2])
    assert_allclose(damping, 1e-4, rtol=1e-9)
    assert parts.residual < 1e-9
    tip = (model.displacement(np.ones(1)) @ model.mode_shapes)[0, 1:]
    gain = np.abs(model.mode_shapes[0, 1:] * tip) / (4e-4 * model.omega**2)
    # Far apart and lightly damped, each mode has its own pair of about |b c|/(4ζω²).
    hankel = balanced_truncation(state_space(model, ["tip"], coordinates="modal"), 4).hankel
    assert_allclose(hankel[::2], np.sort(gain)[::-1], rtol=2e-3)


def test_hankel_values_of_a_textbook_system_with_a_double_pole() -> None:
    """(8s² + 6s + 2)/(s³ + 4s² + 5s + 2): poles −1, −1 and −2."""
    reduced = balanced_truncation(companion([8.0, 6.0, 2.0], [-1, -1, -2]), 2)
    assert_allclose(reduced.hankel, [1.144118688, 0.725878969, 0.0817602814], rtol=2e-9)
    assert reduced.error <= reduced.bound * (1 + 1e-12)


def test_hankel_values_of_two_equal_lags() -> None:
    """1/(s + 1)²: the mode with ζ = 1 of `test_hankel_values_of_one_mode_in_closed_form`."""
    hankel = balanced_truncation(companion([1.0], [-1, -1]), 1).hankel
    assert_allclose(hankel, [(np.sqrt(2) + 1) / 4, (np.sqrt(2) - 1) / 4], rtol=1e-14)


@deterministic(40)
@given(
    spacing=st.floats(-16, -0.5).map(lambda e: 10.0**e),
    copies=st.integers(2, 6),
    pair=st.booleans(),
    seed=st.integers(0, 99),
)
def test_poles_that_nearly_coincide_are_reduced_in_any_coordinates(
    spacing: float, copies: int, pair: bool, seed: int
) -> None:
    """Against scipy's Gramians in companion form, and in coordinates turned at random."""
    rng = np.random.default_rng(seed)
    base: list[complex] = [complex(-1 - k * spacing) for k in range(copies)]
    if pair:
        base = [pole * turn for pole in base[: (copies + 1) // 2] for turn in (0.3 + 1j, 0.3 - 1j)]
    system = companion([1.0, 2.0], [*base, -4.0])
    P = solve_continuous_lyapunov(system.A, -system.B @ system.B.T)
    W = solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    turn = np.linalg.qr(rng.standard_normal((system.nstates, system.nstates)))[0]
    turned = control.StateSpace(turn @ system.A @ turn.T, turn @ system.B, system.C @ turn.T, 0)
    for given_system in (system, turned):
        reduced = balanced_truncation(given_system, 2)
        assert_allclose(reduced.hankel[:2], expected[:2], rtol=1e-7)
        assert reduced.error <= reduced.bound * (1 + 1e-7) + 1e-11
        for omega in (0.0, 0.9, 7.0):
            far = np.abs(response(given_system, omega) - response(reduced.system, omega)).max()
            assert far <= reduced.bound * (1 + 1e-7) + 1e-11


def test_an_arm_with_a_critically_damped_mode_is_reduced() -> None:
    """Kelvin–Voigt damping with ηω/2 = 1 for the second mode: a double pole at −ω."""
    bare = truth(arm_with(0.0), 6)
    model = truth(replace(arm_with(0.0), damping=KelvinVoigt(2 / bare.omega[1])), 6)
    system = state_space(model, ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 7])
    P = solve_continuous_lyapunov(flexible.A, -flexible.B @ flexible.B.T)
    W = solve_continuous_lyapunov(flexible.A.T, -flexible.C.T @ flexible.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    assert_allclose(balanced_truncation(system, 5).hankel[:4], expected[:4], rtol=1e-7)
    assert_allclose(separate(system).frequencies, bare.omega, rtol=1e-7)
    kept = modal_truncation(system, 2, static_correction=False)
    assert_allclose(np.abs(np.linalg.eigvals(kept.system.A[4:, 4:])), bare.omega[[1, 1]], rtol=1e-6)
    assert kept.error <= kept.bound * (1 + 1e-9)


def test_modes_of_coinciding_poles_are_kept_or_cut_together() -> None:
    pair = [-0.01 + 1j, -0.01 - 1j]
    system = companion([1.0, 2.0], [*pair, *pair, -3.0])
    reduced = modal_truncation(system, 1)
    assert [len(mode) for mode in separate(system).modes] == [4, 1]
    assert reduced.system.nstates == 4
    assert_allclose(response(reduced.system, 0.0), response(system, 0.0), rtol=1e-10)
    with pytest.raises(InputError, match="2 flexible modes"):
        modal_truncation(system, 3)
