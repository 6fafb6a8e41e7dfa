"""Slews as they happen: against exact answers, other programs, energy, and themselves."""

from __future__ import annotations

import math
from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_examples import OBJECTIVE, TWO_SENSORS, uniform_arm
from scipy.linalg import expm

import slewctl as sc
from slewctl.design.anti_windup import anti_windup
from slewctl.loop.motion.simulation import _settled
from slewctl.loop.motion.slew_inputs import told
from slewctl.loop.noise import noise_levels

SLEW = sc.Slew(40.0, 2.0, 3.5)
LIMITED = sc.Conditions(saturate=True)


def arm_with(limit: float = 0.5, **changes: float) -> sc.Arm:
    return replace(uniform_arm(**changes), actuator=sc.Actuator(torque_limit=limit))


def loop_of(
    arm: sc.Arm, modes: int = 4, objective: sc.Objective = OBJECTIVE, **clock: float
) -> sc.Loop:
    plant = sc.generalised_plant(sc.assemble(arm, sc.ClampedFree(2)), objective)
    return sc.close(sc.truth(arm, modes), objective, sc.lqg(plant, **clock))


def pd_loop(arm: sc.Arm, modes: int = 3, **options: object) -> sc.Loop:
    """Return a given law of the hub's angle around an arm, every 5 ms."""
    pid = {"kp": 20.0, "kd": 9.0, "filter_hz": 20.0, **options}
    law = sc.given(pid=pid, sample_time=0.005, discretise="tustin")
    return sc.close(sc.truth(arm, modes), OBJECTIVE, law)


def under(loop: sc.Loop, slew: sc.Slew = SLEW, step: float | None = None, **met: object):
    return sc.simulate(loop, replace(slew, conditions=sc.Conditions(**met)), step=step)


@given(st.floats(0, 0.05), st.floats(0.3, 3.0))
@settings(deadline=None, max_examples=8, derandomize=True)
def test_without_conditions_a_sampled_loop_moves_as_it_does_exactly(late, duration) -> None:
    loop = loop_of(uniform_arm(), sample_time=0.02, delay=late)
    slew = sc.Slew(-35.0, duration)
    exact, stepped = sc.simulate_slew(loop, slew, points=3001), sc.simulate(loop, slew)
    at = np.searchsorted(stepped.t, exact.t - 1e-9)
    same = np.abs(stepped.t[at % len(stepped.t)] - exact.t) < 1e-9
    assert same.sum() > 10
    for name in ("theta", "tip", "tip_deflection"):
        size = np.abs(getattr(exact, name)).max()
        found = getattr(stepped, name)[at[same]]
        np.testing.assert_allclose(found, getattr(exact, name)[same], atol=1e-11 * size)
    assert stepped.summary.peak_torque == pytest.approx(exact.summary.peak_torque, rel=1e-9)


def test_without_conditions_a_continuous_loop_moves_as_it_does_exactly() -> None:
    loop = loop_of(uniform_arm(friction=0.1), objective=TWO_SENSORS)
    slew = sc.Slew(40.0, 2.0, 6.0)
    exact, stepped = sc.simulate_slew(loop, slew, points=601), sc.simulate(loop, slew)
    tip = np.interp(exact.t, stepped.t, stepped.tip)  # a straight line between steps
    assert np.abs(tip - exact.tip).max() < 1e-4 * np.abs(exact.tip).max()
    at = np.abs(stepped.t[:, None] - exact.t).argmin(axis=0)
    same = np.abs(stepped.t[at] - exact.t) < 1e-9
    assert same.sum() > 3
    assert np.abs(stepped.tip[at[same]] - exact.tip[same]).max() < 1e-8 * np.abs(exact.tip).max()
    for name in ("residual_m", "peak_torque", "overshoot"):
        value = getattr(exact.summary, name)
        assert getattr(stepped.summary, name) == pytest.approx(value, rel=1e-3)


