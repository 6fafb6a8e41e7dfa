"""Scaled coordinates: the same plant, whatever coordinates it came in, and gains taken back."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import (
    OBJECTIVES,
    TWO_SENSORS,
    Array,
    arms,
    design_model,
    pole_distance,
    transfer,
    uniform_arm,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import (
    AccuracyError,
    Arm,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    Hub,
    InputError,
    Objective,
    assemble,
    generalised_plant,
    lqg,
    lqr,
)
from slewctl.design.energy_coordinates import ScaledPlant, scaled
from slewctl.numerics.h2_norm import h2_cost

POINTS = 1j * np.geomspace(0.01, 300, 50)


def by_hand(A: Array, B2: Array | None = None) -> GeneralisedPlant:
    """Return a plant with disturbance and control on the same input, one output, one sensor."""
    n = len(A)
    b = np.eye(n)[:, -1:] if B2 is None else B2
    c = np.ones((1, n))
    system = control.StateSpace(
        A,
        np.hstack([b, np.zeros((n, 1)), b]),
        np.vstack([c, np.zeros((1, n)), c]),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
        inputs=["w_torque", "w_theta", "torque"],
        outputs=["z_theta", "z_torque", "theta"],
    )
    return GeneralisedPlant(system, ("theta",))


def mixing(n: int, seed: int) -> Array:
    """Return a random matrix of condition number 30: coordinates that mean nothing."""
    rng = np.random.default_rng(seed)
    left, _ = np.linalg.qr(rng.normal(size=(n, n)))
    right, _ = np.linalg.qr(rng.normal(size=(n, n)))
    return left @ np.diag(np.geomspace(1.0, 30.0, n)) @ right


def assert_same_plant(plant: GeneralisedPlant, found: ScaledPlant, rtol: float) -> None:
    """Compare transfer functions: only the units of control, sensors and time differ."""
    system = control.StateSpace(
        found.A,
        np.hstack([found.B1, found.B2]),
        np.vstack([found.C1, found.C2]),
        np.vstack(
            [np.hstack([np.zeros((len(found.C1), found.B1.shape[1])), found.D12]),
             np.hstack([found.D21, np.zeros((len(found.C2), 1))])]
        ),
    )  # fmt: skip
    ours = transfer(system, POINTS / found.rate)
    nz, nw = len(found.C1), found.B1.shape[1]
    ours[:, nz:] = found.sensor_unit @ ours[:, nz:]
    ours[:, :, nw:] = ours[:, :, nw:] @ np.linalg.inv(found.control_unit)
    theirs = transfer(plant.system, POINTS)
    size = np.abs(theirs).max(axis=0)
    np.testing.assert_array_less(np.abs(ours - theirs).max(axis=0), rtol * size + 1e-300)


@given(arms(), st.sampled_from(["modal", "physical", "mixed"]), st.integers(0, 5))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_scaled_plant_is_the_plant(arm: Arm, coordinates: str, seed: int) -> None:
    model = assemble(arm, ClampedFree(3))
    plant = generalised_plant(model, TWO_SENSORS)
    if coordinates == "physical":
        plant = generalised_plant(model, TWO_SENSORS, coordinates="physical")
    elif coordinates == "mixed":
        plant = plant.transformed(mixing(8, seed))
    found = scaled(plant)
    np.testing.assert_allclose(found.D12.T @ found.D12, np.eye(1), atol=1e-14)
    np.testing.assert_allclose(found.D21 @ found.D21.T, np.eye(2), atol=1e-14)
    assert found.diagonal == (coordinates == "modal")
    # The poles of mixed coordinates at zero frequency have lost half of their digits.
    assert_same_plant(plant, found, 1e-11 if coordinates != "mixed" else 1e-6)
    if arm.hub.friction == 0 or coordinates != "mixed":
        assert found.rate == pytest.approx(model.omega[0], rel=1e-4)
        expected = np.repeat([1.0, *(model.omega / model.omega[0])], 2)
        np.testing.assert_allclose(np.sort(found.omega), expected, rtol=1e-3)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_coordinates_leave_no_trace(objective: Objective) -> None:
    """Up to the modes' signs the scaled plant is the same from modal and raw coordinates."""
    model = design_model(4)
    first = scaled(generalised_plant(model, objective))
    second = scaled(generalised_plant(model, objective, coordinates="physical"))
    signs = np.sign(first.B2[5:, 0] * second.B2[5:, 0])
    turn = np.tile(signs, 2)
    for name in ("A", "B1", "B2", "C1", "C2"):
        theirs = getattr(second, name)
        if name in ("A", "B1", "B2"):
            theirs = turn[:, None] * theirs
        if name in ("A", "C1", "C2"):
            theirs = theirs * turn
        np.testing.assert_allclose(
            theirs, getattr(first, name), rtol=1e-9, atol=1e-10 * np.abs(theirs).max()
        )


