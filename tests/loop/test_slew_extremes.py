"""Peaks, settling, residual and overshoot of a slew: of all times, whatever is drawn."""

from __future__ import annotations

import warnings
from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_examples import TWO_SENSORS, loop_on, stable_loop, uniform_arm
from slew_oracle import tip_error, walked, zoomed
from strategies import deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    Loop,
    Objective,
    Payload,
    Problem,
    Slew,
    arms,
    assemble,
    close,
    generalised_plant,
    lqg,
    simulate_slew,
    truth,
)
from slewctl.arm import Motor
from slewctl.compare.design_basis import design_model
from slewctl.compare.study.grid import Setting, arm_of, objective_of, slew_of
from slewctl.errors import AccuracyError, InputError
from slewctl.loop import SlewSummary
from slewctl.loop.motion.continuous_motion import tracking_system
from slewctl.loop.motion.decoupled import decoupled

MOTOR = Motor(2.0, 0.05, 0.05, gear_ratio=20.0, gear_efficiency=0.9, motor_efficiency=0.8)
VOLTAGE = Objective({"tip": 0.1, "voltage": 10.0}, TWO_SENSORS.noise)


def paper_loop(damping_ratio: float) -> Loop:
    """The paper's beam on a hub, and a quick design on two clamped-free functions."""
    arm = Arm(arms.paper_beam().beam, hub=Hub(inertia=0.2), damping_ratio=damping_ratio)
    objective = Objective(
        {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    )
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), objective))
    return close(truth(arm, 10), objective, controller)


def sampled_loop(T: float, delay: float, motor: bool = False) -> Loop:
    arm = replace(uniform_arm(friction=0.1 * motor), motor=MOTOR if motor else None)
    objective = VOLTAGE if motor else TWO_SENSORS
    plant = generalised_plant(assemble(arm, ClampedFree(3)), objective)
    return close(truth(arm, 6), objective, lqg(plant, sample_time=T, delay=delay))


def summary(loop: Loop, slew: Slew) -> SlewSummary:
    return simulate_slew(loop, slew, 11).summary


def assert_agrees(loop: Loop, slew: Slew, end: float, steps: int, rel: float) -> None:
    """No step of the walk exceeds what is claimed, and one comes near to it."""
    claimed = summary(loop, slew)
    seen = walked(loop, slew, max(end, 1.3 * claimed.settling_time_s), steps)
    travel = 1.1 * abs(np.radians(slew.angle_deg))
    pairs = [
        (claimed.settling_time_s, seen.settling, seen.settling),
        (claimed.residual_m, seen.residual, travel),
        (claimed.overshoot, seen.overshoot, 1.0),
        (claimed.peak_torque, seen.torque, seen.torque),
    ]
    if seen.voltage is not None:
        assert claimed.peak_voltage is not None
        pairs.append((claimed.peak_voltage, seen.voltage, seen.voltage))
    for value, reached, scale in pairs:
        assert -1e-9 * scale < value - reached < rel * scale


def assert_on_the_edge(loop: Loop, slew: Slew) -> None:
    """The tip leaves the band within a millionth of the settling time, and before."""
    settled = summary(loop, slew).settling_time_s
    reach = loop.model.arm.hub.radius + loop.model.arm.beam.length
    band = 0.02 * reach * abs(np.radians(slew.angle_deg))
    before, after = (abs(tip_error(loop, slew, settled * (1 + d))) for d in (-1e-6, 1e-6))
    assert after < band < before


def assert_zoomed(loop: Loop, slew: Slew, end: float, steps: int) -> None:
    """All figures agree to seven digits; the overshoot, or to nine of the travel."""
    claimed, seen = summary(loop, slew), zoomed(loop, slew, end, steps)
    assert claimed.settling_time_s == pytest.approx(seen.settling, rel=1e-7)
    assert claimed.peak_torque == pytest.approx(seen.torque, rel=1e-7)
    assert claimed.residual_m == pytest.approx(seen.residual, rel=1e-7)
    assert claimed.overshoot == pytest.approx(seen.overshoot, rel=1e-7, abs=1e-9)