def by_control(loop: sc.Loop, slew: sc.Slew, t: np.ndarray) -> np.ndarray:
    """Angle, tip and applied torque of the nonlinear arm under a limited law, by python-control."""
    plant = sc.nonlinear_system(loop.model, ("theta", "theta_dot", "tip"))
    A, B, C, D = loop.controller.linear.matrices
    entry = anti_windup(loop.controller)[0]
    inputs, n = told(loop), plant.nstates
    most = slew.conditions.saturate * loop.model.arm.drive.torque_limit or math.inf
    readings = [["theta", "theta_dot", "tip"].index(name) for name in loop.controller.sensors]

    def law(time: float, x: np.ndarray) -> tuple[float, float, np.ndarray]:
        wanted = inputs @ np.array(slew.reference(np.array([time])))[:, 0]
        error = plant.output(time, x[:n], [0.0])[readings] - wanted[:-1]
        asked = float((C @ x[n:] + D @ error)[0] + wanted[-1])
        return asked, float(np.clip(asked, -most, most)), error

    def update(time, x, u, params):
        asked, held, error = law(time, x)
        moved = plant.dynamics(time, x[:n], [held])
        return np.concatenate([moved, A @ x[n:] + B @ error + entry * (held - asked)])

    def output(time, x, u, params):
        theta, _, tip = plant.output(time, x[:n], [0.0])
        return np.array([theta, tip, law(time, x)[1]])

    closed = control.nlsys(update, output, inputs=0, outputs=3, states=n + len(A))
    options = {"rtol": 1e-9, "atol": 1e-12, "max_step": 0.05}
    return control.input_output_response(
        closed, t, solve_ivp_method="DOP853", solve_ivp_kwargs=options
    ).outputs


@pytest.mark.slow
@pytest.mark.parametrize("limit", [0.7, None])
def test_a_limited_nonlinear_slew_is_that_of_python_control(limit: float | None) -> None:
    arm = arm_with(limit or 5.0, friction=0.2)
    loop = loop_of(arm, modes=2, objective=TWO_SENSORS)
    slew = replace(
        sc.Slew(80.0, 2.0, 2.5),
        conditions=sc.Conditions(nonlinear=True, saturate=limit is not None),
    )
    found = sc.simulate(loop, slew, step=0.002)
    few = slice(None, None, 25)
    theta, tip, torque = by_control(loop, slew, found.t[few])
    if limit:
        assert found.summary.saturation_s > 0.1
    # Where a limit begins and ends the two differ by the square of a step.
    assert np.abs(found.theta[few] - theta).max() < 1e-6 * np.abs(theta).max()
    assert np.abs(found.tip[few] - tip).max() < 1e-6 * np.abs(tip).max()
    assert np.abs(found.torque[few] - torque).max() < 5e-5 * np.abs(torque).max()


CONDITIONS = {
    "linear": {},
    "limited": {"saturate": True},
    "nonlinear": {"nonlinear": True, "saturate": True},
    "friction": {"coulomb_friction": 0.05, "static_friction": 0.08},
    "clock": {"encoder_counts": 500, "jitter": 0.002, "missed": 0.05},
}


@pytest.mark.parametrize("name", CONDITIONS)
def test_what_the_drive_gives_and_friction_takes_is_what_the_arm_has(name: str) -> None:
    arm = arm_with(1.0, damping_ratio=0.0)
    found = under(pd_loop(arm), sc.Slew(60.0, 1.5), step=0.0025, **CONDITIONS[name])
    s = found.signals
    rubbed = np.cumsum(s["friction_torque"][:-1] * np.diff(s["theta_motor"]))
    lost = s["energy"][1:] - s["work"][1:] - rubbed
    assert np.abs(lost).max() < (1e-7 if name == "nonlinear" else 1e-11) * s["energy"].max()
    assert s["energy"].max() > 0.1


