"""Random linear systems of any size, static ones among them."""

from __future__ import annotations

import control
import numpy as np
from hypothesis import strategies as st

from slewctl.numerics.linear_system import LinearSystem

COUNTS = st.integers(1, 3)
STATES = st.integers(0, 4)
SEEDS = st.integers(0, 10**6)
# Points of the plane far from the poles of matrices with entries of size one, and near them.
POINTS = (9.0 + 2.0j, 0.4j, -0.3 + 7.0j)


def random_system(
    seed: int, states: int, inputs: int, outputs: int, dt: float | None = 0.0
) -> LinearSystem:
    """Return a system with every matrix filled and signals named by its seed."""
    rng = np.random.default_rng((seed, states, inputs, outputs))
    shapes = ((states, states), (states, inputs), (outputs, states), (outputs, inputs))
    return LinearSystem(
        *(rng.normal(size=shape) for shape in shapes), dt,
        inputs=[f"u{seed}_{i}" for i in range(inputs)],
        outputs=[f"y{seed}_{i}" for i in range(outputs)],
    )  # fmt: skip


def polynomial(A: np.ndarray) -> np.ndarray:
    """Return the characteristic polynomial; that of no states is one."""
    return np.poly(np.asarray(A)) if len(A) else np.ones(1)


def assert_same(ours: LinearSystem, theirs: control.StateSpace, digits: float = 1e-9) -> None:
    """Assert the same poles and the same response; the order of the states is nobody's matter."""
    assert (ours.nstates, ours.ninputs, ours.noutputs) == (
        theirs.nstates, theirs.ninputs, theirs.noutputs,
    )  # fmt: skip
    assert ours.dt == theirs.dt
    # A characteristic polynomial is as exact as the matrix, where its multiple roots are not.
    found, expected = (polynomial(system.A) for system in (ours, theirs))
    np.testing.assert_allclose(found, expected, rtol=0, atol=digits * np.abs(expected).max())
    for s in POINTS:
        right = np.asarray(theirs(s, squeeze=False))
        solved = np.linalg.solve(s * np.eye(ours.nstates) - ours.A, ours.B.astype(complex))
        size = np.abs(ours.C) @ np.abs(solved) + np.abs(ours.D) + np.abs(right)
        assert np.all(np.abs(ours.C @ solved + ours.D - right) <= digits * size.max())
