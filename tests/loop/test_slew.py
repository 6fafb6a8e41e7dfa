"""Slews: the reference, the response, and the figures read off it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_examples import OBJECTIVE, TWO_SENSORS, loop_on, stable_loop, uniform_arm

from slewctl import InputError, Loop, Objective, Slew, simulate_slew

ANGLES = st.floats(1e-2, 180) | st.floats(-180, -1e-2)


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
        assert signal[0] == 0


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
    assert other.summary.settling_time_s == one.summary.settling_time_s
    assert other.summary.residual_m == pytest.approx(angle * one.summary.residual_m, rel=1e-9)
    assert other.summary.peak_torque == pytest.approx(angle * one.summary.peak_torque, rel=1e-9)


def test_body_axis_kinematics() -> None:
    response = simulate_slew(stable_loop(), Slew(40.0, 2.0))
    rigid = 1.1 * response.theta
    np.testing.assert_allclose(response.tip, rigid + response.tip_deflection, atol=1e-13)


def test_settling_time_is_when_the_tip_comes_within_two_per_cent_for_good() -> None:
    loop = stable_loop()
    response = simulate_slew(loop, settled(loop, Slew(40.0, 1.0)), points=4001)
    travel = 1.1 * np.radians(40.0)
    outside = np.abs(response.tip - travel) > 0.02 * travel
    after = response.t >= response.summary.settling_time_s
    assert not outside[after].any()
    assert outside[np.flatnonzero(after)[0] - 1]
    assert response.summary.residual_m == np.abs(response.tip - travel)[response.t >= 1.0].max()
    assert response.summary.peak_torque == np.abs(response.torque).max()


def test_unsettled_response_says_so() -> None:
    summary = simulate_slew(stable_loop(), Slew(40.0, 2.0, horizon_s=1.0)).summary
    assert summary.settling_time_s == np.inf
    assert summary.residual_m == np.inf


def test_finer_time_steps_do_not_change_the_answer() -> None:
    loop, slew = stable_loop(), Slew(40.0, 2.0)
    errors = []
    reference = simulate_slew(loop, slew, points=38401).tip[::64]
    for factor in (1, 2, 4):
        tip = simulate_slew(loop, slew, points=600 * factor + 1).tip[::factor]
        errors.append(np.abs(tip - reference).max())
    # Exact between the points but for inputs taken as linear there: second order.
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.1)


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
