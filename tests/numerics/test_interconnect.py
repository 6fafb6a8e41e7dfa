"""Systems put together, against python-control's own operations."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from random_systems import COUNTS, SEEDS, STATES, assert_same, polynomial, random_system
from strategies import deterministic

from slewctl.numerics.interconnect import (
    AlgebraicLoopError,
    lft,
    parallel,
    series,
    side_by_side,
)
from slewctl.numerics.linear_system import LinearSystem

both_clocks = pytest.mark.parametrize("dt", [0.0, 0.1])


@both_clocks
@given(seed=SEEDS, n=STATES, k=STATES, m=COUNTS, through=COUNTS, p=COUNTS)
@deterministic(20)
def test_series(seed: int, n: int, k: int, m: int, through: int, p: int, dt: float) -> None:
    first = random_system(seed, n, m, through, dt)
    second = random_system(seed + 1, k, through, p, dt)
    found = series(first, second)
    assert_same(found, control.series(first.to_control(), second.to_control()))
    assert found.input_labels == first.input_labels
    assert found.output_labels == second.output_labels


@both_clocks
@given(seed=SEEDS, n=STATES, k=STATES, m=COUNTS, p=COUNTS)
@deterministic(20)
def test_parallel(seed: int, n: int, k: int, m: int, p: int, dt: float) -> None:
    first, second = random_system(seed, n, m, p, dt), random_system(seed + 1, k, m, p, dt)
    found = parallel(first, second)
    assert_same(found, control.parallel(first.to_control(), second.to_control()))
    assert found.input_labels == first.input_labels
    assert found.output_labels == first.output_labels


@both_clocks
@given(seed=SEEDS, n=STATES, k=STATES, j=STATES, m=COUNTS, p=COUNTS)
@deterministic(20)
def test_side_by_side(seed: int, n: int, k: int, j: int, m: int, p: int, dt: float) -> None:
    systems = [
        random_system(seed, n, m, p, dt),
        random_system(seed + 1, k, p, m, dt),
        random_system(seed + 2, j, 1, 1, dt),
    ]
    found = side_by_side(*systems)
    assert_same(found, control.append(*(system.to_control() for system in systems)))


@both_clocks
@given(seed=SEEDS, n=STATES, k=STATES, w=COUNTS, z=COUNTS, u=COUNTS, y=COUNTS)
@deterministic(30)
def test_lower_linear_fractional_transformation(
    seed: int, n: int, k: int, w: int, z: int, u: int, y: int, dt: float
) -> None:
    plant, K = random_system(seed, n, w + u, z + y, dt), random_system(seed + 1, k, y, u, dt)
    found = lft(plant, K)
    condition = np.linalg.cond(np.eye(u) - K.D @ plant.D[z:, w:])
    theirs = plant.to_control().lft(K.to_control(), u, y)
    assert_same(found, theirs, digits=1e-11 * (1 + condition) ** 2)
    assert found.input_labels == plant.input_labels[:w]
    assert found.output_labels == plant.output_labels[:z]


@both_clocks
@given(seed=SEEDS, n=STATES, k=STATES, u=COUNTS, y=COUNTS)
@deterministic(15)
def test_all_signals_fed_back(seed: int, n: int, k: int, u: int, y: int, dt: float) -> None:
    """With nothing from outside the loop's poles are left: those of feedback with a plus sign."""
    plant, K = random_system(seed, n, u, y, dt), random_system(seed + 1, k, y, u, dt)
    found = lft(plant, K)
    theirs = control.feedback(plant.to_control(), K.to_control(), sign=1)
    condition = np.linalg.cond(np.eye(u) - K.D @ plant.D)
    expected = polynomial(theirs.A)
    atol = 1e-11 * (1 + condition) ** 2 * np.abs(expected).max()
    np.testing.assert_allclose(polynomial(found.A), expected, rtol=0, atol=atol)
    assert (found.ninputs, found.noutputs) == (0, 0)


def static(gain: list[list[float]]) -> LinearSystem:
    D = np.array(gain)
    return LinearSystem(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((len(D), 0)), D)


@pytest.mark.parametrize(
    ("through", "gain"),
    [
        ([[2.0]], [[0.5]]),
        ([[-8.0]], [[-0.125]]),
        ([[2.0, 0.0], [0.0, 3.0]], [[0.5, 0.0], [0.0, 0.1]]),
        ([[1.0, 2.0], [3.0, 4.0]], [[-2.0, 1.0], [1.5, -0.5]]),
        ([[4.0], [8.0]], [[0.5, -0.125]]),  # one input, two outputs
    ],
)
def test_a_loop_without_delay_and_without_solution(
    through: list[list[float]], gain: list[list[float]]
) -> None:
    """det(I − D_K D₂₂) = 0 exactly; a millionth beside it the loop is python-control's."""
    y, u = np.shape(through)
    plant = random_system(3, 2, 1 + u, 1 + y)
    plant.D[1:, 1:] = through
    assert np.linalg.det(np.eye(u) - np.array(gain) @ through) == 0
    with pytest.raises(AlgebraicLoopError):
        lft(plant, static(gain))
    beside = static([[value * (1 + 1e-6) for value in row] for row in gain])
    theirs = plant.to_control().lft(beside.to_control(), u, y)
    # The gain of the loop is 1e6, in A and in the response.
    assert_same(lft(plant, beside), theirs, digits=1e-8)


def test_a_clock_is_that_of_whoever_has_one() -> None:
    anywhere, clocked = random_system(1, 0, 2, 2, None), random_system(2, 2, 2, 2, 0.1)
    for together in (series, parallel):
        for pair in ((anywhere, clocked), (clocked, anywhere)):
            assert together(*pair).dt == 0.1
