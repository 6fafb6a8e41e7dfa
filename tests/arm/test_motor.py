"""The DC motor with its gear: refusals, conversions, and Quanser's published figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl.arm import Arm, Beam, Hub, Motor, Payload
from slewctl.basis import Polynomial
from slewctl.errors import InputError
from slewctl.model import assemble
from slewctl.numerics.matrix_equations import solve_riccati
from slewctl.plant import state_space

EPS = np.finfo(float).eps
# Quanser Inc., Rotary Servo Base Unit (SRV02) user manual, high-gear configuration.
SRV02 = Motor(
    resistance=2.6,
    torque_constant=7.68e-3,
    back_emf_constant=7.68e-3,
    gear_ratio=70.0,
    gear_efficiency=0.9,
    motor_efficiency=0.69,
)
POSITIVE = [
    "resistance",
    "torque_constant",
    "gear_ratio",
    "gear_efficiency",
    "motor_efficiency",
    "torque_limit",
    "voltage_limit",
]
magnitudes = st.floats(1e-4, 1e3)
fractions = st.floats(0.05, 1.0)


@st.composite
def motors(draw: st.DrawFn) -> Motor:
    efficiencies = draw(fractions), draw(fractions)
    return Motor(*(draw(magnitudes) for _ in range(4)), *efficiencies, draw(st.floats(0, 1e-2)))


@pytest.mark.parametrize("field", [*POSITIVE, "back_emf_constant", "rotor_inertia"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e-9, True, "1", [1.0]])
def test_impossible_values_are_refused(field: str, value: object) -> None:
    with pytest.raises(InputError) as error:
        replace(SRV02, **{field: value})
    assert error.value.where == f"motor.{field}"
    assert error.value.remedy


@pytest.mark.parametrize("field", POSITIVE)
def test_zero_is_refused_where_it_would_stop_the_motor(field: str) -> None:
    with pytest.raises(InputError, match="not positive"):
        replace(SRV02, **{field: 0.0})


@pytest.mark.parametrize("field", ["gear_efficiency", "motor_efficiency"])
def test_efficiency_above_one_is_refused(field: str) -> None:
    with pytest.raises(InputError, match="greater than 1"):
        replace(SRV02, **{field: 1.01})
    assert getattr(replace(SRV02, **{field: 1}), field) == 1.0


@given(motors(), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
@deterministic(60)
def test_voltage_and_torque_are_inverse(motor: Motor, torque: float, rate: float) -> None:
    voltage = motor.voltage(torque, rate)
    # Back-EMF and supply cancel in the torque: rounding is relative to the larger of them.
    size = motor.torque_per_volt * (abs(voltage) + motor.volts_per_rate * abs(rate))
    assert motor.torque(voltage, rate) == pytest.approx(torque, rel=0, abs=8 * EPS * size)


@given(motors(), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
@deterministic(60)
def test_torque_is_that_of_the_circuit(motor: Motor, voltage: float, rate: float) -> None:
    """Kirchhoff's law for the current, the gear for the rate and the torque."""
    current = (voltage - motor.back_emf_constant * motor.gear_ratio * rate) / motor.resistance
    shaft = motor.motor_efficiency * motor.torque_constant * current
    size = abs(voltage) + motor.volts_per_rate * abs(rate)
    expected = motor.gear_efficiency * motor.gear_ratio * shaft
    tolerance = 16 * EPS * motor.torque_per_volt * size
    assert motor.torque(voltage, rate) == pytest.approx(expected, rel=0, abs=tolerance)


@given(motors())
@deterministic(60)
def test_short_circuited_motor_brakes(motor: Motor) -> None:
    """At V = 0 the motor takes power from a turning hub, as viscous friction would."""
    assert motor.back_emf_damping > 0
    assert motor.torque(0.0, 2.0) == pytest.approx(-2 * motor.back_emf_damping, rel=8 * EPS)


def test_ideal_motor_turns_all_power_into_work() -> None:
    """With efficiencies of 1 and kt = km: V·I = Rm·I² + τ·θ̇."""
    motor = replace(SRV02, gear_efficiency=1, motor_efficiency=1)
    voltage, rate = 5.0, 3.0
    current = (voltage - motor.volts_per_rate * rate) / motor.resistance
    lost, work = motor.resistance * current**2, motor.torque(voltage, rate) * rate
    assert lost + work == pytest.approx(voltage * current, rel=8 * EPS)


def test_rotor_inertia_reaches_the_hub_through_the_gear() -> None:
    """ηg Kg² Jm with Kg = 70: a rotor of 1e-7 kg·m² counts as 4.41e-4."""
    motor = replace(SRV02, rotor_inertia=1e-7)
    assert motor.reflected_inertia == pytest.approx(4.41e-4, rel=4 * EPS)
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.5), motor=motor)
    assert arm.hub_inertia == 0.5 + motor.reflected_inertia
    assert replace(arm, motor=None).hub_inertia == 0.5


@pytest.mark.parametrize(
    ("torque", "voltage", "expected"),
    [(0.9, 9.0, False), (1.0, 10.0, False), (1.1, 9.0, True), (0.9, 11.0, True)],
)
def test_limits_are_exceeded_by_either_peak(torque: float, voltage: float, expected: bool) -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), motor=replace(SRV02, torque_limit=1.0, voltage_limit=10.0))
    assert bool(arm.exceeded(torque, voltage)) is expected
    assert not replace(arm, motor=SRV02).exceeded(torque, voltage)


def quanser_link(rotor_inertia: float) -> Arm:
    """Quanser's rotary flexible link: a rigid link on a torsional spring, as an arm.

    A massless beam of unit length with a payload of rotary inertia at its tip bends with
    constant curvature: v = q x²/2 exactly, and its tip turns by q = α.
    """
    link = 0.065 * 0.381**2 / 3
    spring = (2 * np.pi * 3.0) ** 2 * link
    motor = replace(SRV02, rotor_inertia=rotor_inertia)
    hub = Hub(0.00208 - motor.reflected_inertia, friction=0.015)
    return Arm(Beam(1.0, 1e-15, spring), hub, Payload(inertia=link), motor=motor)


@pytest.mark.parametrize("rotor_inertia", [0.0, 4.6e-7])
def test_quanser_lqr_from_an_arm_with_a_motor(rotor_inertia: float) -> None:
    """Q = diag(160, 60, 0.25, 1), R = 1 on [θ, α, θ̇, α̇], voltage input.

    Quanser Inc., Rotary Flexible Link workbook.  Where the inertia is counted, at the hub or
    in the rotor, makes no difference.
    """
    model = assemble(quanser_link(rotor_inertia), Polynomial(1))
    plant = state_space(model, ["theta"], input="voltage")
    gain = solve_riccati(plant.A, plant.B, np.diag([160.0, 60.0, 0.25, 1.0]), np.eye(1)).gain
    # Printed to five figures: half a unit in the last one.
    np.testing.assert_allclose(gain[0, :2], [12.649, -13.441], atol=5e-4)
    np.testing.assert_allclose(gain[0, 2], 0.97799, atol=5e-6)
    np.testing.assert_allclose(gain[0, 3], 0.043846, atol=5e-7)
