"""Invariant subspaces of chosen eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.numerics.ordered_schur import nearest_of, ordered_complex_schur, ordered_schur


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_the_chosen_eigenvalues_come_first(n: int, seed: int) -> None:
    A: Array = np.random.default_rng(seed).standard_normal((n, n))
    stable = np.linalg.eigvals(A)
    stable = stable[stable.real < 0]
    T, Z, k = ordered_schur(A, lambda poles: poles.real < 0)
    assert k == len(stable)
    np.testing.assert_allclose(Z @ T @ Z.T, A, atol=1e-12)
    np.testing.assert_allclose(A @ Z[:, :k], Z[:, :k] @ T[:k, :k], atol=1e-12)
    found = np.linalg.eigvals(T[:k, :k])
    np.testing.assert_allclose(np.sort(found.real), np.sort(stable.real), atol=1e-6)
    assert not np.tril(T, -2).any()


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_one_of_a_pair_takes_the_other_along_unless_arithmetic_is_complex(
    n: int, seed: int
) -> None:
    A: Array = np.random.default_rng(seed).standard_normal((n, n))
    values = np.linalg.eigvals(A).astype(complex)
    one = int(np.argmax(values.imag))
    pair = bool(values[one].imag > 0)
    assert ordered_schur(A, nearest_of(values, [one]))[2] == 1 + pair
    T, Z, k = ordered_complex_schur(A, nearest_of(values, [one]))
    assert k == 1
    np.testing.assert_allclose(T[0, 0], values[one], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(A @ Z[:, :1], Z[:, :1] * T[0, 0], atol=1e-12)


def test_an_interruption_while_choosing_passes_nothing_but_itself(
    capfd: pytest.CaptureFixture[str],
) -> None:
    def interrupted(poles: ComplexArray) -> BoolArray:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ordered_schur(np.eye(3), interrupted)
    assert capfd.readouterr() == ("", "")


def test_no_states() -> None:
    assert ordered_schur(np.zeros((0, 0)), lambda poles: poles.real < 0)[2] == 0
