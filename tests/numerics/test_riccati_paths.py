"""Both ways to a Riccati solution: Hamiltonian and pencil agree, and the second catches the first.

Examples with a solution in closed form are from P. Benner, A. J. Laub and V. Mehrmann, *A
collection of benchmark examples for the numerical solution of algebraic Riccati equations I*,
SPC 95_22, TU Chemnitz-Zwickau 1995 (CAREX), by their numbers.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from flexible_plants import Array, arm_plant
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

import slewctl as sc
from slewctl.compare.study.grid import objective_of
from slewctl.model import beam_mass
from slewctl.numerics import matrix_equations
from slewctl.numerics.matrix_equations import (
    _from_gain,
    _of_hamiltonian,
    _refined,
    _solved,
    _stabilising,
    solve_riccati,
)

Problem = tuple[Array, Array, Array]
EPS = float(np.finfo(float).eps)


def example_1_1() -> tuple[Problem, Array]:
    A, B = np.eye(2, k=1), np.array([[0.0], [1.0]])
    return (A, B, np.diag([1.0, 2.0])), np.array([[2.0, 1.0], [1.0, 2.0]])


def example_1_2() -> tuple[Problem, Array]:
    A, B = np.array([[4.0, 3.0], [-4.5, -3.5]]), np.array([[1.0], [-1.0]])
    Q = np.array([[9.0, 6.0], [6.0, 4.0]])
    return (A, B, Q), (1 + math.sqrt(2)) * Q


def example_2_1(eps: float) -> tuple[Problem, Array]:
    """An unstable state that is reached weakly."""
    root = math.sqrt(1 + eps**2)
    X = np.array([[(1 + root) / eps**2, 1 / (2 + root)],
                  [1 / (2 + root), (1 - eps**2 / (2 + root) ** 2) / 4]])  # fmt: skip
    return (np.diag([1.0, -2.0]), np.array([[eps], [0.0]]), np.ones((2, 2))), X


def example_2_3(eps: float) -> tuple[Problem, Array]:
    root = math.sqrt(1 + 2 * eps)
    X = np.array([[root / eps, 1.0], [1.0, root]])
    return (eps * np.eye(2, k=1), np.array([[0.0], [1.0]]), np.eye(2)), X


def example_2_4(eps: float) -> tuple[Problem, Array]:
    a = eps + 1
    x = (2 * a + math.sqrt(2 * a**2 + 2) + math.sqrt(2) * eps) / 2
    y = x / (x - a)
    return (np.array([[a, 1.0], [1.0, a]]), np.eye(2), eps**2 * np.eye(2)), np.array(
        [[x, y], [y, x]]
    )


CAREX = {
    "1.1": example_1_1(),
    "1.2": example_1_2(),
    **{f"2.1, {eps:g}": example_2_1(eps) for eps in (1.0, 1e-2, 1e-4)},
    **{f"2.3, {eps:g}": example_2_3(eps) for eps in (100.0, 1.0, 1e-2, 1e-4)},
    **{f"2.4, {eps:g}": example_2_4(eps) for eps in (1.0, 1e-2, 1e-4)},
}


def reach(problem: Problem, X: Array) -> float:
    """Return how far rounding of the data moves X: their change over sep of the closed loop."""
    A, B, Q = problem
    closed, eye = A - B @ B.T @ X, np.eye(len(A))
    operator = np.kron(eye, closed.T) + np.kron(closed.T, eye)
    separation = np.linalg.svd(operator, compute_uv=False)[-1]
    size = np.linalg.norm(X)
    change = 2 * np.linalg.norm(A) * size + np.linalg.norm(Q) + np.linalg.norm(B @ B.T) * size**2
    return float(4 * len(A) * EPS * change / separation)


def both(problem: Problem) -> list[Array]:
    """Return what each path finds, refined."""
    quick = _of_hamiltonian(*problem)
    assert quick is not None
    return [_refined(*problem, X)[0] for X in (quick, _stabilising(*problem))]


@pytest.mark.parametrize("name", CAREX)
def test_benchmark_examples_in_closed_form(name: str) -> None:
    problem, exact = CAREX[name]
    for X in (*both(problem), solve_riccati(*problem, np.eye(problem[1].shape[1])).X):
        assert np.linalg.norm(X - exact) <= reach(problem, exact), name


def random_problem(seed: int, n: int, m: int, p: int, decades: float) -> Problem:
    """A plant that is as often unstable as not, with weights over some decades."""
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, m)) * 10 ** rng.uniform(-decades, decades)
    C = rng.normal(size=(p, n))
    return A, B, C.T @ C


@given(
    seed=st.integers(0, 10**6), n=st.integers(1, 7), m=st.integers(1, 3), p=st.integers(1, 3),
    decades=st.floats(0.0, 1.0),
)  # fmt: skip
@deterministic(60)
def test_both_paths_agree_on_random_plants(
    seed: int, n: int, m: int, p: int, decades: float
) -> None:
    problem = random_problem(seed, n, m, p, decades)
    quick, slow = both(problem)
    assert np.linalg.norm(quick - slow) <= reach(problem, slow)
    assert np.linalg.eigvals(problem[0] - problem[1] @ problem[1].T @ slow).real.max() < 0


@pytest.mark.parametrize(("modes", "zeta"), [(2, 1e-4), (3, 0.02)])
def test_both_paths_agree_on_arms(modes: int, zeta: float, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = arm_plant(modes, zeta)
    given_problem = (plant.A, plant.B2, plant.C1.T @ plant.C1, plant.D12.T @ plant.D12)
    quick = solve_riccati(*given_problem)
    monkeypatch.setattr(matrix_equations, "_of_hamiltonian", lambda *_: None)
    slow = solve_riccati(*given_problem)
    assert np.linalg.norm(quick.gain - slow.gain) <= 1e-10 * np.linalg.norm(slow.gain)


def mirrored(problem: Problem) -> Array:
    """The solution that makes the closed loop antistable: the equation's residual is as small."""
    A, B, Q = problem
    found = _of_hamiltonian(-A, B, Q)
    assert found is not None
    return -found


