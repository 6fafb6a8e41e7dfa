"""Lags and dead time of actuator and sensors, against e^(−sT) and transfer functions themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import slewctl as sc
from slewctl.compare import destabilised_mode
from slewctl.files import read_arm
from slewctl.loop.delayed import DelayedLoop
from slewctl.loop.noise import noise_levels
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import loop_dead_time
from slewctl.plant.dead_time import pade

PLAIN = sc.Arm(
    sc.arms.paper_beam().beam,
    sc.Hub(0.1, friction=0.01),
    sc.Payload(0.1, 0.001),
    damping_ratio=0.01,
    motor=sc.Motor(2.0, 0.05, 0.05, gear_ratio=10.0, rotor_inertia=1e-4),
)
LAGGED = replace(
    PLAIN,
    actuator=sc.Actuator(lag=0.003, frequency_hz=40.0, damping_ratio=0.6),
    sensors={"theta": sc.Sensor(lag=0.001), "tip": sc.Sensor(frequency_hz=60.0)},
)
LIMITS = {"tip": 0.03, "torque": 1.0}
NOISE = {"torque": 0.1, "theta": 0.01}
OMEGA = np.geomspace(0.05, 3e3, 60)


def problem(arm: sc.Arm, **noise: float) -> sc.Problem:
    return sc.Problem(arm, LIMITS, {**NOISE, **noise})


def late(seconds: float, arm: sc.Arm = LAGGED) -> sc.Arm:
    return replace(arm, actuator=replace(arm.drive, delay=seconds))


def on_axis(system: LinearSystem, s: np.ndarray) -> np.ndarray:
    """C(s − A)⁻¹B + D by the eigenvectors of A, shape (p, m, len(s))."""
    poles, V = np.linalg.eig(system.A)
    left, right = system.C @ V, np.linalg.solve(V, system.B.astype(complex))
    values = np.einsum("pk,ks,km->pms", left, 1 / (s[None] - poles[:, None]), right)
    return np.asarray(values + system.D[:, :, None])


def lag(part: sc.Actuator | sc.Sensor, s: np.ndarray) -> np.ndarray:
    """The lags as one writes them, with the default damping ratio of 0.7."""
    found = 1 / (part.lag * s + 1)
    if part.frequency_hz is not None:
        w = 2 * np.pi * part.frequency_hz
        found = found * w**2 / (s**2 + 2 * (part.damping_ratio or 0.7) * w * s + w**2)
    return found * np.exp(-part.delay * s)


@pytest.mark.parametrize("input", ["torque", "voltage"])
def test_lags_are_factors_of_the_transfer_function(input: str) -> None:
    limits, s = {"tip": 0.03, input: 1.0}, 1j * OMEGA
    noise = {**NOISE, "tip": 0.01}
    bare, whole = (
        sc.Problem(arm, limits, noise).plant("hub-matched", 2).control_path(s)[:, 0]
        for arm in (PLAIN, LAGGED)
    )
    for k, name in enumerate(("theta", "tip")):
        wanted = bare[k] * lag(LAGGED.drive, s) * lag(LAGGED.sensor(name), s)
        np.testing.assert_allclose(whole[k], wanted, rtol=1e-9)
    # The state space has the arm's own signals, behind the actuator alone.
    model = sc.assemble(LAGGED, "hub-matched", 2)
    own = sc.state_space(model, ["theta", "tip"], input=input)(s)[:, 0]  # type: ignore[arg-type]
    np.testing.assert_allclose(own, bare * lag(LAGGED.drive, s), rtol=1e-7)


def test_the_disturbance_meets_the_arm_itself() -> None:
    bare, lagged = (problem(arm).plant("hub-matched", 2).linear for arm in (PLAIN, LAGGED))
    one, other = (G.to_control()(1j * OMEGA)[0, 0] for G in (bare, lagged))
    np.testing.assert_allclose(other, one, rtol=1e-9)


def test_pade_is_an_all_pass_as_good_as_said() -> None:
    A, B, C, D = pade(0.01)
    s = np.array([0.3, 1.0, 2.0, 4.0]) * 1j / 0.01
    found = np.array([(C @ np.linalg.solve(x * np.eye(4) - A, B) + D)[0, 0] for x in s])
    assert np.abs(found) == pytest.approx(np.ones(4), rel=1e-12)
    off = np.abs(np.angle(found * np.exp(0.01 * s)))
    assert np.all(off < [1e-11, 1e-7, 5e-5, 1.1e-2])
    assert off[2] > 1e-5  # and no better


def test_stability_and_margins_are_those_of_the_exact_dead_time() -> None:
    asked = problem(LAGGED)
    K = sc.lqg(asked.plant("hub-matched", 2))
    prompt = sc.close(asked.truth, asked.objective, K)
    limit = prompt.margins.delay_s.value
    for share, stable in ((0.999999, True), (1.000001, False)):
        loop = sc.close(sc.truth(late(share * limit), 20), asked.objective, K)
        assert isinstance(loop, DelayedLoop)
        assert loop.stable is stable
    seconds = 0.4 * limit
    loop = sc.close(sc.truth(late(seconds), 20), asked.objective, K)
    m = loop.margins
    assert m.confirmed
    assert m.delay_s.value == pytest.approx(0.6 * limit, rel=1e-9)
    wanted = prompt.response(OMEGA) * np.exp(-1j * OMEGA * seconds)
    np.testing.assert_allclose(loop.response(OMEGA), wanted, rtol=1e-9)
    # Values on the axis at the limits themselves.
    for crossing in (m.gain_db, m.phase_deg, m.modulus):
        at = loop.response(np.array([2 * np.pi * crossing.frequency_hz]))[0]
        if crossing is m.gain_db:
            assert at == pytest.approx(-(10 ** (-crossing.value / 20)), rel=1e-8)
        elif crossing is m.phase_deg:
            assert abs(np.degrees(np.angle(-at))) == pytest.approx(crossing.value, rel=1e-8)
        else:
            assert abs(1 + at) == pytest.approx(crossing.value, rel=1e-6)
    # The same by `margins` of plant and controller, and of the loop with a skewed disk.
    assert sc.margins(loop.plant, K).gain_db.value == pytest.approx(m.gain_db.value, rel=1e-9)
    assert sc.margins(loop, skew=0.5).confirmed
    assert sc.margins(prompt, delay=seconds).phase_deg.value == pytest.approx(
        m.phase_deg.value, rel=1e-9
    )


@pytest.mark.parametrize(("seconds", "stable"), [(0.8, True), (1.4, False), (1.8, True)])
def test_where_the_approximation_is_wrong_the_exact_dead_time_decides(
    seconds: float, stable: bool
) -> None:
    """Padé's loop is stable at 0.8 s and 1.4 s and not at 1.8 s; the encirclements say which is."""
    arm = late(seconds, replace(PLAIN, hub=sc.Hub(0.1, friction=0.05)))
    asked = problem(arm)
    pid = {"kp": 0.004, "kd": 0.1, "filter_hz": 20.0}
    K = sc.given(pid=pid, inputs=["theta"], output="torque")
    loop = sc.close(sc.truth(arm, 5), asked.objective, K)
    assert loop.stable is stable
    assert bool(loop.poles.real.max() < 0) is (seconds != 1.8)
    # One pole at the origin and no unstable one: 1 + L turns by a quarter, or encircles 0.
    omega = np.geomspace(1e-6, 1e5, 400_000)
    turned = np.unwrap(np.angle(1 + loop.response(omega)))
    assert bool(abs(turned[-1] - turned[0] - np.pi / 2) < 0.1) is stable
    if seconds == 1.8:
        assert loop.margins.confirmed
        assert "approximation of order 4" in loop.describe()
        with pytest.raises(sc.AccuracyError, match="margins and stability are exact"):
            _ = loop.h2
    elif not stable:
        assert loop.describe().startswith("UNSTABLE")
        with pytest.raises(sc.UnstableLoopError):
            _ = loop.margins


