"""The motor's voltage as the input of state-space models and generalised plants."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from strategies import arms, deterministic

from slewctl.arm import Arm, Hub, Motor
from slewctl.basis import ClampedFree, Polynomial, Slewing
from slewctl.design import lqg
from slewctl.errors import InputError
from slewctl.loop import close
from slewctl.model import assemble, truth
from slewctl.plant import Objective, generalised_plant, state_space

EPS = np.finfo(float).eps
MOTOR = Motor(2.6, 7.68e-3, 7.68e-3, 70.0, 0.9, 0.69)
LIMITS = {"tip": 0.02, "voltage": 6.0}
NOISE = {"torque": 0.05, "theta": 1e-3}


@pytest.fixture
def driven_arm(full_arm: Arm) -> Arm:
    return replace(full_arm, motor=MOTOR)


@given(arms(damping=True), st.sampled_from([ClampedFree(3), Slewing(3), Polynomial(3)]))
@deterministic(30)
def test_voltage_is_scaled_torque_with_the_back_emf_as_friction(arm: Arm, basis: object) -> None:
    """B → ηgKgηmkt/Rm · B, and the friction at the hub grows by the back-EMF's."""
    braked = Hub(arm.hub.inertia, arm.hub.radius, arm.hub.friction + MOTOR.back_emf_damping)
    for coordinates in ("physical", "modal"):
        ours = state_space(
            assemble(replace(arm, motor=MOTOR), basis), input="voltage", coordinates=coordinates
        )
        expected = state_space(assemble(replace(arm, hub=braked), basis), coordinates=coordinates)
        for name, factor in (("A", 1.0), ("B", MOTOR.torque_per_volt), ("C", 1.0), ("D", 1.0)):
            value = factor * np.asarray(getattr(expected, name))
            size = max(np.abs(value).max(), EPS)
            assert_allclose(getattr(ours, name), value, rtol=0, atol=16 * EPS * size)


@pytest.mark.parametrize("omega", [0.1, 3.0, 40.0])
def test_voltage_closes_the_back_emf_around_the_torque(driven_arm: Arm, omega: float) -> None:
    """G_V = gG/(1 + g Kg km G_θ̇), with G from the torque model of the same arm."""
    model = truth(driven_arm, 5)
    outputs = ["theta_dot", "tip", "tip_acceleration"]
    G = np.asarray(state_space(model, outputs, coordinates="modal")(1j * omega)).ravel()
    ours = state_space(model, outputs, input="voltage", coordinates="modal")(1j * omega)
    expected = MOTOR.torque_per_volt * G / (1 + MOTOR.back_emf_damping * G[0])
    assert_allclose(np.asarray(ours).ravel(), expected, rtol=1e-9)


def test_steady_speed_is_that_of_the_unloaded_motor(driven_arm: Arm) -> None:
    """Without friction the hub turns at V/(Kg km), whatever the efficiencies."""
    arm = replace(driven_arm, hub=Hub(0.7, 0.12))
    plant = state_space(assemble(arm, Slewing(2)), ["theta_dot"], input="voltage")
    speed = np.asarray(plant(1e-7j)).item()
    assert abs(speed) == pytest.approx(1 / (70 * 7.68e-3), rel=1e-9)


def test_input_is_named_and_sampled(driven_arm: Arm) -> None:
    model = assemble(driven_arm, Slewing(2))
    plant = state_space(model, ["theta"], input="voltage", sample_time=0.01)
    assert plant.input_labels == ["voltage"]
    continuous = state_space(model, ["theta"], input="voltage")
    expected = continuous.sample(0.01, method="zoh")
    assert_array_equal(plant.A, expected.A)
    assert_array_equal(plant.B, expected.B)
    gain = control.ss([], [], [], [[-4.0]], inputs=["theta"], outputs=["voltage"])
    loop = control.interconnect([continuous, gain], inputs=["voltage"], outputs=["theta"])
    assert_allclose(loop.A, continuous.A - 4.0 * continuous.B @ continuous.C, rtol=0, atol=1e-11)


def test_torque_input_knows_no_back_emf(full_arm: Arm, driven_arm: Arm) -> None:
    """Under current control the motor adds nothing but its rotor."""
    with_motor, without = (state_space(assemble(arm, Slewing(2))) for arm in (driven_arm, full_arm))
    assert_array_equal(with_motor.A, without.A)
    assert_array_equal(with_motor.B, without.B)


def test_voltage_of_an_arm_without_a_motor_is_refused(full_arm: Arm) -> None:
    model = assemble(full_arm, Slewing(2))
    with pytest.raises(InputError, match="full arm has no motor") as error:
        state_space(model, input="voltage")
    assert "use the torque" in error.value.remedy
    with pytest.raises(InputError, match="no motor"):
        generalised_plant(model, Objective(LIMITS, NOISE))


