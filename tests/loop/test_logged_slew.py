"""A log of a slew beside its prediction: where it is, how well it agrees, what it uses up."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slewctl as sc
from slewctl.loop import Loop, margin_use
from slewctl.loop.logged_slew import _missed_from
from slewctl.loop.used_margins import _stands
from slewctl.measured.log import Log

T = 0.005
ARM = sc.Arm(
    sc.Beam(0.38, 0.17, 0.2128), sc.Hub(0.00245, friction=0.021), damping_ratio=0.008, name="servo"
)
SLEW = sc.Slew(60.0, 0.5, horizon_s=2.0)
PID = {"kp": 0.3, "kd": 0.03, "filter_hz": 30.0}


def problem(arm: sc.Arm = ARM) -> sc.Problem:
    noise = {"torque": 0.001, "theta": 0.0003}
    return sc.Problem(arm, {"tip": 0.02, "torque": 0.1}, noise, slew=SLEW, truth_modes=5)


def law() -> sc.Controller:
    return sc.given(pid=PID, sample_time=T, discretise="tustin")


@cache
def predicted() -> sc.Simulation:
    return problem().simulate(law())


def logged(
    made: sc.Simulation, start: float = 0.7123, *, noise: float = 0.0, reference: bool = False
) -> Log:
    """The log of a simulated slew that begins somewhere in it, at an angle of its own."""
    t = T * np.arange(round((start + made.t[-1]) / T))
    # The command of a sample is held after it.
    torque = np.interp(t + T / 2 - start, made.t, made.signals["torque"], left=0.0)
    theta = 0.2 + np.interp(t - start, made.t, made.signals["theta"])
    theta += noise * np.random.default_rng(1).standard_normal(len(t))
    told = 500 + 10 * np.interp(t - start, made.t, made.signals["theta_ref"])
    return Log(T, torque, theta, told if reference else None)


@pytest.mark.parametrize("reference", [False, True])
@pytest.mark.parametrize("start", [0.0, 0.3, 0.7123])
def test_a_slew_is_found_in_its_log_to_a_fraction_of_a_sample(
    start: float, reference: bool
) -> None:
    found = sc.replay(predicted(), logged(predicted(), start, reference=reference))
    assert found.start_s == pytest.approx(start, abs=T / 50)
    assert found.start_from == ("reference" if reference else "output")
    assert found.output.fit > 99.5
    assert found.output.apart_s is None
    assert found.command.fit > 97  # its jumps lie between the samples
    assert found.t[0] >= 0


def test_noise_lowers_the_fit_by_what_it_is() -> None:
    sigma = 0.01
    found = sc.replay(predicted(), logged(predicted(), 0.5, noise=sigma, reference=True))
    assert found.output.error_rms == pytest.approx(sigma, rel=0.1)
    spread = np.std(found.output.measured)
    assert found.output.fit == pytest.approx(100 * (1 - sigma / spread), abs=1.0)


def test_another_arm_parts_where_it_does_something_else() -> None:
    heavy = replace(ARM, payload=sc.Payload(0.05))
    rig = problem(heavy).simulate(law())
    found = sc.replay(predicted(), logged(rig, 0.5, reference=True))
    difference = np.abs(found.output.measured - found.output.predicted)
    limit = 0.02 * np.ptp(found.output.measured)
    assert found.output.apart_s is not None
    before = found.t < found.output.apart_s
    assert (difference[before] > limit).sum() < 3
    assert difference.max() > limit
    assert found.output.fit < 98


@pytest.mark.slow
def test_gain_and_dead_time_of_the_rig_are_held_against_the_margins() -> None:
    loop = problem().judge(law()).loop
    torque = 0.02 * sc.prbs(6000, amplitude=1.0, seed=2)
    log = sc.simulated_log(ARM, torque, T, noise=1e-3, seed=3)
    use = margin_use(loop, log)
    assert use.holds
    assert use.gain_db[0] < 0.05
    assert use.gain_db[1] > -0.05
    assert abs(sum(use.delay_s) / 2) < 0.1 * T
    weak = sc.simulated_log(ARM, torque, T, noise=1e-3, seed=3, gain=0.5)
    use = margin_use(loop, weak)
    assert np.mean(use.gain_db) == pytest.approx(20 * np.log10(0.5), abs=0.1)
    assert use.gain_margins_db[0] < use.gain_db[0]  # a PD loop stands that


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gain", "late", "stable"),
    [(1.0, 0.0, True), (1.8, 0.0, True), (1.0, 0.015, True), (1.5, 0.01, True), (1.8, 0.01, False)],
)
def test_gain_and_dead_time_are_held_against_the_margins_together(
    gain: float, late: float, stable: bool
) -> None:
    """What each margin allows alone, a loop may not stand at once."""
    arm = sc.Arm(
        sc.Beam(0.6, 0.4, 0.6), sc.Hub(0.013, friction=0.018), payload=sc.Payload(0.05),
        damping_ratio=0.012,
    )  # fmt: skip
    asked = sc.Problem(arm, {"tip": 0.03, "torque": 0.5}, {"torque": 0.01, "theta": 0.001})
    K = sc.lqg(asked.plant("arm-matched", n=2), sample_time=0.01, delay=0.004)
    torque = sc.prbs(1000, amplitude=0.2, hold=2, seed=1)
    log = sc.simulated_log(arm, torque, 0.01, delay=0.004 + late)
    rig = Log(0.01, log.input / gain, log.output, None, "torque", "theta")
    use = margin_use(asked.judge(K).loop, rig)
    assert use.each_holds
    assert use.holds == stable
    assert ("NOT both together" in str(use)) == (not stable)
    system = K.system
    there = sc.given(
        A=system.A, B=system.B, C=gain * system.C, D=gain * system.D, feedback="positive",
        inputs=["theta"], output="torque", sample_time=0.01, delay=0.004 + late,
    )  # fmt: skip
    assert asked.judge(there).loop.stable == stable


@pytest.mark.slow
def test_a_slew_without_noise_tells_the_gain_and_no_deviation_of_nothing() -> None:
    log = logged(predicted(), 0.4)
    use = margin_use(problem().judge(law()).loop, log)
    assert use.gain_db == pytest.approx((0.0, 0.0), abs=1e-6)
    assert use.delay_s == pytest.approx((0.0, 0.0), abs=1e-8)
    assert "hardly determined" not in str(sc.fit(ARM, log, ["gain", "delay"]))


def test_dead_times_that_destabilise_between_two_others_are_seen() -> None:
    """Between samples a dead time turns a mode above half the clock's frequency by itself."""
    arm = sc.Arm(
        sc.Beam(0.38, 0.17, 0.2128), sc.Hub(0.00245, friction=0.021), damping_ratio=0.008,
        sensors={"theta": sc.Sensor(delay=0.003)},
    )  # fmt: skip
    asked = sc.Problem(
        arm, {"tip": 0.02, "torque": 0.1}, {"torque": 0.001, "theta": 0.0003}, truth_modes=4
    )
    pid = {"kp": 0.379, "kd": 0.1613, "filter_hz": 100.0}

    def late(time: float) -> Loop:
        law = sc.given(pid=pid, sample_time=0.0114, discretise="tustin", delay=time)
        return sc.close(asked.truth, asked.objective, law)

    assert [late(time).stable for time in (0.0, 0.0015, 0.003, 0.005)] == [True, True, False, True]
    # Dead times in all: that of the sensor is one of them.
    loop = late(0.0)
    assert _stands(loop, (1.0, 1.0), (0.003, 0.0045))
    assert not _stands(loop, (1.0, 1.0), (0.003, 0.008))
    assert _stands(loop, (1.0, 1.0), (0.008, 0.008))
    assert not _stands(loop, (1.0, 1.0), (0.006, 0.006))