def geared(play: float = 0.0) -> tuple[sc.Loop, dict[str, float]]:
    joint = sc.Joint(60.0, 0.01, rotor_inertia=0.05)
    arm = replace(arm_with(3.0), joint=joint)
    objective = sc.Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta_motor": 0.01})
    law = sc.given(pid={"kp": 20.0, "kd": 9.0, "filter_hz": 20.0}, inputs=["theta_motor"],
                   sample_time=0.005, discretise="tustin")  # fmt: skip
    loop = sc.close(sc.truth(arm, 4), objective, law)
    return loop, {"backlash_deg": play} if play else {}


def test_play_lets_rotor_and_hub_move_alone_and_takes_no_energy() -> None:
    loop, met = geared(4.0)
    rigid, played = under(loop), under(loop, step=0.001, **met)
    twist = played.signals["theta"] - played.signals["theta_motor"]
    before = rigid.signals["theta"] - rigid.signals["theta_motor"]
    assert np.abs(twist).max() > math.radians(2.0) > np.abs(before).max()
    halves = [under(loop, step=h, **met).tip[-1] for h in (0.002,)] + [played.tip[-1]]
    travel = 1.1 * math.radians(40)
    assert abs(halves[1] - halves[0]) < 1e-3 * travel
    arm = replace(loop.model.arm, damping_ratio=0.0, joint=replace(loop.model.arm.joint, damping=0))
    free = sc.close(sc.truth(arm, 4), loop.objective, loop.controller)
    found = under(free, sc.Slew(40.0, 2.0, 2.5), step=0.0005, **met)
    lost = found.signals["energy"] - found.signals["work"]
    assert np.abs(lost).max() < 2e-3 * found.signals["energy"].max()


@pytest.mark.parametrize(
    ("met", "order"),
    [({"nonlinear": True}, 4), ({"nonlinear": True, "coulomb_friction": 0.05}, 1.5)],
)
def test_the_answer_does_not_depend_on_the_step(met: dict[str, object], order: float) -> None:
    loop = pd_loop(arm_with(stiffness=0.3), modes=1)
    slew = sc.Slew(80.0, 2.0, 2.5)
    one, two, fine = (under(loop, slew, 0.005 / k, **met).tip[-1] for k in (1, 2, 8))
    assert abs(two - fine) < max(abs(one - fine) / 2**order * 1.5, 1e-10)
    assert abs(one - fine) < 1e-3


def rigid_like() -> sc.Loop:
    """A stiff arm, which stops as a rigid one."""
    return pd_loop(arm_with(50.0, stiffness=1e5, damping_ratio=0.2), modes=1)


def test_dry_friction_stops_an_arm_where_it_should_and_holds_it() -> None:
    loop = rigid_like()
    # Pushed by a load against friction alone: the law is slow beside it, and holds it after.
    inertia, friction = float(loop.model.mass[0, 0]), 3.0
    load = sc.Load(0.0, torque=8.0, until_s=0.05)
    slew = sc.Slew(1e-9, 0.1, 0.4)
    law = sc.given(pid={"kp": 1e-3, "kd": 1e-4, "filter_hz": 20.0}, sample_time=0.005,
                   discretise="tustin")  # fmt: skip
    loop = sc.close(loop.model, OBJECTIVE, law)
    found = under(loop, slew, loads=(load,), coulomb_friction=friction)
    rate = (8.0 - friction) * 0.05 / inertia
    stop = 0.05 + rate * inertia / friction
    angle = rate * 0.05 / 2 + rate**2 * inertia / friction / 2
    assert found.theta[-1] == pytest.approx(angle, rel=2e-3)
    still = found.t > stop + 0.02
    speed = np.abs(found.signals["theta_motor_dot"])
    assert speed[still].max() < 1e-9 * speed.max()
    assert np.abs(found.signals["friction_torque"]).max() == pytest.approx(friction, rel=1e-12)
    # Below what breaks it loose nothing moves at all.
    held = under(loop, slew, loads=(sc.Load(0.0, torque=2.9),), coulomb_friction=friction)
    assert np.abs(held.theta).max() < 1e-6 * angle