def test_where_the_dead_time_lies_does_not_matter() -> None:
    asked = problem(LAGGED)
    K = sc.lqg(asked.plant("hub-matched", 2))
    both = replace(late(0.004), sensors={"theta": replace(LAGGED.sensor("theta"), delay=0.006)})
    assert loop_dead_time(both, ["theta"]) == pytest.approx(0.01)
    one, two = (sc.close(sc.truth(arm, 8), asked.objective, K) for arm in (late(0.01), both))
    assert one.h2.value == pytest.approx(two.h2.value, rel=1e-9)
    assert one.margins.phase_deg.value == pytest.approx(two.margins.phase_deg.value, rel=1e-9)


def test_cost_and_noise_against_the_integral_with_the_exact_dead_time() -> None:
    asked = problem(late(0.01))
    K = sc.lqg(asked.plant("hub-matched", 2))
    loop = sc.close(sc.truth(asked.arm, 4), asked.objective, K)
    P = loop.plant.exact.linear
    # Fine about the resonances, and far beyond them.
    poles = np.concatenate([loop.poles, np.linalg.eigvals(P.A)])
    poles = poles[poles.imag > 0]
    fine = [
        p.imag + np.outer([1, -1], abs(p.real) * np.sinh(np.linspace(0, 9, 400))) for p in poles
    ]
    omega = np.unique(np.concatenate([np.geomspace(1e-4, 1e6, 8000), *map(np.ravel, fine)]))
    omega = omega[omega > 0]
    s = 1j * omega
    G, controller = on_axis(P, s), on_axis(K.linear, s)[0, 0]
    delayed = controller * np.exp(-s * 0.01)
    w, z = 2, 2  # disturbances; z: tip and torque, then the sensor
    closed = 1 / (1 - delayed * G[z, w])
    cost = np.zeros(len(s))
    torque = np.zeros(len(s))
    for k in range(w):
        command = controller * closed * G[z, k]  # of what the sensor reads
        tip = G[0, k] + G[0, w] * command * np.exp(-s * 0.01)
        cost += np.abs(tip) ** 2 + np.abs(command) ** 2  # the torque's limit is 1
        torque += np.abs(command * lag(LAGGED.drive, s)) ** 2
    assert loop.h2.value == pytest.approx(np.trapezoid(cost, omega) / np.pi, rel=2e-4)
    level = np.sqrt(np.trapezoid(torque, omega) / np.pi)
    assert noise_levels(loop).torque == pytest.approx(level, rel=2e-4)