def test_peak_torque_and_settling_of_the_papers_beam() -> None:
    for horizon in (None, 6.0, 600.0):
        found = summary(paper_loop(0.005), Slew(30.0, 2.0, horizon))
        assert found.peak_torque == pytest.approx(0.39648813, rel=1e-7)
        assert found.settling_time_s == pytest.approx(3.320655, rel=1e-6)
    assert_agrees(paper_loop(0.005), Slew(30.0, 2.0), 12.0, 200_000, 1e-4)


def test_last_entry_into_the_band_long_after_the_slew() -> None:
    """ζ = 0.001 and a slew that excites every mode: each horizon once gave another answer."""
    loop = paper_loop(0.001)
    found = {summary(loop, Slew(30.0, 0.5, horizon)) for horizon in (None, 5.2, 5.4, 60.0)}
    assert len(found) == 1
    assert found.pop().settling_time_s == pytest.approx(5.296729, rel=1e-6)
    assert_zoomed(loop, Slew(30.0, 0.5), 60.0, 200_000)


@pytest.mark.parametrize("loop", [stable_loop(), sampled_loop(0.02, 0.013)], ids=["s", "z"])
def test_summary_does_not_depend_on_what_is_drawn(loop: Loop) -> None:
    found = {
        simulate_slew(loop, Slew(40.0, 2.0, horizon), points).summary
        for horizon in (None, 2.0001, 7.3, 1e3)
        for points in (3, 401)
    }
    assert len(found) == 1


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.sampled_from([0.0, 0.02]))
@deterministic(8)
def test_invariant_under_a_change_of_units(
    length: float, mass: float, time: float, sampled: float
) -> None:
    found = []
    for a, b, c in ((1.0, 1.0, 1.0), (10**length, 10**mass, 10**time)):
        torque, second = b * a**2 / c**2, np.sqrt(c)
        arm = Arm(
            Beam(a, b / a, b * a**3 / c**2), Hub(0.3 * b * a**2, 0.1 * a), damping_ratio=0.005
        )
        objective = Objective(
            {"tip": 0.1 * a, "torque": torque},
            {"torque": 0.1 * torque * second, "theta": 0.01 * second, "theta_dot": 0.05 / second},
        )
        options = {"sample_time": sampled * c, "delay": 0.013 * c} if sampled else {}
        controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), objective), **options)
        s = summary(close(truth(arm, 5), objective, controller), Slew(40.0, 2.0 * c))
        found.append([s.settling_time_s / c, s.residual_m / a, s.peak_torque / torque, s.overshoot])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


@given(st.floats(-1.0, 1.3), st.sampled_from([40.0, -170.0]), st.floats(-2.5, -1.3))
@deterministic(12)
def test_continuous_slew_agrees_with_a_walk_in_fine_steps(
    duration: float, angle: float, damping: float
) -> None:
    loop = loop_on(uniform_arm(damping_ratio=10**damping), TWO_SENSORS, modes=6)
    slew = Slew(angle, 10**duration)
    assert_agrees(loop, slew, slew.duration_s + 30.0, 100_000, 1e-3)


@pytest.mark.parametrize(
    ("hub", "source", "n", "sensors"),
    [
        (10.0, "arm-matched", 5, ("theta", "theta_dot")),
        (1.0, "modal-truncation-static", 6, ("theta", "tip")),
        (10.0, "arm-matched", 6, ("theta", "tip")),
        (100.0, "modal-truncation-static", 8, ("theta", "theta_dot")),
    ],
)
def test_heavy_hubs_with_designs_of_many_functions(
    hub: float, source: str, n: int, sensors: tuple[str, ...]
) -> None:
    """Loops of time scales far apart, with poles near to each other."""
    arm = arm_of(arms.paper_beam(), Setting(hub, 0.0, 0.005, 0.3, sensors))
    objective, slew, model = objective_of(arm, 0.3, sensors), slew_of(arm, 0.3), truth(arm, 20)
    controller = design_model(model, objective, source, n).controller("lqg", {})
    loop = close(model, objective, controller)
    apart = np.abs(loop.poles[:, None] - loop.poles)[~np.eye(len(loop.poles), dtype=bool)]
    assert apart.min() < 1e-8 * np.abs(loop.poles).max()
    assert_zoomed(loop, slew, 4 * slew.duration_s, 30_000)