def test_friction_that_sticks_lets_go_later_than_it_slides() -> None:
    loop = rigid_like()
    slides = under(loop, step=0.005, coulomb_friction=0.3)
    sticks = under(loop, step=0.005, coulomb_friction=0.3, static_friction=0.6)
    moved = [np.argmax(np.abs(r.theta) > 1e-6) for r in (slides, sticks)]
    assert moved[1] > moved[0]
    assert np.abs(sticks.signals["friction_torque"]).max() == pytest.approx(0.6, rel=0.05)


def test_a_load_bends_the_arm_and_the_law_holds_it() -> None:
    arm = arm_with(50.0, damping_ratio=0.2)
    loop = pd_loop(arm, modes=10)
    slew = sc.Slew(1e-9, 0.5, 25.0)
    on_hub = under(loop, slew, loads=(sc.Load(0.1, torque=0.4),))
    assert on_hub.theta[-1] == pytest.approx(0.4 / 20.0, rel=1e-6)
    assert on_hub.theta[on_hub.t < 0.1].max() < 1e-9
    on_tip = under(loop, slew, loads=(sc.Load(0.1, tip_force=0.1),))
    assert on_tip.theta[-1] == pytest.approx(0.1 * 1.1 / 20.0, rel=1e-6)
    # A cantilever of EI = L = 1: F L³/3EI; ten modes have all but 1e-4 of it.
    assert on_tip.tip_deflection[-1] == pytest.approx(0.1 / 3, rel=1e-4)
    gone = under(loop, slew, loads=(sc.Load(0.1, tip_force=0.1, until_s=0.2),))
    assert abs(gone.tip[-1]) < 1e-3 * abs(on_tip.tip[-1])


def test_limits_hold_at_all_times() -> None:
    loop = pd_loop(arm_with(0.8))
    found = under(loop, saturate=True, rate_limit=4.0)
    assert found.summary.peak_torque <= 0.8
    assert np.abs(np.diff(found.signals["applied"])).max() <= 4.0 * 0.005 * (1 + 1e-9)
    assert 0 < found.summary.saturation_s < SLEW.end
    free = under(loop)
    assert free.summary.saturates
    assert free.summary.saturation_s == 0
    motor = sc.Motor(2.0, 0.05, 0.05, gear_ratio=20.0, torque_limit=0.9, voltage_limit=2.5)
    driven = replace(uniform_arm(), motor=motor)
    found = under(pd_loop(driven), sc.Slew(90.0, 1.2), saturate=True)
    assert found.summary.peak_torque <= 0.9
    # The speed changes a little over a step, and the back-EMF with it.
    assert found.summary.peak_voltage < 2.5 * 1.02
    volts = sc.Objective({"tip": 0.1, "voltage": 1.0}, {"torque": 0.1, "theta": 0.01})
    law = sc.given(pid={"kp": 40.0, "kd": 18.0, "filter_hz": 20.0}, output="voltage",
                   sample_time=0.005, discretise="tustin")  # fmt: skip
    loop = sc.close(sc.truth(driven, 3), volts, law)
    found = under(loop, sc.Slew(90.0, 1.2), saturate=True)
    assert found.summary.peak_voltage <= 2.5
    assert found.summary.peak_torque < 0.9 * 1.02


@pytest.mark.parametrize("clock", [{}, {"sample_time": 0.02}, {"sample_time": 0.02, "delay": 0.05}])
def test_an_observer_that_sees_the_limited_input_has_its_own_poles(clock: dict[str, float]) -> None:
    arm = uniform_arm()
    plant = sc.generalised_plant(sc.assemble(arm, sc.ClampedFree(2)), OBJECTIVE)
    law = sc.lqg(plant, **clock)
    A, _, C, _ = law.linear.matrices
    found = np.linalg.eigvals(A - np.outer(anti_windup(law)[0], C[0]))
    if clock:
        sampled = sc.sampled_plant(plant, 0.02, clock.get("delay", 0.0))
        # x̂⁺ = A (I − M C) x̂ + …: the inputs on their way are known.
        n, size = len(plant.A), len(sampled.A)
        M = np.zeros((size, 1))
        M[:n] = law.gains["observer"]
        wanted = np.linalg.eigvals(sampled.A @ (np.eye(size) - M @ sampled.C))
    else:
        wanted = np.linalg.eigvals(plant.A - law.gains["observer"] @ plant.C2)
    for pole in wanted:
        assert np.abs(found - pole).min() < 1e-7 * max(1.0, abs(pole))