def test_a_design_that_knows_the_dead_time_stands_it() -> None:
    arm = late(0.06)
    blind = sc.lqg(problem(LAGGED).plant("hub-matched", 2))
    asked = problem(arm)
    assert not asked.judge(blind).stable
    for options in ({}, {"sample_time": 0.02}, {"sample_time": 0.05, "delay": 0.01}):
        judged = asked.judge(sc.lqg(asked.plant("hub-matched", 2), **options))
        assert judged.controller.certificate.verified
        assert judged.stable
        assert 0 <= judged.loss < 0.05


@pytest.mark.slow
def test_a_sampled_loop_is_delayed_exactly() -> None:
    """Dead time of the arm is computation time of the controller."""
    asked, own = problem(LAGGED), problem(late(0.013))
    K = sc.lqg(asked.plant("hub-matched", 2), sample_time=0.02, delay=0.018)
    quick = replace(K, delay=0.005)
    one = sc.close(sc.truth(asked.arm, 6), asked.objective, K)
    two = sc.close(sc.truth(own.arm, 6), own.objective, quick)
    assert one.stable
    np.testing.assert_allclose(two.closed.A, one.closed.A, rtol=1e-12, atol=1e-15)
    assert two.h2.value == pytest.approx(one.h2.value, rel=1e-12)
    assert two.margins.phase_deg.value == pytest.approx(one.margins.phase_deg.value, rel=1e-9)
    assert noise_levels(two).torque == pytest.approx(noise_levels(one).torque, rel=1e-9)
    first, second = (sc.simulate_slew(loop, sc.Slew(30.0, 2.0), 21) for loop in (one, two))
    np.testing.assert_allclose(second.tip, first.tip, rtol=1e-9, atol=1e-12)
    stands = [sc.hybrid_delay_margin(loop).seconds for loop in (one, two)]
    assert stands[1] == pytest.approx(stands[0], rel=1e-9)
    assert sc.margins(two, delay=0.001).confirmed
    # Designed for it, the law is the one that is designed for the delay.
    same = sc.lqg(own.plant("hub-matched", 2), sample_time=0.02, delay=0.005)
    np.testing.assert_allclose(
        same.gains["state_feedback"], K.gains["state_feedback"], rtol=1e-6, atol=1e-9
    )
    assert same.delay == 0.005


def test_a_slew_with_lag_and_dead_time() -> None:
    """With hardly any of both it is the slew without; the torque is that which acts."""
    asked = problem(PLAIN)
    K = sc.lqg(asked.plant("hub-matched", 2))
    bare = sc.simulate_slew(sc.close(asked.truth, asked.objective, K), sc.Slew(30.0, 2.0), 41)
    gaps = []
    for seconds in (1e-3, 1e-4):
        drive = sc.Actuator(lag=seconds, delay=seconds)
        loop = sc.close(sc.truth(replace(PLAIN, actuator=drive), 20), asked.objective, K)
        moved = sc.simulate_slew(loop, sc.Slew(30.0, 2.0), 41)
        gaps.append([np.abs(getattr(moved, w) - getattr(bare, w)).max() for w in ("tip", "torque")])
    assert np.array(gaps[0]) / gaps[1] == pytest.approx([10, 10], rel=0.2)  # in proportion


