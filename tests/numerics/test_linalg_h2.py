"""The H2 cost against closed forms, an integral over frequency, and under similarity."""

from __future__ import annotations

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from flexible_plants import Array, arm_plant, oscillators, random_rotation
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from slewctl import lqg
from slewctl.numerics.h2_norm import _modal_cost, cost_of_loop, h2_cost

RATIOS = st.floats(1e-4, 0.5)


def modal_h2(omega: Array, zeta: Array, weight: Array, rate: bool) -> float:
    """∫ y² dt of the impulse response of Σ weight_i/(s² + a_i s + ω_i²), or of its rate."""
    a, w2 = 2 * zeta * omega, omega**2
    total = a[:, None] + a
    mixed = np.outer(a, w2)
    mixed = mixed + mixed.T
    kernel = (mixed if rate else total) / ((w2[:, None] - w2) ** 2 + total * mixed)
    return float(weight @ kernel @ weight)


@given(st.floats(-3, 4), RATIOS)
@settings(deadline=None, max_examples=50, derandomize=True)
def test_single_oscillator(decade: float, zeta: float) -> None:
    omega = 10**decade
    A, B, C = oscillators(np.array([omega]), np.array([zeta]), np.ones(1), np.ones(1))
    cost = h2_cost(A, B, C)
    # ∫ e^(−2ζωt) sin²(ω_d t)/ω_d² dt = 1/(4ζω³); conditioned like 1/ζ = 1e4: 1e4·ε = 2e-12.
    assert cost.value == pytest.approx(1 / (4 * zeta * omega**3), rel=1e-11)
    assert cost.discrepancy < 1e-11


@given(st.integers(2, 15), st.integers(0, 10_000), st.booleans())
@settings(deadline=None, max_examples=30, derandomize=True)
def test_modal_sum(n: int, seed: int, rate: bool) -> None:
    rng = np.random.default_rng(seed)
    omega = np.sort(10 ** rng.uniform(0, 3, n))
    zeta = 10 ** rng.uniform(-4, -1, n)
    weight = rng.standard_normal(n) * omega
    A, B, C = oscillators(omega, zeta, np.ones(n), weight)
    C = np.roll(C, n) if rate else C
    cost = h2_cost(A, B, C)
    # A Lyapunov equation is conditioned like ‖A‖ over its slowest decay.
    tolerance = 10 * n * np.finfo(float).eps * omega.max() / (2 * zeta * omega).min()
    assert cost.value == pytest.approx(modal_h2(omega, zeta, weight, rate), rel=tolerance)
    assert cost.discrepancy < tolerance


def test_parseval() -> None:
    omega, zeta = np.array([1.0, 2.0, 7.0]), np.array([0.05, 0.1, 0.02])
    weight = np.array([1.0, -0.5, 2.0])
    A, B, C = oscillators(omega, zeta, np.ones(3), weight)

    def squared(w: float) -> float:
        return float(abs(np.sum(weight / (omega**2 - w**2 + 2j * zeta * omega * w))) ** 2)

    edges = [0.0, 0.9, 1.0, 1.1, 2.0, 6.8, 7.0, 7.2, 20.0, np.inf]
    pieces = [quad(squared, a, b, epsabs=0, epsrel=1e-11)[0] for a, b in pairwise(edges)]
    assert h2_cost(A, B, C).value == pytest.approx(sum(pieces) / np.pi, rel=1e-10)


@pytest.mark.parametrize("modes", [1, 5, 20])
def test_scaled_states_leave_the_cost(modes: int) -> None:
    plant = arm_plant(modes, 0.005)
    closed = plant.close(lqg(plant).system)
    A, B, C = (np.asarray(getattr(closed, name)) for name in "ABC")
    cost = h2_cost(A, B, C)
    for seed in range(10):
        scale = 2.0 ** np.random.default_rng(seed).integers(-20, 20, len(A))
        scaled = h2_cost(A / scale[:, None] * scale, B / scale[:, None], C * scale)
        # Balancing undoes a diagonal scaling; what remains is a Lyapunov equation's rounding.
        assert scaled.value == pytest.approx(cost.value, rel=1e-10)