def test_a_discretised_observer_sees_the_limited_input_too() -> None:
    plant = sc.generalised_plant(sc.assemble(uniform_arm(), sc.ClampedFree(2)), OBJECTIVE)
    T = 1e-4
    law = sc.h2_lmi(plant, sample_time=T)
    A, _, C, _ = law.linear.matrices
    found = np.linalg.eigvals(A - np.outer(anti_windup(law)[0], C[0]))
    own = law.continuous.gains["observer"]
    for pole in np.linalg.eigvals(plant.A - own @ plant.C2):
        assert np.abs(np.log(found.astype(complex)) / T - pole).min() < 2e-2 * abs(pole)


# A PD law, with what is added to it: two integrals, a resonator of 1 Hz, one that grows.
WOUND = {
    "an integrator": ([0.5, 0.2], [1.0, 0.0, 0.0]),
    "a pole at 1 Hz": ([0.2, 0.0], [1.0, 0.0, (2 * np.pi) ** 2]),
    "a pole at 1.5 Hz": ([0.2, 0.0], [1.0, -0.1, (3 * np.pi) ** 2]),
}


@pytest.mark.parametrize("what", WOUND)
@pytest.mark.parametrize("sample_time", [0.0, 0.002])
def test_what_winds_up_otherwise_is_told_so_and_does(what: str, sample_time: float) -> None:
    top, bottom = WOUND[what]
    pd = ([0.05, 0.6], [0.005, 1.0])
    num = np.polyadd(np.polymul(pd[0], bottom), np.polymul(top, pd[1]))
    clock = {"sample_time": sample_time, "discretise": "tustin"} if sample_time else {}
    law = sc.given(num=list(num), den=list(np.polymul(pd[1], bottom)), feedback="negative", **clock)
    entry, told_of = anti_windup(law)
    assert told_of == f"{what} winds up, and nothing leads it back"
    A, B, C, _ = law.linear.matrices
    left = A - np.outer(entry, C[0])  # while the command is cut and a reading stays
    T = sample_time or 0.002
    step = left if sample_time else expm(left * T)

    def largest(start: int) -> float:
        """Of what is asked for within a second."""
        states = [np.linalg.matrix_power(step, start) @ B]
        for _ in range(int(1 / T)):
            states.append(step @ states[-1])
        return float(np.abs(C @ np.hstack(states)).max())

    assert largest(60_000) > 0.5 * largest(500)


def test_an_integrator_is_led_back() -> None:
    arm = arm_with(0.6, friction=0.3)
    loop = pd_loop(arm, ki=15.0)
    slew = sc.Slew(90.0, 1.0, 8.0)
    told_of, alone = (under(loop, slew, saturate=True, anti_windup=a) for a in (True, False))
    assert told_of.anti_windup == "the integral is led back"
    assert told_of.summary.overshoot < 0.6 * alone.summary.overshoot
    entry, _ = anti_windup(loop.controller)
    A, _, C, _ = loop.controller.linear.matrices
    led = np.linalg.eigvals(A - np.outer(entry, C[0]))
    # T_t = T_i = kp/ki, and the other pole of the law stays.
    # (of a trapezoidal rule kp and half a sample of the integral).
    assert np.abs(led - math.exp(-0.005 * 15 / (20 + 15 * 0.0025))).min() < 1e-9
    assert np.abs(np.sort(np.abs(led))[0] - np.sort(np.abs(np.linalg.eigvals(A)))[0]) < 1e-9


