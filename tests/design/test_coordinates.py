"""Every controller leaves in coordinates in which A, B and C are of comparable size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import design_plant
from general_plants import made, random_plant, seeds
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import (
    Arm,
    Beam,
    Hub,
    Problem,
    h2_lmi,
    lqg,
    pole_placement,
    variance_bound,
)
from slewctl.design import Controller
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


@pytest.mark.parametrize("power", [20, 25])
@pytest.mark.parametrize(
    ("method", "options"),
    [
        (variance_bound, {"std_max": {"torque": 0.3}}),
        (h2_lmi, {}),
        (pole_placement, {"bandwidth_hz": 0.3}),
    ],
)
def test_an_angle_beside_a_rate_in_other_units_is_the_same_plant(
    power: int, method: Callable[..., Controller], options: dict[str, object]
) -> None:
    """Nothing in A tells the unit of a rigid rate from that of its angle, rad from µrad."""
    plant = small_problem().plant("clamped-free", n=1)
    other = np.eye(4)
    other[2, 2] = 2.0**power
    here, there = method(plant, **options), method(plant.transformed(other), **options)
    assert there.certificate.verified
    assert there.h2_cost == pytest.approx(here.h2_cost, rel=1e-6)


@given(st.floats(-4, 4))
@settings(deadline=None, max_examples=8, derandomize=True)
def test_poles_of_several_sensors_are_placed_alike_in_any_unit_of_time(decades: float) -> None:
    unit = 10.0**decades
    here = pole_placement(small_problem().plant("arm-matched", n=2), bandwidth_hz=0.5)
    there = pole_placement(small_problem(unit).plant("arm-matched", n=2), bandwidth_hz=0.5 / unit)
    assert there.h2_cost == pytest.approx(here.h2_cost, rel=1e-7)


def small_problem(unit: float = 1.0) -> Problem:
    """Return a beam with two sensors, its seconds counted as so many."""
    arm = Arm(Beam(1.0, 1.0, 2.0 / unit**2), Hub(0.2), damping_ratio=0.01)
    noise = {"torque": 0.1 / unit**1.5, "theta": 0.01 * unit**0.5, "theta_dot": 0.1 / unit**0.5}
    return Problem(arm, {"tip": 0.03, "torque": 1.0 / unit**2}, noise)


def test_poles_of_several_sensors_do_not_depend_on_the_order_of_their_names() -> None:
    noise = {"torque": 0.1, "theta": 0.01, "tip": 0.02}
    costs = []
    for items in (list(noise.items()), list(noise.items())[::-1]):
        problem = replace(small_problem(), noise=dict(items))
        plant = problem.plant("arm-matched", n=2)
        costs.append(pole_placement(plant, bandwidth_hz=0.5, added_damping=0.05).h2_cost)
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)