@pytest.mark.parametrize("name", ["voltge", "current", 3, None])
def test_unknown_inputs_are_refused(name: object, driven_arm: Arm) -> None:
    with pytest.raises(InputError, match=r"voltage") as error:
        state_space(assemble(driven_arm, Slewing(1)), input=name)
    assert error.value.where == "input"


def test_objective_names_its_actuator() -> None:
    assert Objective(LIMITS, NOISE).actuator == "voltage"
    assert Objective({"tip": 0.1, "torque": 1.0}, NOISE).actuator == "torque"
    assert Objective(LIMITS, NOISE).performance == ("tip",)
    assert Objective(LIMITS, NOISE).sensors == ("theta",)


@pytest.mark.parametrize(
    ("fields", "where", "message"),
    [
        ({"limits": {**LIMITS, "torque": 1.0}}, "limits", "both voltage and torque; keep the one"),
        ({"limits": {"tip": 0.1}}, "limits", "no value for torque; add limits.torque, or limits.v"),
        ({"limits": {"voltage": 1.0}}, "limits", "no output"),
        ({"limits": {**LIMITS, "voltage": 0.0}}, "limits.voltage", "not positive"),
        ({"noise": {**NOISE, "voltage": 1.0}}, "noise", "unknown name 'voltage'"),
        ({"noise": {"voltage": 1.0, "theta": 1.0}}, "noise", "unknown name .voltage."),
    ],
)
def test_wrong_objectives_of_a_voltage_are_refused(
    fields: dict[str, dict[str, float]], where: str, message: str
) -> None:
    with pytest.raises(InputError, match=message) as error:
        Objective(**{"limits": LIMITS, "noise": NOISE, **fields})
    assert error.value.where == where
    assert error.value.remedy


def test_generalised_plant_controls_the_voltage_and_is_disturbed_by_torque(
    driven_arm: Arm,
) -> None:
    model = assemble(driven_arm, Slewing(3))
    plant = generalised_plant(model, Objective(LIMITS, NOISE))
    volts = state_space(model, ["tip", "theta"], input="voltage", coordinates="modal")
    torque = state_space(model, ["tip", "theta"], coordinates="modal")
    assert plant.actuator == "voltage"
    assert plant.system.input_labels == ["w_torque", "w_theta", "voltage"]
    assert plant.system.output_labels == ["z_tip", "z_voltage", "theta"]
    assert_array_equal(plant.A, volts.A)
    assert_array_equal(plant.B2, volts.B)
    assert_allclose(plant.B1[:, :1], 0.05 * torque.B, rtol=4 * EPS)
    assert_array_equal(plant.D12, [[0], [1 / 6.0]])
    path = plant.control_path
    assert path.input_labels == ["voltage"]
    assert path.output_labels == ["theta"]


def test_motor_without_back_emf_is_a_change_of_units(full_arm: Arm) -> None:
    """km = 0: a limit in volts is one in N·m, and the optimal controllers differ by the gain."""
    motor = replace(MOTOR, back_emf_constant=0.0)
    model = assemble(replace(full_arm, motor=motor), ClampedFree(3))
    gain = motor.torque_per_volt
    volts = lqg(generalised_plant(model, Objective({"tip": 0.02, "voltage": 6.0}, NOISE)))
    newtons = lqg(generalised_plant(model, Objective({"tip": 0.02, "torque": 6.0 * gain}, NOISE)))
    assert volts.h2_cost == pytest.approx(newtons.h2_cost, rel=1e-9)
    assert_allclose(
        volts.gains["state_feedback"] * gain, newtons.gains["state_feedback"], rtol=1e-6
    )


def test_lqg_on_the_voltage_closes_on_the_truth(driven_arm: Arm) -> None:
    objective = Objective(LIMITS, NOISE)
    controller = lqg(generalised_plant(assemble(driven_arm, ClampedFree(3)), objective))
    assert controller.certificate.verified
    assert controller.system.output_labels == ["voltage"]
    loop = close(truth(driven_arm, 10), objective, controller)
    assert loop.stable
    assert loop.margins.confirmed
    assert loop.return_ratio.input_labels == ["voltage"]
    assert loop.return_ratio.output_labels == ["returned_voltage"]
    assert loop.h2.discrepancy < 1e-6


def test_controller_of_the_other_actuator_is_refused(driven_arm: Arm) -> None:
    model = assemble(driven_arm, ClampedFree(2))
    volts, newtons = (Objective({"tip": 0.02, name: 3.0}, NOISE) for name in ("voltage", "torque"))
    controller = lqg(generalised_plant(model, newtons))
    with pytest.raises(InputError, match="commands 'torque'") as error:
        generalised_plant(model, volts).close(controller.system)
    assert error.value.where == "close"
    with pytest.raises(InputError, match="'torque', the objective limits 'voltage'"):
        close(model, volts, controller)