@pytest.mark.parametrize(
    ("start", "gap", "refused"),
    [(0.5, 0.3, True), (0.5, 0.6, True), (0.5, 0.8, True), (2.0, 0.6, True), (2.0, 0.95, True),
     (0.0, 3.0, False), (2.0, -0.5, False)],
)  # fmt: skip
def test_only_a_gap_in_the_slew_itself_is_refused(start: float, gap: float, refused: bool) -> None:
    """Gaps at so many durations of the slew from its start on."""
    made = predicted()
    log = logged(made, start)
    output = log.output.copy()
    output[round((start + gap * made.slew.duration_s) / T)] = np.nan
    broken = Log(T, log.input, output, None, log.actuator, log.sensor)
    if refused:
        with pytest.raises(sc.InputError, match="a gap in the slew"):
            sc.replay(made, broken)
    else:
        assert sc.replay(made, broken).output.fit > 99


def test_a_slew_with_a_gap_in_it_is_refused() -> None:
    """What is kept after it would be taken for a slew that begins there."""
    log = logged(predicted(), 0.5)
    output = log.output.copy()
    output[round((0.5 + 0.3 * predicted().slew.duration_s) / T)] = np.nan
    gap = Log(T, log.input, output, None, log.actuator, log.sensor)
    assert gap.cut == (True, False)
    with pytest.raises(sc.InputError, match="the log has a gap in the slew; 1 s"):
        sc.replay(predicted(), gap)