def test_an_accelerometer_with_a_lag() -> None:
    """White torque noise has no variance at an accelerometer, but has one behind its lag."""
    with pytest.raises(sc.InputError, match="give its sensor a lag"):
        problem(PLAIN, tip_acceleration=10.0).plant("hub-matched", 2)
    arm = replace(PLAIN, sensors={"tip_acceleration": sc.Sensor(frequency_hz=30.0)})
    asked = problem(arm, tip_acceleration=10.0)
    judged = asked.judge(sc.lqg(asked.plant("hub-matched", 3)))
    assert judged.stable
    assert judged.margins.confirmed


def test_a_torque_limit_without_a_motor() -> None:
    arm = replace(PLAIN, motor=None)
    asked = problem(arm)
    K = sc.lqg(asked.plant("hub-matched", 2))
    peak = asked.judge(K).response.summary.peak_torque
    for share, saturates in ((0.99, True), (1.01, False)):
        limited = problem(replace(arm, actuator=sc.Actuator(torque_limit=share * peak)))
        judged = limited.judge(K)
        assert judged.response.summary.saturates is saturates
        assert ("the actuator has" in judged.saturation) is saturates
    weak = sc.Motor(2.0, 0.05, 0.05, torque_limit=1.0)
    both = replace(PLAIN, motor=weak, actuator=sc.Actuator(torque_limit=2.0))
    assert len(both.exceeded(1.5)) == 1
    assert len(both.exceeded(2.5)) == 2


def test_the_mode_that_is_lost_is_named() -> None:
    asked = problem(LAGGED)
    system = sc.given(D=[[30.0]], inputs=["theta"], feedback="negative")
    lost = destabilised_mode(sc.close(asked.truth, asked.objective, system))
    assert lost is not None


def test_by_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(late(0.01).to_toml())
    assert read_arm(path) == late(0.01)
    text = path.read_text().replace("theta =", "thet =")
    path.write_text(text)
    with pytest.raises(sc.InputError, match="did you mean 'theta'"):
        read_arm(path)


def test_what_cannot_be_done_is_refused_by_name() -> None:
    unlike = replace(PLAIN, sensors={"theta": sc.Sensor(delay=0.01)})
    with pytest.raises(sc.InputError, match="unlike dead times"):
        problem(unlike, tip=0.01).plant("hub-matched", 2)
    asked = problem(LAGGED)
    plant = asked.plant("hub-matched", 2)
    assert plant.model is not None
    loop = asked.judge(sc.lqg(plant)).loop
    with pytest.raises(sc.InputError, match="does not take into account"):
        sc.small_gain(loop, plant.model)
    with pytest.raises(sc.InputError, match="payload_lmi: the actuator has a lag"):
        sc.payload_lmi(plant, payload_mass=[0.0, 0.1])
    with pytest.raises(sc.InputError, match="nonlinear_system"):
        sc.nonlinear_system(plant.model)
    with pytest.raises(sc.InputError, match="sampled_plant"):
        sc.state_space(sc.assemble(late(0.01), "hub-matched", 1), sample_time=0.01)
    with pytest.raises(sc.InputError, match=r"actuator\.damping_ratio"):
        sc.Actuator(damping_ratio=0.5)
    with pytest.raises(sc.InputError, match=r"sensor\.delay"):
        sc.Sensor(delay=-1.0)
    with pytest.raises(sc.InputError, match=r"arm\.sensors"):
        problem(replace(PLAIN, sensors={"thet": sc.Sensor()})).plant("hub-matched", 2)


