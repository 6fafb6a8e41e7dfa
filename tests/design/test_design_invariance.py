"""A design must not depend on units, on coordinates or on the order of the functions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from design_problems import (
    OBJECTIVE,
    OBJECTIVES,
    TWO_SENSORS,
    Array,
    arms,
    design_model,
    design_plant,
    pole_distance,
    transfer,
    transformed,
    uniform_arm,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    Objective,
    Payload,
    Polynomial,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl.basis import Combined

POINTS = 1j * np.geomspace(0.01, 300, 200)
LENGTH_POWER = {"theta": 0, "tip": 1, "torque": 2}


def in_units(arm: Arm, length: float, mass: float, time: float) -> Arm:
    """Return `arm` with its numbers in other units: one metre is `length` of them, and so on."""
    beam, hub, payload = arm.beam, arm.hub, arm.payload
    density = mass / length
    stiffness = mass * length**3 / time**2
    inertia = mass * length**2
    return replace(
        arm,
        beam=Beam(
            beam.length * length,
            tuple(c * density for c in beam.mass_per_length),
            tuple(c * stiffness for c in beam.bending_stiffness),
        ),
        hub=Hub(hub.inertia * inertia, hub.radius * length, hub.friction * inertia / time),
        payload=Payload(payload.mass * mass, payload.inertia * inertia),
    )


def objective_in_units(objective: Objective, length: float, mass: float, time: float) -> Objective:
    unit = {"theta": 1.0, "tip": length, "torque": mass * length**2 / time**2}
    return Objective(
        {name: value * unit[name] for name, value in objective.limits.items()},
        # per √Hz: a white noise brings half a power of the time unit
        {name: value * unit[name] * np.sqrt(time) for name, value in objective.noise.items()},
    )


@given(arms(), st.sampled_from([1e-3, 1e3]), st.sampled_from([1.0, 1e3]), st.sampled_from([1, 1e3]))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_units_do_not_matter(arm: Arm, length: float, mass: float, time: float) -> None:
    plants = [
        generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS),
        generalised_plant(
            assemble(in_units(arm, length, mass, time), ClampedFree(2)),
            objective_in_units(TWO_SENSORS, length, mass, time),
        ),
    ]
    controllers = [lqg(plant) for plant in plants]
    poles = [
        np.linalg.eigvals(plant.close(controller.system).A)
        for plant, controller in zip(plants, controllers, strict=True)
    ]
    assert controllers[1].h2_cost == pytest.approx(controllers[0].h2_cost, rel=1e-9)
    assert pole_distance(poles[0], poles[1] * time) < 1e-7


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_doubled_limits_quarter_the_cost_and_keep_the_gains(objective: Objective) -> None:
    doubled = Objective({k: 2 * v for k, v in objective.limits.items()}, objective.noise)
    first, second = lqg(design_plant(3, objective)), lqg(design_plant(3, doubled))
    assert second.h2_cost == pytest.approx(first.h2_cost / 4, rel=1e-12)
    for name, gain in first.gains.items():
        np.testing.assert_allclose(second.gains[name], gain, rtol=1e-10)


def test_doubled_noises_quadruple_the_cost_and_keep_the_gains() -> None:
    doubled = Objective(OBJECTIVE.limits, {k: 2 * v for k, v in OBJECTIVE.noise.items()})
    first, second = lqg(design_plant(3)), lqg(design_plant(3, doubled))
    assert second.h2_cost == pytest.approx(4 * first.h2_cost, rel=1e-12)
    for name, gain in first.gains.items():
        np.testing.assert_allclose(second.gains[name], gain, rtol=1e-10)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_physical_and_modal_coordinates_give_one_controller(objective: Objective) -> None:
    model = design_model(3)
    plant = generalised_plant(model, objective)
    T = np.kron(np.eye(2), model.mode_shapes)
    modal, physical = lqg(plant), lqg(transformed(plant, T))
    assert physical.h2_cost == pytest.approx(modal.h2_cost, rel=1e-9)
    expected = transfer(modal.system, POINTS)
    # Physical coordinates mix ω² = 4e3 into every row and are conditioned like U², some 1e3.
    np.testing.assert_allclose(transfer(physical.system, POINTS), expected, rtol=1e-7)


@given(st.permutations(range(4)), st.lists(st.floats(-3, 3), min_size=4, max_size=4))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_permuted_and_scaled_functions_give_one_controller(
    order: list[int], decades: list[float]
) -> None:
    arm = uniform_arm()
    mixed: Array = np.eye(4)[:, order] * 10.0 ** np.array(decades)
    parent = Polynomial(4)
    first = lqg(generalised_plant(assemble(arm, parent), OBJECTIVE))
    second = lqg(generalised_plant(assemble(arm, Combined(4, parent, mixed)), OBJECTIVE))
    assert second.h2_cost == pytest.approx(first.h2_cost, rel=1e-9)
    ours, theirs = transfer(first.system, POINTS), transfer(second.system, POINTS)
    np.testing.assert_allclose(theirs, ours, rtol=1e-7)


def test_order_of_the_sensors_only_reorders_the_inputs() -> None:
    swapped = Objective(
        TWO_SENSORS.limits, {name: TWO_SENSORS.noise[name] for name in ("torque", "tip", "theta")}
    )
    first, second = (lqg(design_plant(3, o)) for o in (TWO_SENSORS, swapped))
    assert (first.sensors, second.sensors) == (("theta", "tip"), ("tip", "theta"))
    ours, theirs = transfer(first.system, POINTS), transfer(second.system, POINTS)
    np.testing.assert_allclose(theirs[:, :, ::-1], ours, rtol=1e-8)
