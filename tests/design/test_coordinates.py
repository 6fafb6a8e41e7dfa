"""Every controller leaves in coordinates in which A, B and C are of comparable size."""

from __future__ import annotations

import control
import numpy as np
import pytest
from design_problems import design_plant
from general_plants import made, random_plant, seeds
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import h2_lmi, lqg
from slewctl.design.coordinates import balanced


@given(seeds, st.integers(1, 8), st.floats(0, 8))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_balancing_changes_no_digit(seed: int, n: int, decades: float) -> None:
    rng = np.random.default_rng(seed)
    scale = 10 ** rng.uniform(-decades, decades, n)
    A, B, C = (rng.normal(size=shape) for shape in ((n, n), (n, 2), (1, n)))
    given_ = control.ss(A / scale[:, None] * scale, B / scale[:, None], C * scale, [[0.5, 0.0]])
    found, s = balanced(given_)
    assert np.all(np.frexp(s)[0] == 0.5)
    np.testing.assert_array_equal(np.asarray(found.A) * s[:, None] / s, given_.A)
    np.testing.assert_array_equal(np.asarray(found.B) * s[:, None], given_.B)
    np.testing.assert_array_equal(np.asarray(found.C) / s, given_.C)
    np.testing.assert_array_equal(found.D, given_.D)
    b, c = (np.linalg.norm(m) for m in (found.B, found.C))
    # Powers of two, and A's own balance comes in: within a decade or so.
    assert 1 / 30 < b / c < 30


@given(seeds, st.floats(0, 6))
@settings(deadline=None, max_examples=10, derandomize=True)
def test_controllers_are_balanced_whatever_the_plants_states(seed: int, decades: float) -> None:
    p = random_plant(seed)
    rng = np.random.default_rng(seed)
    found = lqg(p.transformed(np.diag(2.0 ** np.round(rng.uniform(-decades, decades, 3) * 3))))
    best = lqg(p)
    for name in "ABC":
        sizes = [np.linalg.norm(getattr(k.system, name)) for k in (found, best)]
        assert sizes[0] == pytest.approx(sizes[1], rel=1)
    s = 1j * np.array([0.1, 1, 10])
    np.testing.assert_allclose(
        found.system(s, squeeze=True), best.system(s, squeeze=True), rtol=1e-6
    )


def test_scale_takes_the_states_back_to_estimates() -> None:
    plant = design_plant(2)
    found = lqg(plant)
    s, system = found.state_scale, found.system
    K = found.gains["state_feedback"]
    np.testing.assert_allclose(-np.asarray(system.C) / s, K, rtol=1e-14)
    np.testing.assert_allclose(
        np.asarray(system.B) * s[:, None], found.gains["observer"], rtol=1e-14
    )
    reference = found.reference
    assert reference is not None
    # Driven by the same u as the arm, the estimate follows the command without error.
    np.testing.assert_allclose(reference.B * s[:, None], plant.B2 @ reference.D, rtol=1e-12)


def test_inequalities_on_a_plant_without_an_arm_leave_in_usable_coordinates() -> None:
    A = np.array([[-1.0, 2, 0], [-2, -1, 1], [0, 0, -3]])
    B = 1e-8 * np.array([[1.0, 0, 1], [0, 0, 1], [1, 0, 1]])
    C = np.array([[1e8, 0, 0], [0, 0, 0], [1e8, 1e8, 0]])
    found = h2_lmi(made(A, B, C, np.array([[0, 0, 0], [0, 0, 1], [0, 1.0, 0]])))
    b, c = (np.linalg.norm(m) for m in (found.system.B, found.system.C))
    assert 0.01 < b / c < 100
    s = 1j * np.geomspace(1e-3, 1e3, 20001)
    peak = np.abs(found.system(s, squeeze=True)).max()
    assert control.system_norm(found.system, "inf") == pytest.approx(peak, rel=1e-5)
