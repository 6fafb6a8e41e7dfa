"""Hidden modes by the Popov–Belevitch–Hautus test, and the threshold of stability."""

from __future__ import annotations

import numpy as np
import pytest
from flexible_plants import arm_plant, oscillators
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import Arm, Beam, ClampedFree, Hub, assemble, state_space
from slewctl.linalg import stability_threshold
from slewctl.observability import unobservable_modes


def test_angle_sees_everything_and_the_torque_reaches_it() -> None:
    plant = arm_plant(20, 0.0)
    assert len(unobservable_modes(plant.A, plant.C2)) == 0
    assert len(unobservable_modes(plant.A.T, plant.B2.T)) == 0


@pytest.mark.parametrize("output", ["tip_deflection", "root_moment", "theta_dot"])
@pytest.mark.parametrize("zeta", [0.0, 0.01])
def test_rigid_body_is_hidden(output: str, zeta: float) -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3), damping_ratio=zeta)
    system = state_space(assemble(arm, ClampedFree(4)), [output], coordinates="modal")
    hidden = unobservable_modes(np.asarray(system.A), np.asarray(system.C))
    assert len(hidden) >= 1
    assert np.all(hidden == 0)  # the rigid-body block is exactly a double integrator


@given(st.integers(2, 12), st.integers(0, 11), st.integers(0, 1000))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_hidden_undamped_oscillator_is_found(n: int, which: int, seed: int) -> None:
    which %= n
    omega = np.sort(10 ** np.random.default_rng(seed).uniform(0, 2, n)) + np.arange(n)
    A, _, C = oscillators(omega, np.zeros(n), np.ones(n), np.ones(n))
    assert len(unobservable_modes(A, C)) == 0
    C[0, which] = 0.0
    np.testing.assert_allclose(unobservable_modes(A, C), [1j * omega[which]], rtol=1e-10)


def test_hidden_damped_oscillator_is_detectable() -> None:
    omega = np.array([1.0, 5.0])
    A, _, C = oscillators(omega, np.array([0.0, 0.01]), np.ones(2), np.array([1.0, 0.0]))
    assert len(unobservable_modes(A, C)) == 0


def test_hidden_unstable_mode_is_found() -> None:
    A, C = np.diag([0.5, -1.0]), np.array([[0.0, 1.0]])
    np.testing.assert_allclose(unobservable_modes(A, C), [0.5])


def test_a_zero_output_hides_every_undamped_mode() -> None:
    A, _, C = oscillators(np.array([1.0, 5.0]), np.zeros(2), np.ones(2), np.zeros(2))
    np.testing.assert_allclose(np.sort(unobservable_modes(A, C).imag), [1.0, 5.0])


@given(st.integers(1, 40), st.floats(-3, 3))
@settings(deadline=None, max_examples=30, derandomize=True)
def test_undamped_poles_are_never_called_stable(n: int, decade: float) -> None:
    omega = 10**decade * np.arange(1, n + 1) ** 2.0
    A, _, _ = oscillators(omega, np.zeros(n), np.ones(n), np.ones(n))
    assert np.linalg.eigvals(A).real.max() >= -stability_threshold(A)


@given(st.integers(1, 40), st.floats(-3, 3), st.floats(1e-4, 0.02))
@settings(deadline=None, max_examples=30, derandomize=True)
def test_lightly_damped_poles_are_called_stable(n: int, decade: float, zeta: float) -> None:
    omega = 10**decade * np.arange(1, n + 1) ** 2.0
    A, _, _ = oscillators(omega, np.full(n, zeta), np.ones(n), np.ones(n))
    assert np.linalg.eigvals(A).real.max() < -stability_threshold(A)


def test_threshold_follows_the_time_unit_and_not_the_state_units() -> None:
    A, _, _ = oscillators(np.array([1.0, 30.0]), np.full(2, 0.01), np.ones(2), np.ones(2))
    units = 2.0 ** np.array([10, -7, 3, 0])
    # Balancing is unique but for the radix: a factor 2.
    assert 0.5 <= stability_threshold(A / units[:, None] * units) / stability_threshold(A) <= 2
    assert stability_threshold(1024.0 * A) == pytest.approx(1024 * stability_threshold(A))