@pytest.mark.parametrize("coordinates", ["modal", "physical", "mixed"])
def test_gains_and_cost_are_taken_back(coordinates: str) -> None:
    plant = generalised_plant(design_model(2), TWO_SENSORS)
    if coordinates == "physical":
        plant = generalised_plant(design_model(2), TWO_SENSORS, coordinates="physical")
    elif coordinates == "mixed":
        plant = plant.transformed(mixing(6, 3))
    s = scaled(plant)
    rng = np.random.default_rng(7)
    F, L = 0.1 * rng.normal(size=(1, 6)), 0.1 * rng.normal(size=(6, 2))
    K, Kf = s.state_feedback(F), s.observer_gain(L)
    closed = np.linalg.eigvals(plant.A - plant.B2 @ K)
    assert pole_distance(s.rate * np.linalg.eigvals(s.A - s.B2 @ F), closed) < 1e-9
    observer = np.linalg.eigvals(plant.A - Kf @ plant.C2)
    assert pole_distance(s.rate * np.linalg.eigvals(s.A - L @ s.C2), observer) < 1e-9
    # The twin in energy states is closed by the same controllers at the same cost.
    stable = lqg(generalised_plant(design_model(2), TWO_SENSORS))
    twin, twin_scaled = s.energy_plant(plant)
    np.testing.assert_array_equal(twin_scaled.state, np.eye(6))
    for loop in (plant.close(stable.system), twin.close(stable.system)):
        cost = h2_cost(*(np.asarray(getattr(loop, name)) for name in "ABC")).value
        assert cost == pytest.approx(stable.h2_cost, rel=1e-8)


def test_cost_is_rate_times_the_scaled_cost() -> None:
    plant = generalised_plant(design_model(2), TWO_SENSORS)
    s, K = scaled(plant), lqr(plant).gain
    F = np.linalg.solve(s.control_unit, K) @ s.state
    np.testing.assert_allclose(s.state_feedback(F), K, rtol=1e-12)
    ours = s.rate * h2_cost(s.A - s.B2 @ F, s.B1, s.C1 - s.D12 @ F).value
    theirs = h2_cost(plant.A - plant.B2 @ K, plant.B1, plant.C1 - plant.D12 @ K).value
    assert ours == pytest.approx(theirs, rel=1e-11)


def test_a_controller_of_the_scaled_plant_is_taken_back() -> None:
    plant = generalised_plant(design_model(2), TWO_SENSORS)
    s = scaled(plant)
    rng = np.random.default_rng(1)
    inner = control.StateSpace(
        rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(1, 3)), np.zeros((1, 2)),
        inputs=["theta", "tip"], outputs=["torque"],
    )  # fmt: skip
    outer = s.controller(inner)
    assert (outer.input_labels, outer.output_labels) == (("theta", "tip"), ("torque",))
    ours = transfer(outer, POINTS)
    theirs = s.control_unit @ transfer(inner, POINTS / s.rate) @ np.linalg.inv(s.sensor_unit)
    np.testing.assert_allclose(ours, theirs, rtol=1e-10)


@pytest.mark.parametrize(
    "blocks",
    [
        [[-1.0]],
        [[0.0, 1.0], [-4.0, -4.0]],  # critically damped
        [[0.0, 1.0], [-4.0, -4.0001]],
        [[0.0, 1.0], [-4.0, -9.0]],  # overdamped
        [[0.0, 1.0], [0.0, -7.0]],  # a rigid body with strong friction
        [[0.0, 1.0], [0.0, 0.0]],
        [[2.0]],  # unstable
    ],
)
def test_real_poles_of_all_kinds(blocks: list[list[float]]) -> None:
    """Together with a flexible mode, in coordinates that mean nothing."""
    first = np.array(blocks)
    k = len(first)
    A = np.zeros((k + 2, k + 2))
    A[:k, :k], A[k:, k:] = first, [[0, 1], [-9.0, -0.03]]
    b = np.zeros((k + 2, 1))
    b[k - 1], b[-1] = 1.0, -0.7
    plant = by_hand(A, b).transformed(mixing(k + 2, 2))
    found = scaled(plant)
    assert found.residual < 1e-12
    assert_same_plant(plant, found, 1e-6)
    assert np.linalg.cond(found.state) < 1e4


def test_a_rigid_body_alone() -> None:
    plant = by_hand(np.array([[0.0, 1.0], [0.0, 0.0]]))
    found = scaled(plant)
    np.testing.assert_array_equal(found.omega, [1.0, 1.0])
    assert_same_plant(plant, found, 1e-12)


def test_a_plant_without_penalty_or_noise_is_refused() -> None:
    plant = by_hand(np.array([[0.0, 1.0], [-1.0, -0.1]]))
    free, silent = plant.system.D.copy(), plant.system.D.copy()
    free[1, 2], silent[2, 1] = 0.0, 0.0
    for D, match in ((free, "torque has no penalty"), (silent, "no noise of its own")):
        s = plant.system
        bare = control.StateSpace(s.A, s.B, s.C, D, inputs=s.input_labels, outputs=s.output_labels)
        with pytest.raises(DesignError, match=match):
            scaled(replace(plant, system=bare))


def test_two_rigid_bodies_are_refused() -> None:
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[5, 2] = -4.0
    with pytest.raises(AccuracyError, match="more than one motion without stiffness"):
        scaled(by_hand(A))


def test_a_plant_must_be_one() -> None:
    with pytest.raises(InputError, match="not a GeneralisedPlant"):
        scaled("plant")


@pytest.mark.parametrize("T", [np.eye(3), np.zeros((4, 4)), np.full((4, 4), np.nan)])
def test_transformed_refuses_what_is_no_change_of_coordinates(T: Array) -> None:
    plant = generalised_plant(assemble(uniform_arm(), ClampedFree(1)), OBJECTIVES[0])
    with pytest.raises(InputError, match="not an invertible matrix"):
        plant.transformed(T)


def test_transformed_keeps_what_the_plant_is_of() -> None:
    model = assemble(replace(uniform_arm(), hub=Hub(1.0)), ClampedFree(2))
    plant = generalised_plant(model, TWO_SENSORS)
    turned = plant.transformed(mixing(6, 1))
    assert turned.model is model
    assert turned.objective is TWO_SENSORS
    assert turned.sensors == plant.sensors
    np.testing.assert_allclose(
        transfer(turned.system, POINTS), transfer(plant.system, POINTS), rtol=1e-7
    )