def test_a_log_slower_than_the_controller_does_not_tell_of_margins() -> None:
    loop, log = problem().judge(law()).loop, logged(predicted(), 0.4)
    step = loop.controller.sample_time
    assert step > 0
    every = round(2 * step / T) if step > T else 2
    slow = Log(every * T, log.input[::every], log.output[::every], None, log.actuator, log.sensor)
    assert slow.sample_time > step
    with pytest.raises(sc.InputError, match="does not hold what is commanded every"):
        margin_use(loop, slow)


def test_a_motor_may_be_logged_by_its_torque_or_its_voltage() -> None:
    """Whichever of them the controller commands."""
    motor = sc.arms.quanser_flexible_link().motor
    assert motor is not None
    arm = replace(ARM, motor=motor)
    made = problem(arm).simulate(law())
    t = T * np.arange(round(made.t[-1] / T))
    theta = np.interp(t, made.t, made.signals["theta"])
    for name in ("torque", "voltage"):
        told = np.interp(t + T / 2, made.t, made.signals[name])
        found = sc.replay(made, Log(T, told, theta, actuator=name))
        assert found.command.name == name
        assert found.command.fit > 97


@given(st.integers(0, 2**32 - 1), st.integers(0, 60))
def test_the_start_is_that_of_every_least_squares_one_by_one(seed: int, start: int) -> None:
    rng = np.random.default_rng(seed)
    n = 80
    shape = np.cumsum(rng.random(n) * (np.arange(n) < 25))
    shape -= shape[0]
    whole = np.concatenate([np.zeros(start), shape[: n - start]])
    signal = rng.standard_normal() * whole + rng.standard_normal() + 0.1 * rng.standard_normal(n)
    brute = []
    for k in range(n - 1):
        columns = np.column_stack([np.r_[np.zeros(k), shape[: n - k]], np.ones(n)])
        left = signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]
        brute.append(left @ left)
    found = _missed_from(signal, shape)[: n - 1]
    np.testing.assert_allclose(found, brute, rtol=1e-6, atol=1e-9 * (signal @ signal))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"sensor": "moment@50mm"}, "no moment@50mm"),
        ({"actuator": "voltage"}, "the simulated arm has no motor"),
    ],
)
def test_a_log_of_something_else_is_refused(change: dict[str, str], told: str) -> None:
    log = logged(predicted(), 0.3)
    other = Log(T, log.input, log.output, **change)
    with pytest.raises(sc.InputError, match=told):
        sc.replay(predicted(), other)


def test_a_log_that_ends_too_early_is_refused() -> None:
    log = logged(predicted(), 0.0)
    with pytest.raises(sc.InputError, match="give the whole slew"):
        sc.replay(predicted(), Log(T, log.input[:40], log.output[:40]))