@pytest.mark.parametrize("name", ["1.1", "2.3, 1", "2.4, 1"])
@pytest.mark.parametrize("wrong", ["antistable", "inexact", "nothing"])
def test_a_wrong_first_solution_is_replaced(
    name: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, exact = CAREX[name]
    false = {
        "antistable": mirrored(problem),
        "inexact": exact + 0.1 * np.linalg.norm(exact) * np.eye(2),
        "nothing": None,
    }[wrong]
    monkeypatch.setattr(matrix_equations, "_of_hamiltonian", lambda *_: false)
    X, residual = _solved(*problem)
    assert np.linalg.norm(X - exact) <= reach(problem, exact)
    assert residual < 1e-13
    if wrong == "antistable":
        assert _refined(*problem, mirrored(problem))[1] < 1e-13


@pytest.mark.parametrize("name", ["1.1", "1.2", "2.3, 1", "2.4, 1"])
def test_a_good_first_solution_costs_no_second(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matrix_equations, "_stabilising", pytest.fail)
    problem, exact = CAREX[name]
    assert np.linalg.norm(_solved(*problem)[0] - exact) <= reach(problem, exact)


def test_a_hamiltonian_with_eigenvalues_on_the_axis_has_no_stable_half() -> None:
    A = np.array([[0.0, 1.0], [-4.0, 0.0]])  # undamped, and nothing is paid for it
    assert _of_hamiltonian(A, np.array([[0.0], [1.0]]), np.zeros((2, 2))) is None


@pytest.mark.parametrize("payload", [1.0, 10.0])
def test_costs_of_badly_conditioned_loops_are_refined(payload: float) -> None:
    """No hub and a heavy payload: Gramians that differ in the eighth digit agree in the twelfth."""
    base = sc.arms.paper_beam()
    arm = sc.Arm(base.beam, payload=sc.Payload(payload * beam_mass(base)), damping_ratio=0.005)
    sensors = ("theta", "theta_dot")
    plant = sc.generalised_plant(sc.truth(arm, 20), objective_of(arm, 0.3, sensors))
    checks = {check.name: check.error for check in sc.lqg(plant).certificate.checks}
    # Some machines have no numbers longer than double.
    allowed = 1e-11 if np.finfo(np.longdouble).eps < EPS / 10 else 1e-7
    assert checks["cost, Lyapunov against Riccati"] < allowed
    assert checks["cost, two Gramians"] < allowed


@pytest.mark.parametrize("modes", [5, 20])
def test_a_gain_of_fewer_modes_leads_to_the_optimum(modes: int) -> None:
    few, many = (arm_plant(count, 0.01) for count in (modes - 1, modes))
    gain = matrix_equations.Regulator.of(few.A, few.B2, few.C1, few.D12).solve().gain
    names = list(many.linear.state_labels)
    near = np.zeros((1, len(names)))
    near[:, [names.index(name) for name in few.linear.state_labels]] = gain
    regulator = matrix_equations.Regulator.of(many.A, many.B2, many.C1, many.D12)
    found, exact = regulator.solve(refine=False, near=near), regulator.solve()
    assert found.residual < 1e-7
    cost = [np.trace(many.B1.T @ each.X @ many.B1) for each in (found, exact)]
    assert cost[0] == pytest.approx(cost[1], rel=1e-7)
    # Kleinman: the cost of a gain, never less than that of the best but for the rounding of
    # both, which is up to 2e-11 with one BLAS kernel or another.
    assert cost[0] >= cost[1] * (1 - 1e-10)


def test_gains_that_lead_nowhere_are_told() -> None:
    (A, B, Q), X = example_1_1()
    assert _from_gain(A, B, Q, np.zeros((1, 2))) is None  # the integrators are not held
    assert _from_gain(A, B, Q, np.array([[1e-3, 1e-3]])) is None  # it is far from the best
    found = _from_gain(A, B, Q, B.T @ X * (1 + 1e-3))
    assert found is not None
    np.testing.assert_allclose(found[0], X, rtol=1e-8)
