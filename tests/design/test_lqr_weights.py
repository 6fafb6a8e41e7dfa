"""Weights as matrices, in python-control's conventions."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest
from design_problems import TWO_SENSORS, design_plant
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import DesignError, InputError, kalman, lqr


def semidefinite(seed: int, size: int, rank: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    L = rng.standard_normal((size, rank)) * 10.0 ** rng.uniform(-2, 2, (size, 1))
    return L @ L.T


@given(st.integers(0, 1000), st.floats(1e-3, 1e3))
@deterministic(10)
def test_lqr_with_matrices_is_that_of_python_control(seed: int, price: float) -> None:
    plant = design_plant(2)
    Q = semidefinite(seed, 6, 4)
    theirs, _, _ = control.lqr(plant.A, plant.B2, Q, [[price]], method="scipy")
    ours = lqr(plant, Q=Q, R=[[price]])
    np.testing.assert_allclose(ours.gain, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())
    assert ours.residual < 1e-10


@given(st.integers(0, 1000))
@example(153)  # of sensors a thousand times apart, where rounding had been taken for couplings
@example(960)
@deterministic(10)
def test_kalman_with_matrices_is_that_of_python_control(seed: int) -> None:
    plant = design_plant(2, TWO_SENSORS)
    W, V = semidefinite(seed, 6, 4), semidefinite(seed + 1, 2, 2) + 1e-3 * np.eye(2)
    theirs, _, _ = control.lqe(plant.A, np.eye(6), plant.C2, W, V, method="scipy")
    ours = kalman(plant, W=W, V=V).gain
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())


def test_the_objectives_own_matrices_change_nothing() -> None:
    plant = design_plant(3, TWO_SENSORS)
    same = lqr(plant, Q=plant.C1.T @ plant.C1, R=plant.D12.T @ plant.D12)
    np.testing.assert_allclose(same.gain, lqr(plant).gain, rtol=1e-9)
    same = kalman(plant, W=plant.B1 @ plant.B1.T, V=plant.D21 @ plant.D21.T)
    np.testing.assert_allclose(same.gain, kalman(plant).gain, rtol=1e-9)


def test_one_matrix_may_be_given_alone() -> None:
    plant = design_plant(2)
    cheap, dear = lqr(plant, R=[[1e-4]]), lqr(plant, R=1e4)
    assert np.linalg.norm(cheap.gain) > 10 * np.linalg.norm(dear.gain)
    loud = kalman(plant, V=[[1e2]])
    assert np.linalg.norm(loud.gain) < np.linalg.norm(kalman(plant).gain)


SIX = np.eye(6)
ODD = SIX + np.eye(6, k=1)


@pytest.mark.parametrize(
    ("method", "weights", "message"),
    [
        (lqr, {"Q": np.eye(4)}, r"Q: the weight has shape \(4, 4\); give a symmetric .* 6 by 6"),
        (lqr, {"Q": ODD}, "Q: the weight is not symmetric"),
        (lqr, {"Q": np.diag([1, 1, 1, 1, 1, -1e-3])}, "Q: the weight is not positive semidefinite"),
        (lqr, {"Q": np.fliplr(SIX)}, "Q: the weight is not positive semidefinite"),
        (lqr, {"Q": np.nan * SIX}, "Q: the weight is not finite"),
        (lqr, {"Q": "heavy"}, "Q: the weight is no matrix"),
        (lqr, {"R": [[0.0]]}, "R: the weight is not positive definite"),
        (lqr, {"R": -1.0}, "R: the weight is not positive definite"),
        (lqr, {"R": np.eye(2)}, r"R: the weight has shape \(2, 2\)"),
        (kalman, {"W": np.eye(5)}, r"W: the weight has shape \(5, 5\)"),
        (kalman, {"V": np.ones((2, 2))}, "V: the weight is not positive definite"),
    ],
)
def test_wrong_weights_are_refused(method: Callable, weights: dict, message: str) -> None:
    plant = design_plant(2, TWO_SENSORS)
    with pytest.raises(InputError, match=message):
        method(plant, **weights)


@pytest.mark.parametrize("Q", [np.zeros((6, 6)), np.diag([0, 1.0, 1.0, 0, 1.0, 1.0])])
def test_rotation_without_weight_is_refused(Q: np.ndarray) -> None:
    with pytest.raises(DesignError, match="Q: the rigid-body rotation is not penalised"):
        lqr(design_plant(2), Q=Q)
