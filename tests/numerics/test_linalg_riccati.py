"""The Riccati equation: residual, stability, symmetry, and agreement with other methods."""

from __future__ import annotations

import control
import numpy as np
import pytest
from flexible_plants import Array, arm_plant, oscillators
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag, schur, solve_continuous_lyapunov

from slewctl import AccuracyError, GeneralisedPlant
from slewctl.numerics.balance import balance, balance_realisation
from slewctl.numerics.matrix_equations import balance_priced, solve_riccati

SIZES = [(1, 1e-4), (5, 1e-4), (5, 0.02), (20, 1e-4), (20, 0.02), (40, 1e-4), (40, 0.02)]


def weights(plant: GeneralisedPlant) -> tuple[Array, Array]:
    return plant.C1.T @ plant.C1, plant.D12.T @ plant.D12


def distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def kleinman(A: Array, B: Array, Q: Array, R: Array, gain: Array) -> Array:
    """Newton's method from a stabilising gain: one Lyapunov equation a step, no Hamiltonian."""
    scale = balance(A)
    A, B = A / scale[:, None] * scale, B / scale[:, None]
    Q, gain = Q * np.outer(scale, scale), gain * scale
    previous = np.inf
    for _ in range(60):
        right = -(Q + gain.T @ R @ gain)
        X = solve_continuous_lyapunov((A - B @ gain).T, right)
        updated = np.linalg.solve(R, B.T @ X)
        change, gain = distance(gain, updated), updated
        if change < 1e-6 and change >= previous:  # converged quadratically, now rounding
            break
        previous = change
    return gain / scale


@given(st.integers(2, 12), st.integers(0, 10_000), st.floats(0.0, 6.0))
@settings(deadline=None, max_examples=30, derandomize=True)
def test_balancing_is_a_similarity_by_powers_of_two(n: int, seed: int, decades: float) -> None:
    rng = np.random.default_rng(seed)
    spread = 10 ** rng.uniform(-decades, decades, n)
    A = rng.standard_normal((n, n)) / spread[:, None] * spread
    scale = balance(A)
    mantissa, _ = np.frexp(scale)
    assert np.all(mantissa == 0.5)  # exact powers of two: scaling adds no rounding
    balanced = A / scale[:, None] * scale
    assert np.array_equal(balanced * scale[:, None] / scale, A)
    # LAPACK stops at changes below 5 %: the 1-norm may not grow by more.
    assert np.linalg.norm(balanced, 1) <= 1.05 * np.linalg.norm(A, 1)


def test_balancing_equalises_displacements_and_rates() -> None:
    A, _, _ = oscillators(np.array([1e3]), np.array([0.01]), np.ones(1), np.ones(1))
    scale = balance(A)
    balanced = A / scale[:, None] * scale
    # [[0, 1], [-ω², …]] becomes [[0, ω], [-ω, …]] but for the radix, a factor 2 each way.
    assert 0.25 <= abs(balanced[0, 1] / balanced[1, 0]) <= 4


@pytest.mark.parametrize(("modes", "zeta"), SIZES)
def test_solution_is_stabilising_symmetric_and_semidefinite(modes: int, zeta: float) -> None:
    plant = arm_plant(modes, zeta)
    Q, R = weights(plant)
    solution = solve_riccati(plant.A, plant.B2, Q, R)
    assert solution.residual < 1e-11
    assert np.linalg.eigvals(plant.A - plant.B2 @ solution.gain).real.max() < 0
    assert distance(solution.X.T, solution.X) < 1e-14
    scale = balance(plant.A)
    spectrum = np.linalg.eigvalsh(solution.X * np.outer(scale, scale))
    assert spectrum.min() > -len(scale) * np.finfo(float).eps * spectrum.max()


@pytest.mark.parametrize(("modes", "zeta"), SIZES)
def test_reported_residual_is_that_of_the_equation(modes: int, zeta: float) -> None:
    plant = arm_plant(modes, zeta)
    Q, R = weights(plant)
    solution = solve_riccati(plant.A, plant.B2, Q, R)
    linear = plant.A.T @ solution.X
    linear = linear + linear.T
    left = linear - solution.gain.T @ R @ solution.gain + Q
    scale = balance_priced(plant.A, plant.B2 / np.sqrt(R), Q)
    outer = np.outer(scale, scale)
    size = max(np.linalg.norm(linear * outer), np.linalg.norm(Q * outer))
    # Recomputed in the given coordinates: powers of two change no digit, summation order a few.
    rounding = len(plant.A) * np.finfo(float).eps
    assert np.linalg.norm(left * outer) / size == pytest.approx(solution.residual, abs=rounding)


