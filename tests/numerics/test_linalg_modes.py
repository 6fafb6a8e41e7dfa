"""Hidden modes by the Popov–Belevitch–Hautus test, and the threshold of stability."""

from __future__ import annotations

import numpy as np
import pytest
from flexible_plants import arm_plant, oscillators
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import Arm, Beam, ClampedFree, Hub, assemble, state_space
from slewctl.numerics.matrix_equations import stability_threshold
from slewctl.numerics.observability import pole_rounding, unobservable_modes


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


@given(st.integers(2, 6), st.integers(0, 1000), st.booleans())
@settings(deadline=None, max_examples=40, derandomize=True)
def test_dense_coordinates_hide_no_hidden_rigid_body(n: int, seed: int, seen: bool) -> None:
    """A double integrator of which only the rate is seen, in a rotated mixture of all states."""
    rng = np.random.default_rng(seed)
    omega = np.sort(10 ** rng.uniform(0, 3, n))
    A = np.zeros((2 * n + 2, 2 * n + 2))
    A[0, 1] = 1
    for i, w in enumerate(omega):
        A[2 * i + 2 : 2 * i + 4, 2 * i + 2 : 2 * i + 4] = [[0, 1], [-(w**2), -2e-3 * w]]
    C = rng.normal(size=(1, len(A)))
    C[0, 0] = float(seen)
    T = np.linalg.qr(rng.normal(size=A.shape))[0] * 10 ** rng.uniform(-1, 1, len(A))
    back = np.linalg.inv(T)
    assert (len(unobservable_modes(T @ A @ back, C @ back)) > 0) != seen


@given(st.integers(0, 1000), st.floats(0, 12), st.booleans())
@settings(deadline=None, max_examples=40, derandomize=True)
def test_units_and_a_fast_lag_hide_nothing(seed: int, decades: float, hidden: bool) -> None:
    """An integrator seen through a lag that is any number of decades faster."""
    rng = np.random.default_rng(seed)
    fast = 10.0**decades
    A = np.array([[0.0, 0, 0], [fast * (not hidden), -fast, 0], [0, 0, -1.0]])
    C = np.array([[0.0, 1, 1]])
    units = 2.0 ** rng.integers(-30, 30, 3)
    found = unobservable_modes(A / units[:, None] * units, 2.0 ** rng.integers(-40, 40) * C * units)
    assert len(found) == hidden


def test_only_the_edge_of_stability_counts_where_asked() -> None:
    A, C = np.diag([0.5, 0.0, -1.0]), np.array([[0.0, 0, 1.0]])
    np.testing.assert_allclose(np.sort(unobservable_modes(A, C).real), [0, 0.5])
    np.testing.assert_allclose(unobservable_modes(A, C, only_on_the_edge=True), [0])
    z = np.diag([1.5, 1.0, 0.5])
    np.testing.assert_allclose(np.sort(unobservable_modes(z, C, sampled=True).real), [1, 1.5])
    found = unobservable_modes(z, C, sampled=True, only_on_the_edge=True)
    np.testing.assert_allclose(found, [1])


@given(st.integers(0, 1000), st.floats(0, 10))
@settings(deadline=None, max_examples=30, derandomize=True)
def test_rounding_of_a_slow_pole_is_its_own(seed: int, decades: float) -> None:
    """Beside a pole ten decades faster a slow one is still known to its own digits."""
    rng = np.random.default_rng(seed)
    slow, fast = -rng.uniform(0.5, 2), -(10.0**decades) * 3
    A = np.array([[slow, 1.0], [0.0, fast]])
    poles, rounding = pole_rounding(A)
    i = int(np.argmin(np.abs(poles)))
    assert abs(poles[i] - slow) <= rounding[i] <= 1e-13
