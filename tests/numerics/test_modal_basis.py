"""Coordinates of modes, of matrices whose poles at the origin are exactly there."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl._types import Array
from slewctl.numerics.modal_basis import modal_bases

EPS = np.finfo(float).eps


def integrators(seed: int, count: int, modes: int = 8) -> Array:
    """Return integrators that read each other and light modes, their states in any order."""
    rng, n = np.random.default_rng(seed), 2 * modes
    flexible = 0.1 * np.triu(rng.standard_normal((n, n)), 2)
    for i, (w, ratio) in enumerate(
        zip(rng.uniform(0.05, 2, modes), 10 ** rng.uniform(-3, -1, modes), strict=True)
    ):
        flexible[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[-ratio * w, w], [-w, -ratio * w]]
    weak = 10 ** rng.uniform(-2, 0, (count, count))
    chain = np.triu(rng.uniform(-1, 1, (count, count)) * weak, 1)
    A = np.block([[chain, rng.standard_normal((count, n))], [np.zeros((n, count)), flexible]])
    order = rng.permutation(len(A))
    return A[np.ix_(order, order)]


@given(st.integers(0, 10_000), st.integers(2, 3))
@settings(max_examples=40, deadline=None)
def test_integrators_are_at_the_origin_and_modes_leave_rounding_alone(
    seed: int, count: int
) -> None:
    A = integrators(seed, count)
    ((_, found),) = modal_bases(A[None])
    V, J = found.V[0], found.J[0]
    assert np.count_nonzero(np.diagonal(J) == 0) == count
    left = np.linalg.norm(A @ V - V @ J)
    assert left < 10 * len(A) * EPS * np.linalg.norm(A) * np.linalg.norm(V)