@pytest.mark.parametrize(("modes", "zeta"), SIZES)
def test_gain_agrees_with_kleinman_iteration_and_python_control(modes: int, zeta: float) -> None:
    plant = arm_plant(modes, zeta)
    Q, R = weights(plant)
    gain = solve_riccati(plant.A, plant.B2, Q, R).gain
    # Collocated position and rate feedback stabilises every arm: an independent start.
    row = plant.B2[len(plant.A) // 2 :, 0]
    start = np.concatenate([row, row])[None, :] * 0.3
    # Conditioned like ‖A‖/(slowest closed-loop pole), 1e4/1e-2 at 40 modes: 1e6·ε = 2e-10.
    assert distance(gain, kleinman(plant.A, plant.B2, Q, R, start)) < 1e-9
    theirs, _, _ = control.lqr(plant.A, plant.B2, Q, R, method="scipy")
    assert distance(gain, np.asarray(theirs)) < 1e-9


@pytest.mark.parametrize(("modes", "zeta"), SIZES)
def test_filter_agrees_with_python_control(modes: int, zeta: float) -> None:
    plant = arm_plant(modes, zeta)
    V, W = plant.B1 @ plant.B1.T, plant.D21 @ plant.D21.T
    dual = solve_riccati(plant.A.T, plant.C2.T, V, W)
    eye = np.eye(len(plant.A))
    theirs, _, _ = control.lqe(plant.A, eye, plant.C2, V, W, method="scipy")
    assert distance(dual.gain.T, np.asarray(theirs)) < 1e-9


@pytest.mark.parametrize("zeta", [1e-4, 0.02])
def test_gain_agrees_with_the_invariant_subspace_of_the_hamiltonian(zeta: float) -> None:
    plant = arm_plant(5, zeta)
    Q, R = weights(plant)
    n = len(plant.A)
    H = np.block([[plant.A, -plant.B2 @ np.linalg.solve(R, plant.B2.T)], [-Q, -plant.A.T]])
    _, Z, stable = schur(H, sort="lhp", output="real")
    assert stable == n
    X = Z[n:, :n] @ np.linalg.inv(Z[:n, :n])
    gain = np.linalg.solve(R, plant.B2.T @ X)
    # H is not balanced here: ε‖H‖ = 2e-16·6e4 over the slowest pole 1e-2 is 1e-9.
    assert distance(solve_riccati(plant.A, plant.B2, Q, R).gain, gain) < 1e-8


def test_scalar_equation_in_closed_form() -> None:
    a, b, q, r = 3.0, 2.0, 5.0, 7.0
    solution = solve_riccati(*(np.array([[v]]) for v in (a, b, q, r)))
    expected = r * (a + np.sqrt(a**2 + b**2 * q / r)) / b**2
    assert solution.X[0, 0] == pytest.approx(expected, rel=1e-14)


def test_double_integrator_in_closed_form() -> None:
    A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    gain = solve_riccati(A, B, np.diag([1.0, 0.0]), np.eye(1)).gain
    np.testing.assert_allclose(gain, [[1.0, np.sqrt(2.0)]], rtol=1e-13)


@pytest.mark.parametrize(
    ("A", "B", "Q"),
    [
        (np.diag([1.0, -1.0]), np.array([[0.0], [1.0]]), np.eye(2)),  # unstable, not reached
        (np.array([[0.0, 1.0], [-4.0, 0.0]]), np.zeros((2, 1)), np.eye(2)),  # no input at all
        # An undamped mode that costs nothing is left alone: no stabilising solution.
        (np.array([[0.0, 1.0], [-4.0, 0.0]]), np.array([[0.0], [1.0]]), np.zeros((2, 2))),
    ],
)
def test_no_stabilising_solution_is_an_accuracy_error(A: Array, B: Array, Q: Array) -> None:
    with pytest.raises(AccuracyError, match="no stabilising solution"):
        solve_riccati(A, B, Q, np.eye(1))


def test_what_moves_alone_may_have_any_unit() -> None:
    """Oscillators that A does not couple: nothing in it says how large they are side by side."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        n = int(rng.integers(2, 5))
        omega = 10 ** rng.uniform(-0.5, 1.5, n)
        A = block_diag(*([[0.0, w], [-w, -0.002 * w]] for w in omega))
        B, C = rng.normal(size=(2 * n, 1)), rng.normal(size=(1, 2 * n))
        scale = np.repeat(2.0 ** np.round(rng.uniform(-17, 17, n)), 2)
        expected = solve_riccati(A, B, C.T @ C, np.eye(1)).gain
        found = solve_riccati(
            A / scale[:, None] * scale,
            B / scale[:, None],
            np.outer(C * scale, C * scale),
            np.eye(1),
        )
        off = np.abs(found.gain / scale - expected).max()
        assert off < 1e-7 * np.abs(expected).max()


@given(st.integers(0, 10_000), st.booleans())
@settings(deadline=None, max_examples=30, derandomize=True)
def test_what_is_coupled_both_ways_is_scaled_as_a_whole(seed: int, chained: bool) -> None:
    """Oscillators side by side, or each driving the next: in any units they end in the same ones."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    omega = 10 ** rng.uniform(-1, 2, n)
    A = block_diag(*([[0.0, w], [-w, -0.01 * w]] for w in omega))
    B, C = rng.normal(size=(2 * n, 1)), rng.normal(size=(1, 2 * n))
    if chained:
        A[2 * np.arange(1, n) + 1, 2 * np.arange(n - 1)] = rng.normal(size=n - 1)
    scale = np.repeat(2.0 ** np.round(rng.uniform(-30, 30, n)), 2)
    own = balance_realisation(A, B, C)
    found = balance_realisation(A / scale[:, None] * scale, B / scale[:, None], C * scale) * scale
    assert np.abs(np.log2(found / own)).max() <= 2
