"""Slews: the reference, the response, and the figures read off it."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_examples import OBJECTIVE, TWO_SENSORS, loop_on, stable_loop, uniform_arm

from slewctl import InputError, Loop, Objective, Slew, close, simulate_slew
from slewctl.arm import Motor, Rayleigh
from slewctl.loop.motion.continuous_motion import tracking_system
from slewctl.loop.motion.slew_inputs import feedforward, rigid_readings

ANGLES = st.floats(1e-2, 180) | st.floats(-180, -1e-2)

MOTOR = Motor(2.0, 0.05, 0.05, gear_ratio=20.0, gear_efficiency=0.9, motor_efficiency=0.8)
VOLTAGE = Objective(
    {"tip": 0.1, "voltage": 1.0 / MOTOR.torque_per_volt},
    {"torque": 0.1, "theta": 0.01, "theta_dot": 0.05},
)


def driven_loop(stiffness: float = 1.0, friction: float = 0.0, motor: Motor = MOTOR) -> Loop:
    """Return a loop that commands the voltage of a motor."""
    arm = replace(uniform_arm(stiffness=stiffness, friction=friction), motor=motor)
    return loop_on(arm, VOLTAGE, modes=5, n=2)


def settled(loop: Loop, slew: Slew) -> Slew:
    """Return `slew` with a horizon at which the slowest pole has decayed to e⁻³⁰ = 1e-13."""
    return Slew(
        slew.angle_deg, slew.duration_s, slew.duration_s - 30 / float(loop.poles.real.max())
    )


@given(ANGLES, st.floats(1e-2, 1e2))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_reference_goes_from_rest_to_rest(angle: float, duration: float) -> None:
    slew = Slew(angle, duration)
    at = np.array([0.0, duration, 2 * duration])
    theta, rate, acceleration = slew.reference(at)
    final = np.radians(angle)
    np.testing.assert_allclose(theta, [0, final, final], rtol=1e-13, atol=0)
    np.testing.assert_array_equal(rate, 0)
    np.testing.assert_array_equal(acceleration, 0)
    halfway = slew.reference(np.array([duration / 2]))
    assert halfway[0][0] == pytest.approx(final / 2, rel=1e-13)
    assert halfway[1][0] == pytest.approx(15 / 8 * final / duration, rel=1e-13)


@given(ANGLES, st.floats(1e-2, 1e2))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_derivatives_of_the_reference_are_derivatives(angle: float, duration: float) -> None:
    slew = Slew(angle, duration)
    t = np.linspace(0.01, 0.99, 50) * duration
    h = 1e-4 * duration
    behind, at, ahead = (slew.reference(t + shift) for shift in (-h, 0.0, h))
    scale = abs(np.radians(angle))
    # Central differences: h²/6 times the next but one derivative (60·6 = 360 at most, per T).
    for order in (0, 1):
        slope = (ahead[order] - behind[order]) / (2 * h)
        bound = 360 / 6 * 1e-8 * scale / duration ** (order + 1) + 1e-11 * scale / duration ** (
            order + 1
        )
        assert np.abs(slope - at[order + 1]).max() < bound


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("objective", [OBJECTIVE, TWO_SENSORS])
def test_ends_at_the_angle_without_steady_error(objective: Objective, friction: float) -> None:
    loop = loop_on(uniform_arm(friction=friction), objective)
    response = simulate_slew(loop, settled(loop, Slew(40.0, 4.0)), points=2001)
    final = np.radians(40.0)
    assert response.theta[-1] == pytest.approx(final, rel=1e-9)
    assert response.tip[-1] == pytest.approx(1.1 * final, rel=1e-9)
    assert abs(response.tip_deflection[-1]) < 1e-9
    assert abs(response.torque[-1]) < 1e-9
    assert response.tip_reference[-1] == pytest.approx(1.1 * final, rel=1e-14)


def test_starts_at_rest() -> None:
    response = simulate_slew(stable_loop(), Slew(40.0, 4.0))
    for signal in (response.theta, response.tip, response.tip_deflection, response.torque):
        assert abs(signal[0]) < 1e-14 * np.abs(signal).max()


def test_stiff_arm_follows_the_reference() -> None:
    """EI = 1e6 N·m²: ω₁ > 3000 rad/s, so the deflection is below acceleration/ω₁² = 1e-7."""
    loop = loop_on(uniform_arm(stiffness=1e6), modes=3, n=2)
    slew = Slew(57.0, 3.0)
    response = simulate_slew(loop, slew, points=6001)
    travel = 1.1 * np.radians(57.0)
    # The inputs are linear between 2000 points a slew: h²/12 times the acceleration's curve,
    # integrated twice, 1e-6 of the travel.
    np.testing.assert_allclose(response.tip, response.tip_reference, atol=2e-6 * travel)
    inertia = loop.model.mass[0, 0]
    peak = 10 / np.sqrt(3) * inertia * np.radians(57.0) / 9.0
    assert response.summary.peak_torque == pytest.approx(peak, rel=1e-4)


def test_stiff_arm_returns_the_energy() -> None:
    """From rest to rest on a frictionless stiff arm the torque does no net work."""
    loop = loop_on(uniform_arm(stiffness=1e6), modes=3, n=2)
    response = simulate_slew(loop, Slew(57.0, 3.0), points=6001)
    rate = np.gradient(response.theta, response.t)
    power = response.torque * rate
    kinetic = 0.5 * loop.model.mass[0, 0] * rate.max() ** 2
    assert abs(np.trapezoid(power, response.t)) < 1e-4 * kinetic
    half = response.t <= 1.5
    assert np.trapezoid(power[half], response.t[half]) == pytest.approx(kinetic, rel=1e-3)


def test_work_of_the_torque_is_dissipated_by_friction() -> None:
    loop = loop_on(uniform_arm(stiffness=1e6, friction=0.2), modes=3, n=2)
    response = simulate_slew(loop, Slew(57.0, 3.0), points=6001)
    rate = np.gradient(response.theta, response.t)
    work = np.trapezoid(response.torque * rate, response.t)
    assert work == pytest.approx(0.2 * np.trapezoid(rate**2, response.t), rel=1e-3)


def test_momentum_balance() -> None:
    """∫ torque dt = J θ̇ + Φ̃ q̇ = 0 between two states of rest, whatever bends meanwhile."""
    loop = stable_loop()
    response = simulate_slew(loop, settled(loop, Slew(40.0, 2.0)), points=20001)
    impulse = np.trapezoid(response.torque, response.t)
    assert abs(impulse) < 1e-5 * np.trapezoid(np.abs(response.torque), response.t)


@given(st.floats(1.0, 170.0))
@settings(deadline=None, max_examples=8, derandomize=True)
def test_linear_in_the_angle(angle: float) -> None:
    loop = loop_on(uniform_arm(), modes=5)
    one, other = simulate_slew(loop, Slew(1.0, 2.0)), simulate_slew(loop, Slew(-angle, 2.0))
    for name in ("theta", "tip", "tip_deflection", "torque", "tip_reference"):
        first, second = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(second, -angle * first, atol=1e-12 * np.abs(second).max())
    assert other.summary.settling_time_s == pytest.approx(one.summary.settling_time_s, rel=1e-9)
    assert other.summary.overshoot == pytest.approx(one.summary.overshoot, rel=1e-9)
    assert other.summary.residual_m == pytest.approx(angle * one.summary.residual_m, rel=1e-9)
    assert other.summary.peak_torque == pytest.approx(angle * one.summary.peak_torque, rel=1e-9)


def test_body_axis_kinematics() -> None:
    response = simulate_slew(stable_loop(), Slew(40.0, 2.0))
    rigid = 1.1 * response.theta
    np.testing.assert_allclose(response.tip, rigid + response.tip_deflection, atol=1e-13)


def test_settling_time_is_when_the_tip_comes_within_two_per_cent_for_good() -> None:
    loop = stable_loop()
    response = simulate_slew(loop, settled(loop, Slew(40.0, 1.0)), points=4001)
    summary, travel = response.summary, 1.1 * np.radians(40.0)
    outside = np.abs(response.tip - travel) > 0.02 * travel
    after = response.t >= summary.settling_time_s
    assert not outside[after].any()
    assert outside[np.flatnonzero(after)[0] - 1]


def test_response_is_exact_at_its_points_however_few() -> None:
    """The reference is a state of its own, so the matrix exponential knows it exactly."""
    loop, slew = stable_loop(), Slew(40.0, 2.0)
    fine = simulate_slew(loop, slew, points=4801)
    for factor in (4, 16, 64):
        coarse = simulate_slew(loop, slew, points=4800 // factor + 1)
        np.testing.assert_allclose(coarse.t, fine.t[::factor], atol=1e-12)
        np.testing.assert_allclose(coarse.tip, fine.tip[::factor], atol=1e-9)
        np.testing.assert_allclose(coarse.torque, fine.torque[::factor], atol=1e-7)


def test_response_agrees_with_python_controls_on_fine_inputs() -> None:
    """An independent path: forced_response, with inputs linear over short steps."""
    loop, slew = stable_loop(), Slew(40.0, 2.0)
    ours = simulate_slew(loop, slew, points=301)
    t = np.linspace(0, slew.end, 38401)
    angle, rate, acceleration = slew.reference(t)
    inputs = np.array(
        [
            [*rigid_readings(loop, *at), feedforward(loop, *at[1:])]
            for at in zip(angle, rate, acceleration, strict=True)
        ]
    ).T
    theirs = control.forced_response(tracking_system(loop).to_control(), t, inputs).outputs
    np.testing.assert_allclose(ours.tip, theirs[2][::128], atol=1e-6)


@pytest.mark.parametrize("duration", [10.0, 100.0, 1000.0])
def test_a_slow_slew_needs_the_torque_of_the_rigid_arm(duration: float) -> None:
    """max |J θ̈_ref| = J·angle/T²·10/√3; what bending and the loop add falls like 1/T²."""
    loop = stable_loop()
    peak = simulate_slew(loop, Slew(40.0, duration)).summary.peak_torque
    rigid = loop.model.mass[0, 0] * np.radians(40.0) / duration**2 * 10 / np.sqrt(3)
    friction = loop.model.damping[0, 0] * np.radians(40.0) / duration * 30 / 16
    assert peak <= (rigid + friction) * (1 + 10 / duration**2)
    assert peak >= max(rigid, friction) * (1 - 10 / duration**2)


@pytest.mark.parametrize(
    "arguments",
    [
        {"angle_deg": 0.0, "duration_s": 1.0},
        {"angle_deg": float("nan"), "duration_s": 1.0},
        {"angle_deg": 30.0, "duration_s": 0.0},
        {"angle_deg": 30.0, "duration_s": 1.0, "horizon_s": -1.0},
    ],
)
def test_impossible_slews_are_refused(arguments: dict[str, float]) -> None:
    with pytest.raises(InputError, match="slew"):
        Slew(**arguments)


def test_actuator_is_the_torque_where_the_torque_is_commanded() -> None:
    response = simulate_slew(stable_loop(), Slew(40.0, 2.0))
    np.testing.assert_array_equal(response.actuator, response.torque)
    assert response.summary.peak_voltage is None
    assert not response.summary.saturates


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_voltage_turns_the_arm_to_the_angle(friction: float) -> None:
    loop = driven_loop(friction=friction)
    response = simulate_slew(loop, settled(loop, Slew(40.0, 4.0)), points=2001)
    final = np.radians(40.0)
    assert response.theta[-1] == pytest.approx(final, rel=1e-9)
    assert response.tip[-1] == pytest.approx(1.1 * final, rel=1e-9)
    assert abs(response.actuator[-1]) < 1e-9
    assert abs(response.torque[-1]) < 1e-9
    drawn = np.abs(response.actuator).max()
    assert drawn <= response.summary.peak_voltage == pytest.approx(drawn, rel=1e-3)


def test_torque_under_voltage_is_what_moves_the_arm() -> None:
    """Momentum: ∫ τ dt = J θ̇ + Φ̃ q̇ + ∫ c_h θ̇ dt, zero but for friction from rest to rest."""
    loop = driven_loop(friction=0.2)
    response = simulate_slew(loop, settled(loop, Slew(40.0, 2.0)), points=20001)
    impulse = np.trapezoid(response.torque, response.t)
    travelled = response.theta[-1] - response.theta[0]
    scale = np.trapezoid(np.abs(response.torque), response.t)
    # Trapezoids of a smooth torque with a step of 1e-3 of its time scale.
    assert impulse == pytest.approx(0.2 * travelled, abs=1e-5 * scale)
    drive = np.trapezoid(response.actuator, response.t)
    expected = impulse / MOTOR.torque_per_volt + MOTOR.volts_per_rate * travelled
    assert drive == pytest.approx(expected, rel=1e-5)


def test_feedforward_voltage_gives_a_stiff_arm_the_torque_of_the_reference() -> None:
    """EI = 1e6 N·m²: under voltage as under torque the tip follows, with the rigid torque."""
    slew = Slew(57.0, 3.0)
    loop = driven_loop(stiffness=1e6)
    response = simulate_slew(loop, slew, points=6001)
    travel = 1.1 * np.radians(57.0)
    np.testing.assert_allclose(response.tip, response.tip_reference, atol=2e-6 * travel)
    _, rate, acceleration = slew.reference(response.t)
    torque = loop.model.mass[0, 0] * acceleration
    np.testing.assert_allclose(response.torque, torque, atol=1e-4 * np.abs(torque).max())
    voltage = torque / MOTOR.torque_per_volt + 20.0 * 0.05 * rate
    np.testing.assert_allclose(response.actuator, voltage, atol=1e-4 * np.abs(voltage).max())


def test_voltage_that_a_commanded_torque_needs() -> None:
    """Under current control the motor still wants the voltage of its torque and speed."""
    arm = replace(uniform_arm(stiffness=1e6), motor=MOTOR)
    slew = Slew(57.0, 3.0)
    commanded = simulate_slew(loop_on(arm, TWO_SENSORS, modes=5, n=2), slew, points=3001)
    driven = simulate_slew(driven_loop(stiffness=1e6), slew, points=3001)
    assert commanded.summary.peak_voltage == pytest.approx(np.abs(driven.actuator).max(), rel=1e-4)
    np.testing.assert_array_equal(commanded.actuator, commanded.torque)


@pytest.mark.parametrize("limit", ["torque_limit", "voltage_limit"])
@pytest.mark.parametrize("objective", [VOLTAGE, TWO_SENSORS], ids=["voltage", "torque"])
def test_exceeded_limits_of_the_motor_are_reported(objective: Objective, limit: str) -> None:
    slew, arm = Slew(40.0, 2.0), replace(uniform_arm(), motor=MOTOR)
    summary = simulate_slew(loop_on(arm, objective, modes=5, n=2), slew).summary
    assert not summary.saturates
    peak = summary.peak_torque if limit == "torque_limit" else summary.peak_voltage
    for factor, expected in ((0.999, True), (1.001, False)):
        limited = replace(arm, motor=replace(MOTOR, **{limit: factor * peak}))
        again = simulate_slew(loop_on(limited, objective, modes=5, n=2), slew).summary
        assert again.saturates is expected
        assert again.peak_torque == summary.peak_torque


def test_drag_on_the_rigid_rotation_is_fed_forward() -> None:
    """αJ θ̇ is part of the torque that turns a stiff arm damped in proportion to its mass."""
    arm = replace(uniform_arm(stiffness=1e6), damping=Rayleigh(alpha=0.5))
    loop, slew = loop_on(arm, modes=3, n=2), Slew(57.0, 3.0)
    response = simulate_slew(loop, slew, points=6001)
    travel = 1.1 * np.radians(57.0)
    np.testing.assert_allclose(response.tip, response.tip_reference, atol=2e-6 * travel)
    _, rate, acceleration = slew.reference(response.t)
    torque = loop.model.mass[0, 0] * (acceleration + 0.5 * rate)
    np.testing.assert_allclose(response.torque, torque, atol=1e-4 * np.abs(torque).max())


def test_strain_gauge_as_a_sensor() -> None:
    objective = Objective(
        {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "moment@200mm": 0.05}
    )
    loop = loop_on(uniform_arm(), objective)
    response = simulate_slew(loop, settled(loop, Slew(40.0, 4.0)))
    assert response.theta[-1] == pytest.approx(np.radians(40.0), rel=1e-9)


@pytest.mark.parametrize("lag_s", [1e-5, 1e-6, 1e-9])
def test_a_lag_far_faster_than_the_arm_changes_nothing(lag_s: float) -> None:
    """The slew is that without the lag, to within the time that the lag takes."""
    loop = stable_loop()
    own = loop.controller.system
    A, B, C = (np.asarray(getattr(own, name)) for name in "ABC")
    n = len(A)
    behind = control.StateSpace(
        np.block([[A, np.zeros((n, 1))], [C / lag_s, np.array([[-1 / lag_s]])]]),
        np.vstack([B, np.zeros((1, own.ninputs))]),
        np.eye(n + 1)[-1:],
        np.zeros((1, own.ninputs)),
        inputs=own.input_labels,
        outputs=own.output_labels,
    )
    slew = Slew(30.0, 2.0)
    lagged = simulate_slew(close(loop.model, loop.objective, behind, sign=1), slew).summary
    plain = simulate_slew(close(loop.model, loop.objective, own, sign=1), slew).summary
    for name in ("settling_time_s", "residual_m", "peak_torque"):
        near = pytest.approx(getattr(plain, name), rel=30 * lag_s + 1e-7)
        assert getattr(lagged, name) == near, name
