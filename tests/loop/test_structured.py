"""The structured singular value of a matrix: bounds that meet, and what they claim."""

from __future__ import annotations

import numpy as np
import pytest
from random_multiloops import mu_of_two

from slewctl.loop.robust.mu import balanced_bound, lower_bound, upper_bound


def matrices(n: int, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(n)
    found = []
    for _ in range(count):
        M = rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n))
        found.append(10 ** rng.uniform(-2, 2, n)[:, None] * M)
    return found


@pytest.mark.parametrize("n", [1, 2, 3])
def test_both_bounds_meet_for_up_to_three_scalars(n: int) -> None:
    for M in matrices(n, 15):
        assert upper_bound(M)[0] == pytest.approx(lower_bound(M).value, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_diagonal_makes_the_matrix_singular_and_the_scales_give_the_bound(n: int) -> None:
    for M in matrices(n, 8):
        below, (above, d) = lower_bound(M), upper_bound(M)
        assert np.abs(below.delta) == pytest.approx(1 / below.value)
        singular = np.linalg.svd(np.eye(n) - M * below.delta, compute_uv=False)
        assert singular[-1] < 1e-9 * max(singular[0], 1.0)
        assert np.linalg.norm(d[:, None] * M / d, 2) == pytest.approx(above)
        assert np.abs(np.linalg.eigvals(M)).max() <= below.value * (1 + 1e-9)
        assert below.value <= above * (1 + 1e-9)
        assert above <= np.linalg.norm(M, 2) * (1 + 1e-9)
        assert above <= balanced_bound(M[None])[0] * (1 + 1e-9)


def test_two_scalars_in_closed_form() -> None:
    stack = np.array(matrices(2, 50))
    assert balanced_bound(stack) == pytest.approx(mu_of_two(stack), rel=1e-10)


def test_invariances_of_mu() -> None:
    """Diagonal scaling, permutation, transposition and turns on either side change nothing."""
    rng = np.random.default_rng(8)
    for M in matrices(3, 5):
        mu = upper_bound(M)[0]
        d, order = 10 ** rng.uniform(-1, 1, 3), rng.permutation(3)
        turn = np.exp(1j * rng.uniform(-np.pi, np.pi, 3))
        for other in (
            d[:, None] * M / d,
            M[np.ix_(order, order)],
            M.T,
            M.conj().T,
            turn * M,
            1j * M,
        ):
            assert upper_bound(other)[0] == pytest.approx(mu, rel=1e-7)


def test_triangular_and_zero_matrices() -> None:
    """μ of a triangular matrix is its largest diagonal entry, approached but not attained."""
    M = np.array([[1.0, 20.0, -3.0], [0.0, -2.0, 7.0], [0.0, 0.0, 0.5]], dtype=complex)
    assert upper_bound(M)[0] == pytest.approx(2, rel=1e-4)
    assert lower_bound(M).value == pytest.approx(2)
    assert upper_bound(M[:2, :2])[0] == pytest.approx(2, rel=1e-5)
    assert upper_bound(0 * M)[0] == lower_bound(0 * M).value == 0


def test_a_rank_one_matrix() -> None:
    """μ(u vᴴ) is the sum of |u_i v_i|, in closed form for any number of scalars."""
    rng = np.random.default_rng(4)
    for n in (2, 3, 5):
        u, v = rng.normal(size=(2, n)) + 1j * rng.normal(size=(2, n))
        M, mu = np.outer(u, v.conj()), np.abs(u * v).sum()
        assert upper_bound(M)[0] == pytest.approx(mu, rel=1e-6)
        assert lower_bound(M).value == pytest.approx(mu, rel=1e-9)
