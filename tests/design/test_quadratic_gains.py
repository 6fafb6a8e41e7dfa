"""`lqr`, `kalman`, `dlqr` and `dlqe` against python-control, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slewctl as sc

A, B, C = np.array([[0.0, 1.0], [-4.0, -0.1]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
Q, R = np.eye(2), np.eye(1)
seeds = st.integers(0, 10_000)


def random_problem(seed: int) -> tuple[np.ndarray, ...]:
    """A random system with two inputs and outputs, and weights with a cross term."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    weight = rng.normal(size=(n + 2, n + 2))
    whole = weight @ weight.T
    return (
        rng.normal(size=(n, n)), rng.normal(size=(n, 2)), rng.normal(size=(2, n)),
        whole[:n, :n], whole[n:, n:] + np.eye(2), whole[:n, n:],
    )  # fmt: skip


@given(seeds)
def test_lqr_is_python_controls(seed: int) -> None:
    A, B, C, Q, R, N = random_problem(seed)
    ours, theirs = sc.lqr(A, B, Q, R, N), control.lqr(A, B, Q, R, N, method="scipy")
    system = control.ss(A, B, C, 0)
    for found in (ours, sc.lqr(system, Q, R, N), sc.lqr(system, Q=Q, R=R, N=N)):
        K, S, E = found
        np.testing.assert_allclose(K, theirs[0], atol=1e-6 * np.abs(theirs[0]).max())
        np.testing.assert_allclose(S, theirs[1], atol=1e-6 * np.abs(theirs[1]).max())
        np.testing.assert_allclose(
            np.sort_complex(E), np.sort_complex(np.linalg.eigvals(A - B @ K)), atol=1e-9
        )


@given(seeds)
def test_kalman_is_python_controls(seed: int) -> None:
    A, G, C, _, R, _ = random_problem(seed)
    L, P, E = sc.kalman(A, G, C, np.eye(2), R)
    theirs = control.lqe(A, G, C, np.eye(2), R, method="scipy")
    np.testing.assert_allclose(L, theirs[0], atol=1e-6 * np.abs(theirs[0]).max())
    np.testing.assert_allclose(P, theirs[1], atol=1e-6 * np.abs(theirs[1]).max())
    assert np.all(E.real < 0)
    again = sc.kalman(control.ss(A, G, C, 0), np.eye(2), R)
    np.testing.assert_array_equal(again.gain, L)


@given(seeds)
def test_sampled_gains_are_python_controls(seed: int) -> None:
    A, B, C, Q, R, N = random_problem(seed)
    theirs = control.dlqr(A, B, Q, R, N, method="scipy")
    for found in (sc.dlqr(A, B, Q, R, N), sc.lqr(control.ss(A, B, C, 0, 0.1), Q, R, N)):
        np.testing.assert_allclose(found.gain, theirs[0], atol=1e-6 * np.abs(theirs[0]).max())
        assert np.all(np.abs(found.poles) < 1)
    L, P, _ = sc.dlqe(A, B, C, np.eye(2), R)
    wanted = control.dlqe(A, B, C, np.eye(2), R, method="scipy")
    # python-control gives the gain of the filter and not that of the predictor: A L.
    np.testing.assert_allclose(P, wanted[1], atol=1e-6 * np.abs(wanted[1]).max())
    either = (wanted[0], A @ wanted[0])
    assert min(np.abs(L - gain).max() for gain in either) < 1e-6 * np.abs(L).max()


def test_a_generalised_plant_brings_its_own_weights() -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    plant = problem.plant("clamped-free", 2)
    K, S, E = sc.lqr(plant)
    same = sc.lqr(plant.A, plant.B2, plant.C1.T @ plant.C1, plant.D12.T @ plant.D12)
    np.testing.assert_allclose(same.gain, K, rtol=1e-8)
    assert np.linalg.eigvalsh(S).min() > 0
    assert np.all(E.real < 0)
    L, _, _ = sc.kalman(plant)
    assert L.shape == (6, 1)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: sc.lqr(A), "B is missing"),
        (lambda: sc.lqr(A, B, Q), "R is missing"),
        (lambda: sc.lqr(A, B, Q, R, R=R), "given twice"),
        (lambda: sc.lqr(A, B, Q, R, None, 3), "weights"),
        (lambda: sc.lqr(A, B, Q, -R), "R: .*positive definite"),
        (lambda: sc.lqr(A, B, np.eye(3), R), r"Q: .*\(3, 3\)"),
        (lambda: sc.lqr(A, B, Q, R, [[9.0], [9.0]]), "Q: .*semidefinite"),
        (lambda: sc.lqr(A, B, Q, R, [[1.0]]), "N: "),
        (lambda: sc.lqr(A, [[1.0, 2.0, 3.0]], Q, R), "B has shape"),
        (lambda: sc.lqr([[np.nan]], [[1.0]], [[1.0]], [[1.0]]), "A: .*finite"),
        (lambda: sc.lqr("A", B, Q, R), "is not a GeneralisedPlant, a system or a matrix"),
        (lambda: sc.lqr([["a"]], B, Q, R), "A: .*no matrix"),
        (lambda: sc.kalman(A, B, C, R), "RN is missing"),
        (lambda: sc.kalman(A, B, C, Q, R), "QN: .*shape"),
        (lambda: sc.dlqr(control.ss(A, B, C, 0), Q, R), "continuous; use lqr"),
        (lambda: sc.dlqe(control.ss(A, B, C, 0), R, R), "continuous; use kalman"),
        (lambda: sc.lqr(control.ss(A, B, C, 0, True), Q, R), "sample time"),
    ],
)
def test_impossible_calls_are_refused(call: Callable[[], Any], told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        call()


def test_what_no_gain_can_stabilise_is_refused() -> None:
    with pytest.raises(sc.DesignError, match="not reached by the input"):
        sc.lqr([[1.0, 0.0], [0.0, 2.0]], [[1.0], [0.0]], Q, R)
    with pytest.raises(sc.DesignError, match="not seen"):
        sc.kalman([[1.0, 0.0], [0.0, 2.0]], Q, [[1.0, 0.0]], Q, R)


@given(seeds)
def test_poles_of_any_matrices_are_placed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 6)), int(rng.integers(1, 3))
    A, B, poles = rng.normal(size=(n, n)), rng.normal(size=(n, m)), -rng.uniform(0.5, 3, n)
    K = sc.place(A, B, list(poles))
    assert K.shape == (m, n)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(A - B @ K)), np.sort_complex(poles + 0j), atol=1e-4
    )
    np.testing.assert_array_equal(sc.place(control.ss(A, B, np.eye(n), 0), list(poles)), K)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: sc.place(A, B), "B and the poles"),
        (lambda: sc.place([[1.0, 2.0]], [[1.0]], [-1.0]), "square A"),
        (lambda: sc.place(A, B, [-1.0]), "poles"),
    ],
)
def test_impossible_placements_are_refused(call: Callable[[], Any], told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        call()


def test_a_pole_that_no_input_moves_is_named() -> None:
    with pytest.raises(sc.DesignError, match=r"one of the poles .*2.* is not reached by the input"):
        sc.place(np.diag([1.0, 2.0]), [[1.0], [0.0]], [-1.0, -2.0])
