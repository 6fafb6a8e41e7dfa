"""A step in the reference angle is followed without steady error, by every design."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_examples import OBJECTIVE, TWO_SENSORS, uniform_arm
from strategies import arms, deterministic

from slewctl import (
    Arm,
    ClampedFree,
    Controller,
    GeneralisedPlant,
    InputError,
    Objective,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.arm import Motor
from slewctl.design import METHODS, options
from slewctl.design import given as designed_elsewhere
from slewctl.design.reference import at_rest

MOTOR = Motor(2.0, 0.05, 0.05, gear_ratio=20.0, gear_efficiency=0.9, motor_efficiency=0.8)
VOLTAGE = Objective(
    {"tip": 0.1, "voltage": 10.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.05}
)
BENDING_TOO = Objective(TWO_SENSORS.limits, {**TWO_SENSORS.noise, "tip_deflection": 0.01})
TIP_ALONE = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "tip": 0.01})
CLOCKS = [{}, {"integral_limit": 0.5}, {"sample_time": 0.02}, {"sample_time": 0.02, "delay": 0.05},
          {"sample_time": 0.02, "delay": 0.013, "integral_limit": 0.5}]  # fmt: skip


def driven_arm() -> Arm:
    return replace(uniform_arm(friction=0.2), motor=MOTOR)


def steady(system: control.StateSpace) -> np.ndarray:
    """Return the response to a constant input, of a continuous or a sampled system."""
    settled = np.eye(system.nstates) - system.A if system.dt else -np.asarray(system.A)
    return np.asarray(system.C @ np.linalg.solve(settled, system.B) + system.D)


def assert_followed(loop_tracking: control.StateSpace, reach: float, actuator: str) -> None:
    assert loop_tracking.input_labels == ["theta_ref"]
    assert loop_tracking.output_labels == ["theta", "tip", actuator]
    np.testing.assert_allclose(steady(loop_tracking)[:, 0], [1.0, reach, 0.0], rtol=1e-9, atol=1e-9)


# Wishes without which some methods have nothing to go by.
WISHES: dict[str, object] = {
    "bandwidth_hz": 0.2,
    "crossover_hz": 0.2,
    "decay_rate_min": 0.01,
    "hinf_max": 1e6,
    "weight_hz": 1.0,
    "payload_mass": [0.0, 0.01],
    "std_max": {"torque": 1e3},
    "pid": {"kp": 1.0, "kd": 1.0, "filter_hz": 10.0},
}


@pytest.mark.parametrize("method", METHODS)
def test_every_method_follows_a_step(method: str) -> None:
    model = assemble(uniform_arm(friction=0.1), ClampedFree(2))
    plant = generalised_plant(model, BENDING_TOO)
    wishes = {name: WISHES[name] for name in options(method) if name in WISHES}
    controller = METHODS[method](plant, **wishes)
    assert_followed(close(model, BENDING_TOO, controller).tracking, 1.1, "torque")


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize(
    ("arm", "objective"),
    [(uniform_arm(), OBJECTIVE), (uniform_arm(friction=0.3), TWO_SENSORS), (driven_arm(), VOLTAGE)],
    ids=["free", "friction", "voltage"],
)
def test_every_clock_follows_a_step_on_the_truth(
    arm: Arm, objective: Objective, clock: dict
) -> None:
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(3)), objective), **clock)
    loop = close(truth(arm, 8), objective, controller)
    assert_followed(loop.tracking, 1.1, objective.actuator)


def test_without_the_angle_the_tip_tells() -> None:
    arm = uniform_arm()
    for clock in ({}, {"sample_time": 0.02}):
        model = assemble(arm, ClampedFree(3))
        controller = lqg(generalised_plant(model, TIP_ALONE), **clock)
        assert_followed(close(model, TIP_ALONE, controller).tracking, 1.1, "torque")


@given(arms(damping=True))
@deterministic(10)
def test_state_at_rest_is_an_equilibrium_at_the_angle(arm: Arm) -> None:
    plant = generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS)
    found = at_rest(plant)
    assert found is not None
    state, effort = found
    readings = plant.C2 @ state
    np.testing.assert_allclose(readings[:, 0], [1.0, 0.0], atol=1e-9)
    assert abs(effort) < 1e-9
    rates = plant.A @ state
    assert np.abs(rates).max() < 1e-9 * np.abs(plant.A).max() * np.abs(state).max()


def test_a_spring_on_the_hub_is_held_by_the_input() -> None:
    """ẍ = −4x + 2u: at 1 rad the input is 2 (a plant made by hand, without a model)."""
    system = control.StateSpace(
        [[0, 1], [-4, -0.1]], [[0, 0, 0], [1, 0, 2]], [[1, 0], [0, 0], [1, 0]],
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
        inputs=["w_torque", "w_theta", "torque"], outputs=["z_theta", "z_torque", "theta"],
    )  # fmt: skip
    plant = GeneralisedPlant(system, ("theta",))
    found = at_rest(plant)
    assert found is not None
    np.testing.assert_allclose(found[0], [[1.0], [0.0]], atol=1e-14)
    assert found[1] == pytest.approx(2.0, rel=1e-14)
    for clock in CLOCKS:
        tracking = lqg(plant, **clock).tracking
        G, K = plant.control_path, tracking
        if clock.get("sample_time"):
            G = control.StateSpace(plant.A, plant.B2, plant.C2, 0).sample(0.02)
        g = steady(G)[0, 0]
        if "integral_limit" in clock:
            continue  # the integral alone sees to it
        feedback, reference = steady(K)[0]
        assert g * reference / (1 - g * feedback) == pytest.approx(1.0, rel=1e-9)


def test_the_reference_excites_no_estimation_error() -> None:
    """From the reference the loop is that of the state feedback: the observer's poles cancel."""
    arm = uniform_arm()
    model = assemble(arm, ClampedFree(2))
    plant = generalised_plant(model, OBJECTIVE)
    controller = lqg(plant)
    K = controller.gains["state_feedback"]
    found = at_rest(plant)
    assert found is not None
    theta = plant.C2[0]
    tracking = close(model, OBJECTIVE, controller).tracking
    for omega in (0.1, 1.0, 4.0, 20.0):
        s = 1j * omega * np.eye(len(plant.A))
        ideal = theta @ np.linalg.solve(s - plant.A + plant.B2 @ K, plant.B2 @ (K @ found[0]))
        assert tracking(1j * omega)[0, 0] == pytest.approx(ideal[0], rel=1e-8)