def test_rotation_leaves_the_cost() -> None:
    omega = np.array([1.0, 10.0, 30.0])
    A, B, C = oscillators(omega, np.full(3, 0.01), np.ones(3), np.ones(3))
    T = random_rotation(np.random.default_rng(2), 6)
    rotated = h2_cost(T @ A @ T.T, T @ B, C @ T.T)
    # A rotation mixes ω² = 900 with 1 and cannot be balanced away: ε·900/(2ζω) = 1e-11.
    assert rotated.value == pytest.approx(h2_cost(A, B, C).value, rel=1e-10)
    assert rotated.discrepancy < 1e-10


def test_cost_is_quadratic_and_additive() -> None:
    A, B, C = oscillators(np.array([1.0, 3.0]), np.full(2, 0.1), np.ones(2), np.ones(2))
    other = np.array([[0.0, 1.0, 2.0, 0.0]])
    together = h2_cost(A, B, np.vstack([2 * C, other])).value
    apart = 4 * h2_cost(A, B, C).value + h2_cost(A, B, other).value
    assert together == pytest.approx(apart, rel=1e-13)


@pytest.mark.filterwarnings("error")
def test_a_pole_far_away_warns_nobody() -> None:
    """What scipy warns of is what the two Gramians are compared for."""
    slow, fast = 1e-17, 1.0
    found = h2_cost(np.diag([-slow, -fast]), np.array([[0.0], [1.0]]), np.array([[0.0, 1.0]]))
    assert found.value == pytest.approx(1 / (2 * fast), rel=1e-12)


def exact_cost(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> float:
    """Return tr C P Cᵀ in 50 digits, from the Kronecker form of the Lyapunov equation."""
    with mp.workdps(50):
        a, b, c = (mp.matrix(matrix.tolist()) for matrix in (A, B, C))
        n, q = len(A), b * b.T
        big = mp.zeros(n * n)
        for i in range(n):
            for j in range(n):
                for k in range(n):
                    big[i * n + j, k * n + j] += a[i, k]
                    big[i * n + j, i * n + k] += a[j, k]
        P = mp.lu_solve(big, mp.matrix([-q[i, j] for i in range(n) for j in range(n)]))
        seen = c.T * c
        return float(sum(seen[i, j] * P[i * n + j] for i in range(n) for j in range(n)))


@pytest.mark.slow
@pytest.mark.parametrize("apart", [0.5, 1e-3, 1e-6, 1e-9, 1e-13, 0.0])
def test_poles_and_residues_know_what_they_miss(apart: float) -> None:
    """Two poles that nearly meet, or do: wrong by no more than is said, and by Lyapunov then."""
    rng = np.random.default_rng(4)
    for _ in range(4):
        w, z = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-4, -1)
        A = np.zeros((4, 4))
        A[:2, :2] = [[-0.3, 1.0], [0.0, -0.3 - apart]]
        A[2:, 2:] = [[0.0, w], [-w, -2 * z * w]]
        T = np.linalg.qr(rng.normal(size=(4, 4)))[0] * 10 ** rng.uniform(-1, 1, 4)
        A = T @ A @ np.linalg.inv(T)
        B, C = rng.normal(size=(4, 2)), rng.normal(size=(3, 4))
        exact, quick = exact_cost(A, B, C), _modal_cost(A, B, C)
        found = cost_of_loop(A, B, C)
        assert found.value == pytest.approx(exact, rel=1e-9)
        if quick and quick.discrepancy < 1e-3:  # to first order
            assert abs(quick.value / exact - 1) <= quick.discrepancy
        if apart >= 1e-3:
            assert found == quick
        if apart <= 1e-13:
            assert found == h2_cost(A, B, C)


def test_poles_and_residues_of_flexible_loops_are_as_good_as_two_gramians() -> None:
    rng = np.random.default_rng(5)
    for modes in (3, 12, 30):
        omega, zeta = 10 ** rng.uniform(-1, 3, modes), 10 ** rng.uniform(-4, -1, modes)
        A = np.block([[np.zeros((modes, modes)), np.diag(omega)],
                      [-np.diag(omega), -np.diag(2 * zeta * omega)]])  # fmt: skip
        B, C = rng.normal(size=(2 * modes, 2)), rng.normal(size=(2, 2 * modes))
        found = cost_of_loop(A, B, C)
        assert found.discrepancy < 1e-9
        assert found.value == pytest.approx(h2_cost(A, B, C).value, rel=1e-11)