@pytest.mark.parametrize(("sensors", "drive"), [(0.02, 0.0), (0.0175, 0.00325), (0.0, 0.00325)])
def test_slews_of_late_sensors_are_those_of_late_readings(sensors: float, drive: float) -> None:
    """A rig that remembers its angle, computes on its clock and pushes late, step by step.

    Each reading is held against the reference of its own time; what is added to the command
    waits for the drive and not for the sensors.
    """
    T, parts, end = 0.005, 20, 1.5
    bare = sc.Arm(sc.Beam(0.38, 0.17, 0.21), sc.Hub(0.0025, friction=0.02), damping_ratio=0.008)
    arm = replace(
        bare, sensors={"theta": sc.Sensor(delay=sensors)}, actuator=sc.Actuator(delay=drive)
    )
    slew = sc.Slew(90.0, 0.6, horizon_s=end)
    law = sc.given(
        pid={"kp": 0.2, "kd": 0.02, "filter_hz": 30.0}, sample_time=T, discretise="tustin"
    )
    asked = sc.Problem(arm, LIMITS, NOISE, slew=slew, truth_modes=8)
    G = sc.state_space(sc.truth(bare, 8), ("theta", "tip"))
    n, K, h = G.nstates, law.linear, T / parts
    step = expm(np.block([[G.A, G.B], [np.zeros((1, n + 1))]]) * h)
    model = asked.truth
    inertia, drag = model.mass[0, 0], model.damping[0, 0]
    x, state = np.zeros(n), np.zeros(K.nstates)
    seen = [np.zeros(2)] * (round(sensors / h) + 1)  # the last is now
    due = [0.0] * round(drive / h)
    times, tips, pushes = [], [], []
    for k in range(round(end / T)):
        ages, acts = k * T - sensors, k * T + drive
        reading = seen[-1 - round(sensors / h)][:1] - slew.reference(np.array([ages]))[0]
        angle, rate, _ = slew.reference(np.array([acts, acts + T]))
        forward = (inertia * np.diff(rate) + drag * np.diff(angle)) / T
        command = float((K.C @ state + K.D @ reading + forward)[0])
        state = K.A @ state + K.B @ reading
        for j in range(parts):
            due.append(command)
            push = due.pop(0)
            times.append(k * T + j * h)
            tips.append(seen[-1][1])
            pushes.append(push)
            x = step[:n] @ np.append(x, push)
            seen.append(G.C @ x)
    t, tip = np.array(times), np.array(tips)
    travel = arm.reach * np.pi / 2
    left = np.abs(tip[t >= slew.duration_s - h / 2] - travel).max()
    for found in (asked.judge(law).response.summary, asked.simulate(law).summary):
        assert found.residual_m == pytest.approx(left, rel=1e-6)
        assert found.peak_torque == pytest.approx(np.abs(pushes).max(), rel=1e-6)
        assert found.overshoot == pytest.approx(tip.max() / travel - 1, rel=1e-3)


def test_what_is_left_at_the_end_of_a_slew_does_not_depend_on_the_clock() -> None:
    law = sc.given(pid={"kp": 0.2, "kd": 0.02, "filter_hz": 30.0}, sample_time=0.005,
                   discretise="tustin")  # fmt: skip
    arm = sc.Arm(sc.Beam(0.38, 0.17, 0.21), sc.Hub(0.0025, friction=0.02), damping_ratio=0.008)
    asked = sc.Problem(arm, LIMITS, NOISE, slew=sc.Slew(90.0, 0.6017, horizon_s=1.5), truth_modes=6)
    exact = asked.judge(law).response.summary
    assert asked.simulate(law).summary.residual_m == pytest.approx(exact.residual_m, rel=1e-9)


@pytest.mark.parametrize("sensors", [0.0, 0.003, 0.02, 0.0499])
@pytest.mark.parametrize(("duration", "points"), [(0.6, 11), (0.6, 800), (0.02, 101)])
def test_curves_of_a_slew_begin_with_it_however_late_the_sensors(
    sensors: float, duration: float, points: int
) -> None:
    arm = sc.Arm(sc.Beam(0.38, 0.17, 0.21), sc.Hub(0.0025, friction=0.02), damping_ratio=0.008,
                 sensors={"theta": sc.Sensor(delay=sensors)})  # fmt: skip
    law = sc.given(pid={"kp": 0.2, "kd": 0.02, "filter_hz": 30.0}, sample_time=0.005,
                   discretise="tustin")  # fmt: skip
    slew = sc.Slew(90.0, duration, horizon_s=1.5)
    asked = sc.Problem(arm, LIMITS, NOISE, slew=slew, truth_modes=4)
    drawn = sc.simulate_slew(asked.judge(law).loop, slew, points)
    assert drawn.t[0] == 0
    assert (drawn.theta[0], drawn.tip[0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert np.all(np.diff(drawn.t) > 0)
    assert 1.5 - 0.15 < drawn.t[-1] <= 1.5 + 1e-9
    if points > 100:
        found = np.abs(drawn.torque).max()
        assert found == pytest.approx(drawn.summary.peak_torque, rel=0.02)