def test_an_encoder_reads_in_steps() -> None:
    loop = pd_loop(arm_with())
    counts = 400
    coarse, fine = under(loop, encoder_counts=counts), under(loop, encoder_counts=10**9)
    step = 2 * math.pi / counts
    assert np.abs(fine.theta - under(loop).theta).max() < 1e-6
    assert 1e-3 * step < np.abs(coarse.theta - fine.theta).max() < 5 * step


def test_a_seed_makes_chance_the_same_again() -> None:
    loop = pd_loop(arm_with())
    met = {"noise": True, "jitter": 0.002, "missed": 0.1}
    once, again, other = (under(loop, seed=seed, **met) for seed in (4, 4, 5))
    assert once.seed == 4
    np.testing.assert_array_equal(once.tip, again.tip)
    assert abs(once.tip[-1] - other.tip[-1]) > 0
    assert under(loop).seed is None


def test_a_missed_sample_leaves_the_command_as_it_is() -> None:
    found = under(pd_loop(arm_with()), missed=0.3, seed=1)
    at = found.signals["command"][np.searchsorted(found.t, 0.005 * np.arange(400) - 1e-9)]
    moving = at[10:300]
    assert 0.2 < np.mean(np.diff(moving) == 0) < 0.4


def test_noise_is_as_strong_as_the_problem_says() -> None:
    loop = pd_loop(arm_with(damping_ratio=0.05))
    slew = sc.Slew(1e-9, 1.0, 80.0)
    found = under(loop, slew, step=0.005, noise=True, seed=3)
    late = found.t > 10
    levels = noise_levels(loop)
    assert found.torque[late].std() == pytest.approx(levels.torque, rel=0.02)
    # The tip moves slowly: 70 s are some thirty independent values of it.
    assert found.tip[late].std() == pytest.approx(levels.tip, rel=0.3)


def test_jitter_is_late_and_no_more_than_it_may_be() -> None:
    loop = pd_loop(arm_with())
    plain, late = under(loop), under(loop, jitter=0.0025, seed=2)
    begun = np.flatnonzero(np.diff(late.signals["applied"]) != 0) + 1
    after = late.t[begun] / 0.005 % 1
    after = np.where(after > 1 - 1e-6, 0.0, after)
    assert after.max() <= 0.5 + 1e-9
    assert after.std() > 0.1
    assert 0 < np.abs(np.interp(plain.t, late.t, late.tip) - plain.tip).max() < 0.02


@pytest.mark.parametrize(
    ("met", "told_"),
    [
        ({"saturate": True}, "has no limit"),
        ({"backlash_deg": 1.0}, "no joint"),
        ({"jitter": 0.004}, "at most 0.0025 s"),
        ({"missed": 1.0}, "0 <= missed < 1"),
        ({"static_friction": 0.1, "coulomb_friction": 0.2}, "at least 0.2"),
        ({"seed": 1}, "nothing is random"),
        ({"anti_windup": False}, "nothing limits"),
        ({"coulomb_friction": -1.0}, "coulomb_friction"),
        ({"encoder_counts": 0}, "encoder_counts"),
        ({"loads": (1,)}, "Load"),
    ],
)
def test_what_an_arm_has_not_is_refused(met: dict[str, object], told_: str) -> None:
    with pytest.raises(sc.InputError, match=told_):
        under(pd_loop(uniform_arm()), **met)


@pytest.mark.parametrize("name", ["rate_limit", "encoder_counts", "jitter", "missed"])
def test_a_continuous_law_has_no_clock(name: str) -> None:
    value = {"encoder_counts": 100, "missed": 0.1}.get(name, 1e-3)
    with pytest.raises(sc.InputError, match=rf"slew\.conditions\.{name}: a continuous law"):
        under(loop_of(uniform_arm()), **{name: value})


@pytest.mark.parametrize("decay", [0.02, 0.1, 0.5])
def test_what_has_settled_has_for_every_longer_horizon(decay: float) -> None:
    """A tip that only crosses its band as the horizon comes has not settled."""
    t = np.linspace(0.0, 80.0, 40001)
    error, band = np.exp(-decay * t) * np.cos(3 * t), 0.3
    away, true = np.abs(error), _settled(t, error, band)
    assert band == pytest.approx(np.interp(true, t, away), rel=1e-3)
    assert away[t > true].max() <= band
    told = {_settled(t[:end], error[:end], band) for end in range(200, len(t), 40)}
    assert told == {true, math.inf}