def lagged_loop(count: int, lag: float, spread: float) -> Loop:
    """A PD controller behind a chain of nearly equal lags: one multiple pole, one eigenvector."""
    rates = (1 + spread * np.arange(count)) / lag
    A = np.diag(rates[1:], -1) - np.diag(rates)
    first, last = np.eye(count)[:, :1], np.eye(count)[-1:]
    pd = control.StateSpace(
        A,
        rates[0] * first @ [[-20.0, -8.0]],
        last,
        np.zeros((1, 2)),
        inputs=["theta", "theta_dot"],
        outputs=["torque"],
    )
    return close(truth(uniform_arm(damping_ratio=0.02), 6), TWO_SENSORS, pd, sign=1)


def assert_lagged_loop_agrees(count: int, lag: float, spread: float) -> None:
    loop, slew = lagged_loop(count, lag, spread), Slew(40.0, 1.0)
    assert loop.stable
    assert_agrees(loop, slew, 5.0, 30_000, 3e-4)
    assert_on_the_edge(loop, slew)


@given(st.integers(2, 4), st.floats(-5.0, -2.5), st.sampled_from([0.0, 1e-8, 1e-4]))
@deterministic(5)
def test_nearly_defective_loops(count: int, lag: float, spread: float) -> None:
    assert_lagged_loop_agrees(count, 10**lag, spread)


@pytest.mark.slow
@given(st.integers(2, 12), st.floats(-6.0, -2.6), st.sampled_from([0.0, 1e-8, 1e-4]))
@deterministic(40)
def test_more_nearly_defective_loops(count: int, lag: float, spread: float) -> None:
    assert_lagged_loop_agrees(count, 10**lag, spread)


@given(
    st.sampled_from([0.04, 0.07, 0.1]),
    st.sampled_from([0.0, 0.3, 1.0, 2.75]),
    st.floats(-1.0, 0.5),
    st.booleans(),
)
@deterministic(8)
def test_sampled_slew_agrees_with_a_walk_in_fine_steps(
    T: float, delay: float, duration: float, motor: bool
) -> None:
    loop, slew = sampled_loop(T, delay * T, motor), Slew(40.0, 10**duration)
    assert_agrees(loop, slew, slew.duration_s + 8.0, 6_000, 5e-3)


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("duration", [0.2, 2.0])
def test_motor_commanded_by_voltage_agrees_with_a_walk(friction: float, duration: float) -> None:
    loop = loop_on(replace(uniform_arm(friction=friction), motor=MOTOR), VOLTAGE, modes=6)
    assert_agrees(loop, Slew(-30.0, duration), 40.0, 100_000, 1e-3)


def test_voltage_that_a_held_torque_needs_has_its_peak_between_the_samples() -> None:
    """Under a held torque the hub, and with it the back-EMF, is fastest just before the next."""
    arm, T = replace(uniform_arm(), motor=MOTOR), 0.1
    plant = generalised_plant(assemble(arm, ClampedFree(3)), TWO_SENSORS)
    loop, slew = close(truth(arm, 6), TWO_SENSORS, lqg(plant, sample_time=T)), Slew(40.0, 0.5)
    assert_agrees(loop, slew, 8.0, 20_000, 1e-3)
    found = simulate_slew(loop, slew, 31)
    fast = np.gradient(found.theta, found.t)
    at_samples = MOTOR.voltage(found.torque, fast)[np.isclose(found.t / T % 1, 0)]
    assert found.summary.peak_voltage is not None
    assert found.summary.peak_voltage > np.abs(at_samples).max() * 1.01