@given(st.floats(0.5, 20.0), st.sampled_from([0.0, 0.1, 0.5]), st.sampled_from([0.0, 0.004, 0.01]))
@deterministic(10)
def test_a_controller_designed_elsewhere_is_given_the_error(
    gain: float, friction: float, T: float
) -> None:
    """PD from ideal angle and rate, continuous or sampled."""
    arm = uniform_arm(damping_ratio=0.02, friction=friction)
    model = assemble(arm, ClampedFree(2))
    pd = control.StateSpace(
        [], [], [], [[-gain, -np.sqrt(gain)]], T, inputs=["theta", "theta_dot"], outputs=["torque"]
    )
    loop = close(model, TWO_SENSORS, pd, sign=1)
    assert loop.stable
    assert_followed(loop.tracking, 1.1, "torque")


def test_what_has_no_reference_says_so() -> None:
    system = control.StateSpace([], [], [], [[-1.0]], inputs=["theta"], outputs=["torque"])
    with pytest.raises(InputError, match="how the reference angle enters"):
        _ = designed_elsewhere(system, feedback="positive").tracking


def test_unstable_loop_follows_nothing() -> None:
    model = assemble(uniform_arm(), ClampedFree(1))
    wrong = control.StateSpace([], [], [], [[1.0]], inputs=["theta"], outputs=["torque"])
    with pytest.raises(UnstableLoopError, match="response to the reference"):
        _ = close(model, OBJECTIVE, wrong, sign=1).tracking


def test_tracking_controller_without_reference_is_the_controller() -> None:
    controller: Controller = lqg(
        generalised_plant(assemble(uniform_arm(), ClampedFree(2)), OBJECTIVE)
    )
    assert controller.tracking.input_labels == ["theta", "theta_ref"]
    np.testing.assert_array_equal(controller.tracking.B[:, :1], controller.system.B)
    np.testing.assert_array_equal(controller.tracking.A, controller.system.A)