def test_a_simulation_draws_and_tells_itself() -> None:
    pytest.importorskip("matplotlib").use("Agg")
    found = under(pd_loop(arm_with()), saturate=True)
    assert str(found).startswith(
        f"slew as it happens: not seen settled by {found.t[-1]:.4g} s, residual"
    )
    for what in ("tip", "error", "torque", "work"):
        assert found.plot(what).lines
    with pytest.raises(sc.InputError, match="what"):
        found.plot("nothing")
    assert {"t", "tip", "applied", "energy"} <= found.rows()[0].keys()


def test_a_voltage_that_limits_the_torque_is_met_to_second_order() -> None:
    """What the back-EMF leaves of it changes while a sample is held."""
    rig = sc.arms.quanser_flexible_link()
    assert rig.motor is not None
    arm = replace(rig, motor=replace(rig.motor, voltage_limit=1.2))
    slew = sc.Slew(60.0, 0.8, conditions=sc.Conditions(saturate=True))
    asked = sc.Problem(
        arm, {"tip": 0.03, "torque": 0.5}, {"torque": 0.01, "theta": 0.001}, slew=slew
    )
    K = sc.lqg(asked.plant("clamped-free", n=2), sample_time=0.004)
    t = np.linspace(0, 1.5, 301)
    found = [asked.simulate(K, step=step) for step in (2e-3, 1e-3, 2.5e-4)]
    coarse, fine, exact = (np.interp(t, each.t, each.signals["theta"]) for each in found)
    for each in found:
        assert np.abs(each.signals["voltage"]).max() == pytest.approx(1.2, rel=1e-12)
    assert np.abs(fine - exact).max() < 0.4 * np.abs(coarse - exact).max()
    assert np.abs(fine - exact).max() < 2e-5


@pytest.mark.parametrize("late", [0.0, 0.006])
def test_a_torque_that_is_cut_takes_all_the_voltage_there_is(late: float) -> None:
    """The drive knows its speed while it acts: what it had when a sample was read is no limit."""
    rig = sc.arms.quanser_flexible_link()
    assert rig.motor is not None
    arm = replace(rig, motor=replace(rig.motor, voltage_limit=1.2),
                  actuator=sc.Actuator(delay=late))  # fmt: skip
    slew = sc.Slew(60.0, 0.8, conditions=sc.Conditions(saturate=True))
    asked = sc.Problem(
        arm, {"tip": 0.03, "torque": 0.5}, {"torque": 0.01, "theta": 0.001}, slew=slew
    )
    K = sc.lqg(asked.plant("clamped-free", n=2), sample_time=0.004)
    s = asked.simulate(K).signals
    cut = np.abs(s["command"] - s["applied"]) > 1e-9
    assert cut.any()
    assert set(np.abs(s["voltage"][cut])) == {1.2}  # not by a rounding beyond what is required


def test_a_voltage_that_is_cut_takes_the_torque_there_is_and_no_rounding_more() -> None:
    rig = sc.arms.quanser_flexible_link()
    assert rig.motor is not None
    arm = replace(rig, motor=replace(rig.motor, torque_limit=0.05, voltage_limit=None))
    slew = sc.Slew(60.0, 0.8, conditions=sc.Conditions(saturate=True))
    asked = sc.Problem(
        arm, {"tip": 0.03, "voltage": 5.0}, {"torque": 0.01, "theta": 0.001}, slew=slew
    )
    K = sc.lqg(asked.plant("clamped-free", n=2), sample_time=0.004)
    s = asked.simulate(K).signals
    assert np.any(np.abs(s["command"] - s["applied"]) > 1e-9)
    assert np.abs(s["torque"]).max() == 0.05