def pd_loop(gain: float, rate: float) -> Loop:
    pd = control.StateSpace(
        [], [], [], [[-gain, -rate]], inputs=["theta", "theta_dot"], outputs=["torque"]
    )
    model = assemble(uniform_arm(stiffness=1e4, damping_ratio=0.02), ClampedFree(1))
    return close(model, TWO_SENSORS, pd, sign=1)


@pytest.mark.parametrize("gain", [1.0, 30.0])
def test_critically_damped_loop(gain: float) -> None:
    """The rate feedback at which two poles meet: they have one eigenvector."""
    low, high = 0.5, 100.0
    for _ in range(60):
        rate = (low + high) / 2
        oscillates = pd_loop(gain, rate).poles[0].imag != 0
        low, high = (rate, high) if oscillates else (low, rate)
    loop = pd_loop(gain, rate)
    assert abs(loop.poles[1] - loop.poles[0]) < 1e-6 * abs(loop.poles[0])
    assert decoupled(np.asarray(tracking_system(loop).A)).blocks
    assert_agrees(loop, Slew(30.0, 0.5), 40.0, 400_000, 1e-3)


def test_poles_over_many_decades() -> None:
    """A lag of 1 ns in the controller, ten decades from the slowest pole, changes nothing."""
    found = []
    for lag in (0.0, 1e-9):
        gains = [[-20.0, -8.0]]
        signals = {"inputs": ["theta", "theta_dot"], "outputs": ["torque"]}
        pd = (
            control.StateSpace([[-1 / lag]], np.array(gains) / lag, [[1.0]], [[0, 0]], **signals)
            if lag
            else control.StateSpace([], [], [], gains, **signals)
        )
        loop = close(truth(uniform_arm(damping_ratio=0.02), 12), TWO_SENSORS, pd, sign=1)
        found.append(summary(loop, Slew(40.0, 1.0)))
    ideal, lagging = found
    for name in ("settling_time_s", "residual_m", "peak_torque", "overshoot"):
        assert getattr(lagging, name) == pytest.approx(getattr(ideal, name), rel=1e-7)


@pytest.mark.parametrize("T", [0.0, 0.02])
@pytest.mark.parametrize("duration", [1e-300, 1e-150, 1e-50, 1e-9, 1e4, 1e9, 1e50, 1e150, 1e300])
def test_absurd_durations_are_answered_or_refused(duration: float, T: float) -> None:
    loop = sampled_loop(T, 0.0) if T else stable_loop()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = summary(loop, Slew(30.0, duration))
        except (InputError, AccuracyError):
            return
    assert np.isfinite([found.settling_time_s, found.peak_torque]).all()
    assert found.settling_time_s > 0.5 * duration


def test_time_drawn_beyond_all_samples_is_refused() -> None:
    with pytest.raises(InputError, match="samples"):
        simulate_slew(sampled_loop(0.02, 0.0), Slew(30.0, 2.0, 1e300))


@pytest.mark.parametrize("metre", [1.0, 0.5, 1e-3, 100.0])
def test_a_fast_clock_leaves_the_modes_apart_in_any_unit_of_length(metre: float) -> None:
    """At 1700 samples a period of the first mode, where every factor of a sample is near to one."""
    L = 2.0058741047778046 * metre
    arm = Arm(
        Beam(L, 10.70255264552556 / metre, 1390.473557399667 * metre**3),
        Hub(37.881016932356005 * metre**2, 0.1 * L),
        Payload(21.46797320668091),
        damping_ratio=0.001,
    )
    problem = Problem(
        arm,
        {"tip": 0.02035068968759097 * metre, "torque": 139.37085804844236 * metre**2},
        {"torque": 9.524155161585332 * metre**2, "theta": 0.0005957896098836973},
        truth_modes=3,
    )
    K = lqg(problem.plant("arm-matched", 2), sample_time=0.00036719800215416146)
    moved = problem.judge(K, Slew(30.0, 1.8321967134293031)).response.summary
    assert moved.settling_time_s == pytest.approx(8.3214626142, rel=1e-8)
    assert moved.residual_m == pytest.approx(0.247575036848 * metre, rel=1e-8)
