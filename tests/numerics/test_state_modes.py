"""What belongs together in a state matrix does not depend on coordinates, units or order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl.errors import AccuracyError
from slewctl.numerics.modes import (
    AT_ORIGIN,
    Eigensystem,
    at_origin,
    conjugate_pairs,
    invariant_basis,
    linked,
    near,
    real_pairs,
    rigid_body,
)
from slewctl.numerics.ordered_schur import ordered_schur


def mixed(A: np.ndarray, seed: int, spread: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return A in other coordinates, whose units lie `spread` decades apart, and the way."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=A.shape))[0]
    T = 10.0 ** rng.uniform(-spread, spread, len(A))[:, None] * Q
    return T @ A @ np.linalg.inv(T), T


def arm(friction: float = 0.0, time: float = 1.0) -> np.ndarray:
    """Return a rigid body with two modes, in a unit of time."""
    A = np.zeros((6, 6))
    A[0, 1], A[1, 1] = 1.0, -friction
    for k, omega in enumerate((7.0, 40.0), 1):
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[-0.01 * omega, omega], [-omega, -0.01 * omega]]
    return A * time


@given(st.integers(0, 1000), st.sampled_from([0.0, 1e-3, 0.3, 5.0]), st.floats(-6, 6))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_the_rigid_body_is_found_in_any_coordinates_and_units(
    seed: int, friction: float, decades: float
) -> None:
    A, _ = mixed(arm(friction, 10**decades), seed)
    found = Eigensystem.of(A)
    rigid = rigid_body(found.poles, found.size)
    assert rigid.sum() == 2
    wanted = np.sort([0.0, friction * 10**decades])
    np.testing.assert_allclose(
        np.sort(np.abs(found.poles[rigid])), wanted, atol=AT_ORIGIN * found.size
    )


@given(st.integers(0, 1000))
@settings(deadline=None, max_examples=30, derandomize=True)
def test_a_double_zero_is_at_the_origin_though_rounding_splits_it(seed: int) -> None:
    found = Eigensystem.of(mixed(arm(), seed)[0])
    assert at_origin(found.poles, found.size).sum() == 2


def test_a_slow_pole_beside_an_exact_zero_is_not_at_the_origin() -> None:
    poles = np.array([0.0, -1e-4, -1.0 + 2000j, -1.0 - 2000j])
    assert at_origin(poles, 2000.0).tolist() == [True, True, False, False]
    assert at_origin(poles, 2.0).tolist() == [True, False, False, False]


@given(st.integers(1, 6), st.integers(1, 3), st.integers(1, 3), st.integers(0, 1000))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_residues_add_up_to_the_response(n: int, m: int, p: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = mixed(rng.normal(size=(n, n)), seed, 3.0)[0]
    B, C = rng.normal(size=(n, m)), rng.normal(size=(p, n))
    found, s = Eigensystem.of(A), 1.7j
    parts = found.residues(B, C, np.arange(n))
    added = (parts / (s - found.poles)[:, None, None]).sum(axis=0)
    own = C @ np.linalg.solve(s * np.eye(n) - A, B.astype(complex))
    worst = 1 / np.abs(found.meeting).min()
    np.testing.assert_allclose(added, own, atol=1e-12 * worst**2 * np.abs(parts).sum() + 1e-12)


def test_rows_and_columns_are_inverse_to_each_other_in_the_matrix_own_units() -> None:
    A = mixed(arm(0.5), 3, 4.0)[0]
    found = Eigensystem.of(A)
    np.testing.assert_allclose(found.rows @ found.columns, np.eye(6), atol=1e-10)
    back = found.columns @ np.diag(found.poles) @ found.rows
    size = np.outer(found.scale, 1 / found.scale)  # entry by entry, what balancing undoes
    np.testing.assert_allclose(back.real / size, found.balanced, atol=1e-10 * found.size)


def test_residues_of_a_mode_survive_a_double_pole_elsewhere() -> None:
    A = arm()  # its two zeros have one eigenvector: the matrix of eigenvectors is singular
    B, C = np.arange(1.0, 7.0)[:, None], np.arange(2.0, 8.0)[None]
    found = Eigensystem.of(A)
    upper = np.flatnonzero(found.poles.imag > 0)
    parts = found.residues(B, C, upper)[:, 0, 0]
    for k, part in zip(upper, parts, strict=True):
        states = [2, 3] if abs(found.poles[k]) < 20 else [4, 5]
        # c (1, ±j)/√2 and its adjoint on b, from [[σ, ω], [−ω, σ]] by hand.
        v = np.array([1.0, 1j]) / np.sqrt(2)
        np.testing.assert_allclose(part, (C[0, states] @ v) * (v.conj() @ B[states, 0]), rtol=1e-12)


def test_an_empty_matrix_has_no_poles() -> None:
    found = Eigensystem.of(np.zeros((0, 0)))
    assert found.size == 0.0
    assert found.residues(np.zeros((0, 2)), np.zeros((1, 0)), np.zeros(0, int)).shape == (0, 1, 2)
    assert rigid_body(found.poles, found.size).tolist() == []


@given(
    st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=5, unique=True),
    st.integers(1, 1000),
)
@settings(deadline=None, max_examples=40, derandomize=True)
def test_overdamped_modes_of_kelvin_voigt_pair_as_their_product_says(
    frequencies: list[float], seed: int
) -> None:
    eta = 3.0 / min(frequencies)  # all of them overdamped: ηω/2 > 1
    omega = np.array(frequencies)
    # The stiffness over the fast pole is the slow one without cancellation.
    fast = -(eta * omega**2 / 2) * (1 + np.sqrt(1 - (2 / (eta * omega)) ** 2))
    poles = np.random.default_rng(seed).permutation(np.concatenate([fast, omega**2 / fast]))
    if len(np.unique(poles)) < len(poles):
        return
    pairs, left = real_pairs(poles.astype(complex), range(len(poles)), overdamped=True)
    assert left == []
    products = np.sort([poles[i] * poles[k] for i, k in pairs])
    np.testing.assert_allclose(products, np.sort(omega**2), rtol=1e-9)
    assert all(abs(poles[i]) > abs(poles[k]) for i, k in pairs)


@given(st.lists(st.floats(-1e3, -1e-3), min_size=0, max_size=7, unique=True), st.booleans())
@settings(deadline=None, max_examples=60, derandomize=True)
def test_every_real_pole_is_in_one_pair_or_left_over(poles: list[float], overdamped: bool) -> None:
    values = np.array([*poles, -1 + 2j, -1 - 2j])
    pairs, left = real_pairs(values, range(len(values)), overdamped=overdamped)
    members = [i for pair in pairs for i in pair] + left
    assert sorted(members) == list(range(len(poles)))
    assert len(left) == len(poles) % 2
    if left:
        sizes = np.abs(poles)
        assert sizes[left[0]] == (sizes.min() if overdamped else sizes.max())
    assert conjugate_pairs(values, range(len(values))) == [(len(poles), len(poles) + 1)]


@given(st.integers(2, 9), st.floats(1e-3, 1.0), st.integers(0, 1000), st.floats(-9, 9))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_clusters_depend_on_neither_order_nor_unit(
    n: int, width: float, seed: int, decades: float
) -> None:
    rng = np.random.default_rng(seed)
    poles = rng.normal(size=n) + 1j * rng.normal(size=n)
    order = rng.permutation(n)
    first = {frozenset(group.tolist()) for group in linked(near(poles, width))}
    moved = linked(near(poles[order] * 2.0 ** round(decades), width))
    assert {frozenset(order[group].tolist()) for group in moved} == first
    assert sorted(i for group in first for i in group) == list(range(n))


@pytest.mark.parametrize("chosen", [[0, 1], [2, 3]])
def test_the_subspace_of_a_cluster_is_invariant_where_eigenvectors_are_parallel(
    chosen: list[int],
) -> None:
    J = np.array([[-1.0, 1, 0, 0], [0, -1, 0, 0], [0, 0, -2, 3], [0, 0, -3, -2]])
    A, T = mixed(J, 5)
    poles = np.array([-1, -1, -2 + 3j, -2 - 3j])
    Z = invariant_basis(A, poles, chosen, "test")
    np.testing.assert_allclose(Z.T @ Z, np.eye(2), atol=1e-12)
    basis = np.linalg.qr(T[:, chosen])[0]
    np.testing.assert_allclose(Z @ Z.T, basis @ basis.T, atol=1e-6)


def test_poles_that_rounding_mixes_are_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    A, poles = np.diag([1.0, 1.0, 3.0]), np.array([1.0, 1.0, 3.0])
    assert ordered_schur(A, lambda found: found.real < 2)[2] == 2
    with pytest.raises(AccuracyError, match="reduction: the modes of the system cannot be told"):
        invariant_basis(A, poles, [0], "reduction")

    def exchanged(*_: object) -> None:
        raise np.linalg.LinAlgError("eigenvalues too close to be exchanged")

    monkeypatch.setattr("slewctl.numerics.modes.ordered_schur", exchanged)
    with pytest.raises(AccuracyError, match="modal coordinates"):
        invariant_basis(A, poles, [2], "reduction")
