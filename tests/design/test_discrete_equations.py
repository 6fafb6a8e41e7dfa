"""The discrete Riccati and Lyapunov equations against scipy and against themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.linalg import solve_discrete_lyapunov as scipy_lyapunov
from strategies import deterministic

import slewctl as sc
from slewctl import AccuracyError
from slewctl.design.riccati.lqg import least_cost
from slewctl.numerics.discrete_equations import (
    _from_gain,
    solve_discrete_lyapunov,
    solve_discrete_riccati,
)

Array = NDArray[np.float64]


def random_problem(seed: int, n: int = 5, m: int = 2) -> tuple[Array, ...]:
    """A, B, Q, R, S with A somewhat unstable and the whole cost positive definite."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.3, 1.5) / np.abs(np.linalg.eigvals(A)).max()
    L = rng.standard_normal((n + m, n + m))
    cost = L @ L.T + 1e-2 * np.eye(n + m)
    return A, rng.standard_normal((n, m)), cost[:n, :n], cost[n:, n:], cost[:n, n:]


@given(st.integers(0, 10_000))
@deterministic(20)
def test_riccati_is_that_of_scipy(seed: int) -> None:
    A, B, Q, R, S = random_problem(seed)
    ours = solve_discrete_riccati(A, B, Q, R, S)
    theirs = solve_discrete_are(A, B, Q, R, s=S)
    assert np.linalg.norm(ours.X - theirs) < 1e-8 * np.linalg.norm(theirs)
    assert ours.residual < 1e-13
    assert np.abs(np.linalg.eigvals(A - B @ ours.gain)).max() < 1


@given(st.integers(0, 10_000), st.floats(-6, 6), st.floats(-6, 6))
@deterministic(15)
def test_riccati_does_not_depend_on_units(seed: int, states: float, price: float) -> None:
    """States in units of every size, and a cost in another currency."""
    A, B, Q, R, S = random_problem(seed)
    plain = solve_discrete_riccati(A, B, Q, R, S)
    t = 10.0 ** (states * np.linspace(-1, 1, len(A)))
    c = 10.0**price
    other = solve_discrete_riccati(
        A * t[:, None] / t, B * t[:, None], c * Q / np.outer(t, t), c * R, c * S / t[:, None]
    )
    np.testing.assert_allclose(
        other.gain * t, plain.gain, rtol=0, atol=1e-9 * np.abs(plain.gain).max()
    )
    assert other.residual < 1e-12


def test_integrator_sampled_fast_tends_to_the_continuous_gain() -> None:
    """ẋ = u, q = r = 1: the golden section for T = 1, and √(q/r) for T → 0."""
    one = np.eye(1)
    golden = (1 + np.sqrt(5)) / 2
    assert solve_discrete_riccati(one, one, one, one).X[0, 0] == pytest.approx(golden, rel=1e-14)
    for T in (1e-2, 1e-4, 1e-6):
        gain = solve_discrete_riccati(one, T * one, T * one, T * one).gain[0, 0]
        # k = 1 − T/2 + O(T²).
        assert gain == pytest.approx(1 - T / 2, abs=T**2 + 1e-9)


@given(st.integers(0, 10_000), st.floats(0.0, 0.999))
@deterministic(15)
def test_lyapunov_is_that_of_scipy(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    A, L = rng.standard_normal((2, 6, 6))
    A *= radius / np.abs(np.linalg.eigvals(A)).max()
    ours = solve_discrete_lyapunov(A, L @ L.T)
    theirs = scipy_lyapunov(A, L @ L.T, method="direct")
    assert np.linalg.norm(ours - theirs) < 1e-9 * np.linalg.norm(theirs)
    assert np.linalg.eigvalsh(ours)[0] > -1e-14 * np.linalg.norm(ours)


@pytest.mark.parametrize("loud", [1.0, 1e4, 1e9])
def test_a_quiet_state_beside_a_loud_one_is_summed_to_its_end(loud: float) -> None:
    slow = 1 - 1e-5
    A, B = np.diag([0.5, slow]), np.array([[loud, 0.0], [0.0, 1.0]])
    X = solve_discrete_lyapunov(A, B @ B.T)
    np.testing.assert_allclose(np.diag(X), [loud**2 / 0.75, 1 / (1 - slow**2)], rtol=1e-10)


def test_unstable_lyapunov_is_refused() -> None:
    for radius in (1.0, 1.5):
        with pytest.raises(AccuracyError, match="hardly decays"):
            solve_discrete_lyapunov(radius * np.eye(2), np.eye(2))


@pytest.mark.parametrize("hidden", ["input", "cost"])
def test_without_a_stabilising_solution_is_refused(hidden: str) -> None:
    """A mode on the unit circle that the input does not reach, or the cost does not see."""
    A = np.diag([1.0, 0.5])
    B = np.array([[0.0], [1.0]]) if hidden == "input" else np.ones((2, 1))
    Q = np.eye(2) if hidden == "input" else np.diag([0.0, 1.0])
    with pytest.raises(AccuracyError, match="no stabilising solution"):
        solve_discrete_riccati(A, B, Q, np.eye(1))


@pytest.mark.parametrize("modes", [5, 15])
def test_a_gain_of_fewer_modes_leads_to_the_sampled_optimum(modes: int) -> None:
    arm = sc.Arm(sc.Beam(1.0, 1.0, 1.0), sc.Hub(0.3), damping_ratio=0.01)
    objective = sc.Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    few, many = (sc.generalised_plant(sc.truth(arm, n), objective) for n in (modes - 1, modes))
    below = least_cost(few, 0.02, 0.03)
    near = below.near(many.exact.linear.state_labels)
    assert near[0] is not None
    assert near[0].shape[1] == len(many.A) + 1  # an input on its way
    found, plain = least_cost(many, 0.02, 0.03, below), least_cost(many, 0.02, 0.03)
    exact = sc.lqg(many, sample_time=0.02, delay=0.03).h2_cost
    assert found.value == pytest.approx(exact, rel=1e-7)
    assert plain.value == pytest.approx(exact, rel=1e-7)
    # Kleinman: the cost of a gain, never less than that of the best.
    assert found.value >= exact * (1 - 1e-11)


def test_sampled_gains_that_lead_nowhere_are_told() -> None:
    A, B, Q = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[0.5], [1.0]]), np.eye(2)
    none = np.zeros((2, 1))
    assert _from_gain(A, B, Q, none, np.zeros((1, 2))) is None  # the integrators are not held
    exact = solve_discrete_riccati(A, B, Q, np.eye(1))
    assert _from_gain(A, B, Q, none, exact.gain * 0.5) is None  # it is far from the best
    found = _from_gain(A, B, Q, none, exact.gain * (1 + 1e-3))
    assert found is not None
    np.testing.assert_allclose(found[0], exact.X, rtol=1e-7)
    np.testing.assert_allclose(found[1], exact.gain, rtol=1e-7)
